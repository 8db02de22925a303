// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

inline constexpr std::uint32_t kNoNumber = std::numeric_limits<std::uint32_t>::max();

/// A rectangle of the plane that has its lower borders and not its upper ones; infinite ones too.
struct PlaneBox {
  Point2 min{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  Point2 max{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};

  [[nodiscard]] bool contains(const Point2& p) const {
    return p[0] >= min[0] && p[0] < max[0] && p[1] >= min[1] && p[1] < max[1];
  }
  [[nodiscard]] bool meets(const PlaneBox& other) const {
    return min[0] < other.max[0] && other.min[0] < max[0] && min[1] < other.max[1] &&
           other.min[1] < max[1];
  }
};

/// The plane, cut by lines of equal x or y again and again until every cell has few samples.
struct PointMeshCuts {
  /// What is below a line and what is not.
  struct Node {
    unsigned axis = 0;  ///< 0: a line of equal x
    double line = 0.0;
    std::array<std::uint32_t, 2> next{};      ///< nodes, or kCell + a cell
    std::uint32_t first_cell = 0, cells = 0;  ///< of both
  };
  struct Cell {
    PlaneBox box;
    Point2 low{}, high{};  ///< about the bounds of its samples
    double samples = 0.0;  ///< about
    double spacing = 0.0;  ///< about the distance of neighbours
  };
  static constexpr std::uint32_t kCell = 0x80000000U;
  std::vector<Node> nodes;
  std::vector<Cell> cells;  ///< neighbours mostly near in order
  std::uint32_t root = kCell;

  [[nodiscard]] std::uint32_t cell_of(const Point2& p) const {
    std::uint32_t at = root;
    while (at < kCell) {
      const Node& node = nodes[at];
      at = node.next[p[node.axis] < node.line ? 0 : 1];
    }
    return at - kCell;
  }
};

/// Cuts into cells of at most `most` samples, about and hardly fewer, unless too many have one
/// place. `some`: every n-th of the samples, n = `period`.
///
/// Lines run between samples of `some` wherever there is room for a number, in the widest gap near
/// the wanted one. Others may lie on a line: they belong to the cell above.
/// Depends on the arguments alone. O(n log n) for n of `some`.
PointMeshCuts cut_for_point_mesh(std::vector<Point2> some, std::uint64_t period, std::size_t most);

/// A number strictly between a and b of few binary digits, not close to either; a if there is none
/// between. Requires a < b.
double number_between(double a, double b);

}  // namespace terrace::terrain
