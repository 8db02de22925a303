// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>

#include "surface/store_window.hpp"
#include "surface/wanted_clusters.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The places of the points of a level or, to save time, of a coarser one.
struct CoarsePlaces {
  std::vector<Point2> places;
  double each = 1;  ///< points of the level per place
};
/// Returns at most 2^18 places unless the level is the top; in a view at least 2^14, if there are
/// as many. Depends only on the points. Throws: stream::Error on a damaged store, stream::Stopped.
CoarsePlaces coarse_places(const stream::Store& store, unsigned level);

/// Divides a store's area into windows of about `points` points of wanted clusters: boxes, halved
/// until they contain few enough. They depend only on the points. The windows of a halved box have
/// consecutive numbers, so a box may represent them where more points are processed together.
///
/// Windows only group work; their borders are not in results. Bounded meshes need lines that can
/// become sides of the mesh, so they divide the plane by PointMeshCuts instead.
///
/// Counts the points of a coarser level with at most 2^18 points, and scales the counts to the full
/// number. O(n log n) in these points. With focuses, counts the wanted points of the finest such
/// level, each for as many points as are wanted around it.
class WindowTree {
 public:
  /// A window, or a box that was halved into windows.
  struct Part {
    StoredBox box{};                 ///< stored coordinates, closed
    double points = 0;               ///< approximate number
    std::size_t first = 0, end = 0;  ///< range of windows in it
    /// Numbers of the two halves; both 0 for a window.
    std::uint32_t below = 0, above = 0;
    std::uint32_t axis = 0;  ///< the axis that is halved
    double middle = 0;       ///< where it is halved

    [[nodiscard]] bool is_window() const { return below == 0; }
  };

  /// Throws: stream::Error on a damaged store, stream::Stopped.
  WindowTree(const stream::Store& store, const WantedClusters& wanted, std::size_t points);

  [[nodiscard]] std::size_t size() const { return windows_.size(); }
  /// A closed box in stored coordinates; together they cover the store's bounds.
  [[nodiscard]] const StoredBox& box(std::size_t window) const {
    return parts_[windows_[window]].box;
  }
  /// Returns a window that contains the place or, for a place outside, a nearby one.
  [[nodiscard]] std::size_t window_of(const Point2& place) const;

  /// Part 0 is the whole store.
  [[nodiscard]] const Part& part(std::uint32_t number) const { return parts_[number]; }
  /// Visits the largest parts for which takes(part) is true or that are windows, in order.
  template <class Takes, class Visit>
  void for_each_part(const Takes& takes, const Visit& visit, std::uint32_t from = 0) const {
    const Part& part = parts_[from];
    if (part.is_window() || takes(part)) return visit(part);
    for_each_part(takes, visit, part.below);
    for_each_part(takes, visit, part.above);
  }

 private:
  /// A place that stands for `weight` points, times a factor for all places.
  struct Counted {
    Point2 place{};
    double weight = 1;
  };
  static std::vector<Counted> counted_points(const stream::Store& store,
                                             const WantedClusters& wanted);
  std::uint32_t split(const StoredBox& box, std::span<Counted> sample, double each,
                      double max_sample, unsigned depth);

  std::vector<Part> parts_;
  std::vector<std::uint32_t> windows_;  ///< numbers of their parts
};

}  // namespace terrace::terrain
