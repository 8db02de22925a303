// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>

#include "surface/wanted_clusters.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The exact strictly convex hull, in x and y, of the points of a store's wanted clusters. Several
/// threads may call const members at once.
class PointHull {
 public:
  /// Descends from the top level and reads only clusters whose box is not inside the hull found so
  /// far; that is a few per cent of a store whose points arrived in spatial order. Throws:
  /// stream::Error on a damaged store, stream::Stopped.
  PointHull(const stream::Store& store, const WantedClusters& wanted);

  /// The corners, counter-clockwise from the least in x, then y. Fewer than three mean that all
  /// points are equal or on one line.
  [[nodiscard]] std::span<const Point2> corners() const { return corners_; }
  [[nodiscard]] bool is_flat() const { return corners_.size() < 3; }

  enum class Side : std::uint8_t { outside, border, inside };
  struct Found {
    Side side = Side::outside;
    /// For places on the border: the corner after the place, counter-clockwise, not equal to it.
    std::size_t next = 0;
  };
  /// Locates a place exactly, in O(log corners). Requires a finite place and a hull that is not
  /// flat.
  [[nodiscard]] Found find(const Point2& place) const;
  /// Returns the distance from a place outside to the hull, in the units of the points; 0 inside;
  /// infinite if the hull has no corners. Accepts a flat hull. O(corners) outside.
  [[nodiscard]] double distance(const Point2& place) const;

 private:
  void set_corners(std::vector<Point2> corners);

  std::vector<Point2> corners_;
  std::size_t greatest_ = 0;  ///< the index of the greatest corner in x, then y
};

}  // namespace terrace::terrain
