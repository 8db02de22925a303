// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrace::viewer {

/// Normals at the vertices of a surface whose triangles are added and removed. A normal is the sum
/// of the area vectors of its triangles. Sums are integers, so removing a triangle subtracts
/// exactly what it added, and normals do not depend on the order of changes. O(1) per triangle; 36
/// bytes per vertex.
class BodyNormals {
 public:
  using Node = std::array<std::int32_t, 3>;
  using Corners = std::array<std::uint32_t, 3>;

  void grow(std::size_t slots) {
    nodes_.resize(slots);
    sums_.resize(slots);
  }
  /// Sets the position of a vertex, in [0, 2^30). It must be unchanged, or the vertex must have no
  /// triangle yet.
  void place(std::uint32_t slot, const Node& node) { nodes_[slot] = node; }
  void add(const Corners& corners) { change(corners, 1); }
  /// Requires that its corners have not moved since it was added.
  void remove(const Corners& corners) { change(corners, -1); }
  /// Returns the unit normal times 127, or up if there is none.
  [[nodiscard]] std::array<std::int8_t, 3> operator[](std::uint32_t slot) const {
    std::array<double, 3> sum{};
    for (std::size_t k = 0; k < 3; ++k) sum[k] = static_cast<double>(sums_[slot][k]);
    const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    std::array<std::int8_t, 3> normal{0, 0, 127};
    for (std::size_t k = 0; k < 3 && length > 0; ++k) {
      normal[k] = static_cast<std::int8_t>(std::lround(127 * sum[k] / length));
    }
    return normal;
  }

 private:
  using Sum = std::array<std::int64_t, 3>;

  void change(const Corners& corners, std::int64_t sign) {
    const Node &a = nodes_[corners[0]], &b = nodes_[corners[1]], &c = nodes_[corners[2]];
    const Sum u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      // Up to 2^61. The sum has room for 256 of the largest triangles per vertex.
      const std::int64_t area = (u[i] * v[j] - u[j] * v[i]) / 1024 * sign;
      for (const std::uint32_t corner : corners) sums_[corner][k] += area;
    }
  }

  std::vector<Node> nodes_;
  std::vector<Sum> sums_;
};

}  // namespace terrace::viewer
