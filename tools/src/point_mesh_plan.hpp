// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "region.hpp"

namespace terrace::tools {

inline constexpr std::uint32_t kNoNumber = std::numeric_limits<std::uint32_t>::max();

/// A rectangle of the plane that has its lower borders and not its upper ones; infinite ones too.
struct PlaneBox {
  Point2 min{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  Point2 max{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};

  [[nodiscard]] bool contains(const Point2& p) const {
    return p[0] >= min[0] && p[0] < max[0] && p[1] >= min[1] && p[1] < max[1];
  }
};

/// How the region of irregular samples, their convex hull, is cut into windows that are meshed one
/// by one. Each is a rectangle cut with the hull: convex. No rectangle reaches over a cut line, but
/// one may end within another's side.
struct PointMeshPlan {
  /// Where a cut line ends, at the hull or at another cut line.
  struct Knot {
    Point2 place{};
    bool at_hull = false;
  };
  /// A stretch of a cut line between two knots, with one window on either side.
  struct Side {
    unsigned axis = 0;  ///< 0: of points of equal x
    double line = 0.0;
    std::array<std::uint32_t, 2> knots{};    ///< the lower first
    std::array<std::uint32_t, 2> windows{};  ///< that of smaller coordinates first
  };
  struct Window {
    PlaneBox box;
    double samples = 0.0;              ///< about
    double spacing = 0.0;              ///< about the distance of neighbours
    std::vector<std::uint32_t> sides;  ///< inside the hull
    std::vector<Point2> corners;       ///< of the hull
  };
  std::vector<Knot> knots;
  std::vector<Side> sides;
  std::vector<Window> windows;  ///< neighbours mostly near in order

  /// A node of the tree of cuts: what is below the line and what is not.
  struct Node {
    unsigned axis = 0;
    double line = 0.0;
    std::array<std::uint32_t, 2> next{};  ///< nodes, or kLeaf + a window
  };
  static constexpr std::uint32_t kLeaf = 0x80000000U;
  std::vector<Node> nodes;
  std::uint32_t root = kLeaf;

  [[nodiscard]] std::uint32_t window_of(const Point2& p) const {
    std::uint32_t at = root;
    while (at < kLeaf) {
      const Node& node = nodes[at];
      at = node.next[p[node.axis] < node.line ? 0 : 1];
    }
    return at - kLeaf;
  }
};

/// A cut of samples into windows of at most `most` of them, and hardly fewer, unless too many have
/// one place. `some`: every n-th of the samples, n = `period`. `hull`: of all, with an area.
///
/// Lines run between samples of `some` wherever there is room for a number, in the widest gap near
/// the wanted one. Others may lie on a line: they belong to the window above.
/// Depends on the arguments alone. O(n log n) for n of `some`.
PointMeshPlan plan_point_mesh(std::vector<Point2> some, std::uint64_t period,
                              std::span<const Point2> hull, std::size_t most);

/// A number strictly between a and b of few binary digits, not close to either; a if there is none
/// between. Requires a < b.
double number_between(double a, double b);

}  // namespace terrace::tools
