// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>

#include "surface/box_tree.hpp"
#include "surface/corner.hpp"
#include "surface/point_hull.hpp"
#include "surface/store_window.hpp"
#include "surface/wanted_clusters.hpp"
#include "surface/window_tree.hpp"

namespace terrace::terrain {

class PointWindow;

/// The border of the voids of a cloud: the points with a triangle whose circumcircle extends beyond
/// a reach, which is a few times the local point spacing. All points with a long or open triangle
/// are among them, so they make a window complete at once. A triangle that meets a box either has a
/// corner that is not a border point, and then it is within reach of the box. Or all its corners
/// are border points, and then it is a triangle of their triangulation. The same holds for circles
/// that contain a place. The border is found in one pass over the store, which costs as much as
/// triangulating it once. That happens at most once, when windows have spent enough time looking
/// for missing points, and usually never. The contents of windows do not depend on it.
///
/// Windows and surfaces (PointSurface) of several threads share one object. The threads that need
/// the border find it together.
class PointVoids {
 public:
  /// The store must outlive this object.
  PointVoids(const stream::Store& store, const WantedClusters& wanted);
  PointVoids(const PointVoids&) = delete;
  PointVoids& operator=(const PointVoids&) = delete;

  /// Counts boxes that were tested for missing points. Returns true if it is now better to find()
  /// the border.
  bool count_looks(std::uint64_t boxes);
  [[nodiscard]] std::uint64_t looks() const { return looks_; }

  /// Finds the border, using the window, unless it is known. Returns false if it is too long for a
  /// quarter of the window's memory, or if all points are collinear. Throws: stream::Error,
  /// stream::Stopped.
  bool find(PointWindow& window);
  [[nodiscard]] bool known() const { return state_ == State::known; }

  // The following require known().
  /// Returns how far around a box there may be points of triangles that meet it and have a corner
  /// that is not a border point.
  [[nodiscard]] double reach(const StoredBox& box) const;
  /// Visits the corners, with heights in the store's vertical unit, of all triangles between border
  /// points that meet the box, each once.
  void for_each(const StoredBox& box, const std::function<void(const SurfaceCorner&)>& visit) const;
  /// Visits at least the corners of all triangles between border points with a circumcircle that
  /// contains a place, some of them more than once. The place must not be outside the hull.
  void for_each_around(const Point2& place, const std::function<void(const Point2&)>& visit) const;

 private:
  enum class State : std::uint8_t { unknown, known, none };
  struct Part {
    std::vector<SurfaceCorner> border;
    double reach = 0;
  };
  void triangulate();

  const stream::Store& store_;
  WantedClusters wanted_;
  std::uint64_t max_looks_;
  std::atomic<std::uint64_t> looks_ = 0;
  std::atomic<State> state_ = State::unknown;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<WindowTree> tree_;
  std::vector<Part> parts_;  ///< one part for each window of tree_
  std::size_t next_ = 0;     ///< the next of parts_ to search
  unsigned at_work_ = 0;     ///< number of threads
  std::size_t points_ = 0;   ///< border points until now

  tri::Delaunay2<double> border_;
  std::vector<double> heights_;  ///< by vertex slot
  BoxTree triangles_;            ///< by triangle slot
};

/// The points of a store's wanted clusters, with their hull and the border of their voids. The
/// windows and surfaces of all threads share one object.
struct PointCloud {
  /// Finds the hull. The store must outlive this object. Throws: stream::Error on a damaged store,
  /// stream::Stopped.
  PointCloud(const stream::Store& cloud, WantedClusters clusters)
      : store(cloud), wanted(std::move(clusters)), hull(cloud, wanted), voids(cloud, wanted) {}

  const stream::Store& store;
  WantedClusters wanted;
  PointHull hull;
  PointVoids voids;
};

}  // namespace terrace::terrain
