// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri {

/// Non-overlapping triangles over the plane with heights, in which points are located. It can be
/// rebuilt and queried repeatedly; a tree of boxes over the triangles, O(n log n) to build, about
/// O(log n) per query.
class HeightPatches {
 public:
  using Corner = Point3;
  void clear() { triangles_.clear(); }
  void add(const Corner& a, const Corner& b, const Corner& c) { triangles_.push_back({a, b, c}); }
  void build();
  /// The height of the surface at x, y, linear in the triangle that contains the point; nullopt if
  /// no triangle does, up to rounding.
  [[nodiscard]] std::optional<double> height(double x, double y) const;

 private:
  struct Node {
    std::array<double, 4> box;   // least x, y, greatest x, y
    std::uint32_t first, count;  // triangles of a leaf; count 0: the children are at first, first+1
  };
  // Three times the centroid of a triangle.
  struct Place {
    double x, y;
    std::uint32_t triangle;
  };
  void split(std::uint32_t node, std::uint32_t first, std::uint32_t last);

  std::vector<std::array<Corner, 3>> triangles_, sorted_;
  std::vector<Place> places_;
  std::vector<Node> nodes_;
};

}  // namespace terrace::tri
