// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <terrace/base/box.hpp>

#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri {

/// Triangles on which places are looked up. Over the plane (kAxes 2) the result is the place above
/// or below, in space (3) the nearest place. Triangles belong to parts, and a lookup concerns one
/// part. Rebuilt and queried repeatedly. Keeps a tree of boxes per part: O(n log n) to build, about
/// O(log n) per query.
template <std::size_t kAxes>
class Patches {
 public:
  struct Found {
    Point3 place;
    std::uint32_t triangle;  ///< number in the order of add(), from 0
  };

  void clear() { triangles_.clear(); }
  /// Adds a triangle. part: less than the number of parts. Over the plane the triangles of a part
  /// do not overlap.
  void add(std::uint32_t part, const Point3& a, const Point3& b, const Point3& c) {
    triangles_.push_back({{a, b, c}, part, static_cast<std::uint32_t>(triangles_.size())});
  }
  void build(std::size_t parts);
  /// Over the plane: the place at the same x and y, linear in the triangle that contains them, or
  /// nullopt if none does, up to rounding. In space: the nearest place, edges included, and of
  /// equally near ones the least, or nullopt if the part has no triangle. Fast if the previous
  /// place was near.
  [[nodiscard]] std::optional<Found> find(std::uint32_t part, const Point3& place) {
    if (part >= parts_.size() || parts_[part].root == kNone) return {};
    if constexpr (kAxes == 2) return above(parts_[part], place);
    if constexpr (kAxes == 3) return nearest(parts_[part], place);
  }

 private:
  static constexpr std::size_t kWidth = 8;
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  struct Triangle {
    std::array<Point3, 3> corners;
    std::uint32_t part, number;
  };
  using Box = base::Box<kAxes>;
  /// Boxes of nodes or triangles that are close together, stored axis by axis.
  struct Node {
    std::array<std::array<double, kWidth>, kAxes> low, high;  ///< low > high: no child
    std::uint32_t first;                                      ///< of the children
    bool leaf;                                                ///< the children are triangles
  };
  struct Part {
    std::uint32_t root = kNone,
                  last_triangle = 0;  ///< last_triangle: the one on which a place was last found
  };
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  void sort();
  void add_tree(std::uint32_t first, std::uint32_t last);
  [[nodiscard]] static Box box_of(const Triangle& triangle);
  [[nodiscard]] std::optional<Found> above(const Part& part, const Point3& place) const
      requires(kAxes == 2);
  [[nodiscard]] Found nearest(Part& part, const Point3& place) const requires(kAxes == 3);

  std::vector<Triangle> triangles_, sorted_;
  std::vector<std::array<std::uint64_t, 2>> keys_;  ///< along a curve, and triangles
  std::vector<Box> boxes_;
  std::vector<Node> nodes_;
  std::vector<Part> parts_;
};

extern template class Patches<2>;
extern template class Patches<3>;

}  // namespace terrace::tri
