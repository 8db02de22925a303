// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "surface/circle_cover.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The triangles around a point in the Delaunay triangulation of it and of points that are offered
/// one by one, in any order: exactly those of tri::Delaunay2, ties included.
///
/// A point becomes a neighbour if it is inside the circle of the triangle towards it, or outside
/// the hull. The triangles that it replaces are adjacent, so an offer costs O(log n) with n
/// neighbours; an insertion moves some of them in memory.
class PointStar {
 public:
  void start(const Point2& centre);
  /// Requires finite coordinates.
  void offer(const Point2& point);

  /// Whether a point at the centre itself was offered.
  [[nodiscard]] bool has_centre() const { return has_centre_; }
  /// Whether there are triangles all around; if not, the centre is on the hull.
  [[nodiscard]] bool is_closed() const { return spokes_.size() > 2 && !is_open(); }
  /// Number of neighbours, counter-clockwise; in an open star they go from the first to the last,
  /// both on the hull. At most one while all points are collinear.
  [[nodiscard]] std::size_t size() const { return spokes_.size() - (is_open() ? 1 : 0); }
  [[nodiscard]] const Point2& neighbour(std::size_t i) const { return spokes_[i].end; }

  /// Number of triangles. Triangle i has the centre, neighbour i and the next one as corners.
  [[nodiscard]] std::size_t triangles() const {
    return spokes_.size() < 3 ? 0 : size() - (is_open() ? 1 : 0);
  }
  [[nodiscard]] const Point2& next_neighbour(std::size_t i) const {
    return spokes_[i + 1 < size() ? i + 1 : 0].end;
  }
  [[nodiscard]] CircleCover circle(std::size_t triangle) const {
    return CircleCover::of_triangle({centre_, neighbour(triangle), next_neighbour(triangle)});
  }
  /// A number that a triangle keeps until it is replaced; initially 0.
  [[nodiscard]] unsigned mark(std::size_t triangle) const { return spokes_[triangle].mark; }
  void set_mark(std::size_t triangle, std::uint8_t mark) { spokes_[triangle].mark = mark; }

 private:
  /// The last spoke of an open star represents the outside of the hull.
  struct Spoke {
    Point2 end{};
    bool is_outside = false;
    std::uint8_t mark = 0;  ///< mark of the triangle between this spoke and the next
  };

  [[nodiscard]] bool is_open() const { return !spokes_.empty() && spokes_.back().is_outside; }
  [[nodiscard]] bool is_early(const Point2& point) const;
  [[nodiscard]] std::size_t spoke_before(const Point2& point) const;
  [[nodiscard]] bool is_in_conflict(std::size_t sector, const Point2& point) const;
  void replace(std::size_t first, std::size_t last, const Point2& point);

  Point2 centre_{};
  bool has_centre_ = false;
  std::vector<Spoke> spokes_;
  std::vector<Point2> on_line_;  ///< collinear with the centre and the only neighbour so far
};

}  // namespace terrace::terrain
