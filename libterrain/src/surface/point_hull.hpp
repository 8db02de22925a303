// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The strictly convex hull in x,y of a store's points of a level and above, exactly. Const members
/// may be called by several threads at once.
class PointHull {
 public:
  /// Reads the clusters that lie across the hull of those read before, coarse levels first: a few
  /// per cent where points came in order. Throws: stream::Error on a damaged store,
  /// stream::Stopped.
  PointHull(const stream::Store& store, unsigned level);

  /// Counter-clockwise from the least corner in x, then y. Fewer than three: all points are equal
  /// or on one line.
  [[nodiscard]] std::span<const Point2> corners() const { return corners_; }
  [[nodiscard]] bool is_flat() const { return corners_.size() < 3; }

  enum class Side : std::uint8_t { kOutside, kBorder, kInside };
  struct Found {
    Side side = Side::kOutside;
    /// On the border: the corner after the place, counter-clockwise, which is not the place.
    std::size_t next = 0;
  };
  /// Exact; O(log corners). Requires a finite place, and that the hull is not flat.
  [[nodiscard]] Found find(const Point2& place) const;
  /// How far a place is outside, in the units of the points; 0 inside. O(corners) outside.
  [[nodiscard]] double distance(const Point2& place) const;

 private:
  void set_corners(std::vector<Point2> corners);

  std::vector<Point2> corners_;
  std::size_t greatest_ = 0;  ///< the greatest corner in x, then y
};

}  // namespace terrace::terrain
