// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cassert>

#include "insert.hpp"
#include "int_kernel.hpp"
#include "windowed_kernel.hpp"

namespace terrace::tri::planar {
namespace {

/// The smallest set of points that is searched for a lattice.
constexpr std::size_t kMinPoints = 24;
/// Sets whose box has more than this many times as many nodes as points are not searched.
constexpr std::int64_t kMaxNodesPerPoint = 8;
/// At least one point in this many must have all eight neighbours.
constexpr std::size_t kPointsPerInnerPoint = 4;

/// Set in Triangle::corner[0] while squares are cut out.
constexpr std::uint32_t kCutOut = 0x80000000u;

/// Sides of a square.
enum SquareSide : std::uint32_t { kLeft, kRight, kBelow, kAbove };

/// A side of length 1 as seen from the inner one of its two squares.
struct UnitSide {
  std::size_t inner, outer;  ///< squares
  SquareSide side;           ///< side of the inner square
};

template <class Kernel>
class LatticeFill {
 public:
  using Point = typename Kernel::Point;

  LatticeFill(Mesh<Kernel>& mesh, std::span<const Point> points)
      : mesh_(mesh), lattice_(mesh.lattice), points_(points) {}

  void run() {
    lattice_.slots.clear();
    lattice_.outer_sides.assign(4 * lattice_.square_number.size(), kNone);
    for (const std::uint32_t square : lattice_.squares) {
      if (lattice_.square_number[square - 1] == 0 && outer_side(square, kLeft) == kNone) {
        cut_out(at_left_side(square));
      }
    }
    lattice_.inserted.clear();
    for (const std::uint32_t i : lattice_.inner_points) {
      std::uint32_t& vertex = lattice_.vertex[lattice_.node(points_[i])];
      const bool created = vertex == kNone;
      if (created) vertex = mesh_.new_vertex(points_[i]);
      lattice_.inserted.push_back({vertex, created});
    }
    while (lattice_.slots.size() < 2 * lattice_.squares.size()) {
      lattice_.slots.push_back(mesh_.new_triangle());
    }
    write();
    mesh_.last_vertex = lattice_.inserted.back().vertex;
  }

 private:
  [[nodiscard]] Side& outer_side(std::size_t square, SquareSide side) {
    return lattice_.outer_sides[4 * square + side];
  }

  /// The triangle within a square at its left side, which is on the border of the region.
  [[nodiscard]] std::uint32_t at_left_side(std::uint32_t square) const {
    const std::uint32_t low = lattice_.vertex[square];
    const std::uint32_t high = lattice_.vertex[square + lattice_.columns];
    std::uint32_t t = mesh_.incident[low];
    for (;;) {
      const Triangle& at = mesh_.triangle[t];
      const std::array<std::uint32_t, 3> corner{at.corner[0] & ~kCutOut, at.corner[1],
                                                at.corner[2]};
      const std::uint32_t i = corner[0] == low ? 0 : corner[1] == low ? 1 : 2;
      if (corner[previous_index(i)] == high) return t;
      t = triangle_of(at.mate[next_index(i)]);
      assert(t != mesh_.incident[low]);
    }
  }

  /// The squares at an edge of length 1. The one on the left is `inner`.
  [[nodiscard]] UnitSide squares_at(const Point& from, const Point& to) const {
    const std::size_t node = lattice_.node({std::min(from[0], to[0]), std::min(from[1], to[1])});
    if (from[1] == to[1]) {
      const std::size_t under = node - lattice_.columns;
      return to[0] > from[0] ? UnitSide{node, under, kBelow} : UnitSide{under, node, kAbove};
    }
    return to[1] > from[1] ? UnitSide{node - 1, node, kRight} : UnitSide{node, node - 1, kLeft};
  }

  /// Takes out the triangles that are connected with this one and in squares to be filled.
  void cut_out(std::uint32_t first) {
    const auto mark = [&](std::uint32_t t) {
      mesh_.record(t);
      mesh_.triangle[t].corner[0] |= kCutOut;
      lattice_.slots.push_back(t);
    };
    std::size_t next = lattice_.slots.size();
    mark(first);
    for (; next < lattice_.slots.size(); ++next) {
      const Triangle t = mesh_.triangle[lattice_.slots[next]];
      const std::array<std::uint32_t, 3> corner{t.corner[0] & ~kCutOut, t.corner[1], t.corner[2]};
      for (std::uint32_t i = 0; i < 3; ++i) {
        const Point &from = mesh_.point[corner[next_index(i)]],
                    &to = mesh_.point[corner[previous_index(i)]];
        // A point inside may already have had a vertex.
        lattice_.vertex[lattice_.node(from)] = corner[next_index(i)];
        if (std::abs(to[0] - from[0]) + std::abs(to[1] - from[1]) == 1) {
          const UnitSide unit = squares_at(from, to);
          if (lattice_.square_number[unit.outer] == 0) {
            outer_side(unit.inner, unit.side) = t.mate[i];
            continue;
          }
        }
        const std::uint32_t neighbour = triangle_of(t.mate[i]);
        if ((mesh_.triangle[neighbour].corner[0] & kCutOut) == 0) mark(neighbour);
      }
    }
  }

  /// Writes both triangles of each square, as in grid.cpp.
  void write() {
    for (std::uint32_t k = 0; k < lattice_.squares.size(); ++k) {
      lattice_.square_number[lattice_.squares[k]] = k + 1;
    }
    const auto lower = [&](std::size_t square) {
      return lattice_.slots[2 * (lattice_.square_number[square] - 1)];
    };
    const auto upper = [&](std::size_t square) {
      return lattice_.slots[2 * (lattice_.square_number[square] - 1) + 1];
    };
    Triangle* const triangle = mesh_.triangle.data();
    const std::size_t row_stride = lattice_.columns;
    for (const std::uint32_t square : lattice_.squares) {
      // The mate of side i of triangle t. A mate in the next square has the same index.
      const auto mate = [&](SquareSide side, std::size_t next, std::uint32_t t, std::uint32_t i) {
        if (lattice_.square_number[next] != 0) {
          return make_side(side == kLeft || side == kBelow ? upper(next) : lower(next), i);
        }
        const Side outer = outer_side(square, side);
        triangle[triangle_of(outer)].mate[index_of(outer)] = make_side(t, i);
        return outer;
      };
      const std::uint32_t a = lattice_.vertex[square], b = lattice_.vertex[square + 1];
      const std::uint32_t d = lattice_.vertex[square + row_stride],
                          c = lattice_.vertex[square + row_stride + 1];
      const std::uint32_t low = lower(square), high = upper(square);
      triangle[low] = {{a, b, d},
                       {make_side(high, 0), mate(kLeft, square - 1, low, 1),
                        mate(kBelow, square - row_stride, low, 2)}};
      triangle[high] = {{c, d, b},
                        {make_side(low, 0), mate(kRight, square + 1, high, 1),
                         mate(kAbove, square + row_stride, high, 2)}};
      mesh_.incident[a] = mesh_.incident[b] = mesh_.incident[d] = low;
      mesh_.incident[c] = high;
    }
  }

  Mesh<Kernel>& mesh_;
  Lattice& lattice_;
  std::span<const Point> points_;
};

}  // namespace

template <class Kernel>
bool find_lattice(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                  std::uint32_t head) {
  using Point = typename Kernel::Point;
  Lattice& lattice = mesh.lattice;
  if (points.size() < kMinPoints || mesh.flat) return false;
  Point low = points[0], high = low;
  for (const Point& p : points) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  const std::int64_t width = std::int64_t{high[0]} - low[0] + 1;
  const std::int64_t height = std::int64_t{high[1]} - low[1] + 1;
  if (height > kMaxNodesPerPoint * static_cast<std::int64_t>(points.size()) / width) return false;

  // A frame one node wide gives every node neighbours.
  lattice.low = {low[0] - 1, low[1] - 1};
  lattice.columns = static_cast<std::uint32_t>(width + 2);
  const std::size_t nodes = std::size_t{lattice.columns} * static_cast<std::size_t>(height + 2);
  // Holds the numbers of the points until they are inserted.
  lattice.vertex.assign(nodes, kNone);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    std::uint32_t& number = lattice.vertex[lattice.node(points[i])];
    if (number != kNone) return false;  // found twice
    number = i;
  }
  if (head != kNone) {
    const Point& p = mesh.point[head];
    const bool in_window = p[0] >= low[0] && p[0] <= high[0] && p[1] >= low[1] && p[1] <= high[1];
    if (in_window) {
      std::uint32_t& number = lattice.vertex[lattice.node(p)];
      if (number == kNone) number = static_cast<std::uint32_t>(points.size());
    }
  }
  lattice.square_number.assign(nodes, 0);
  lattice.inner_points.clear();
  lattice.outer_points.clear();
  const std::size_t row_stride = lattice.columns;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const std::size_t node = lattice.node(points[i]);
    bool has_all_neighbours = true;
    for (const std::size_t row : {node - row_stride, node, node + row_stride}) {
      for (const std::size_t next : {row - 1, row, row + 1})
        has_all_neighbours &= lattice.vertex[next] != kNone;
    }
    if (!has_all_neighbours) {
      lattice.outer_points.push_back(i);
      continue;
    }
    lattice.inner_points.push_back(i);
    for (const std::size_t square : {node - row_stride - 1, node - row_stride, node - 1, node}) {
      lattice.square_number[square] = 1;
    }
  }
  if (lattice.inner_points.size() < points.size() / kPointsPerInnerPoint) return false;
  lattice.squares.clear();
  for (std::uint32_t square = 0; square < nodes; ++square) {
    if (lattice.square_number[square] != 0) lattice.squares.push_back(square);
  }
  lattice.vertex.assign(nodes, kNone);
  if (head != kNone) {
    const Point& p = mesh.point[head];
    const bool in_window = p[0] >= low[0] && p[0] <= high[0] && p[1] >= low[1] && p[1] <= high[1];
    if (in_window) lattice.vertex[lattice.node(p)] = head;
  }
  return true;
}

template <class Kernel>
void fill_lattice(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points) {
  LatticeFill<Kernel>(mesh, points).run();
}

#ifdef TERRACE_TRI_CORE
template bool find_lattice(Mesh<IntKernel>&, std::span<const IntKernel::Point>, std::uint32_t);
template void fill_lattice(Mesh<IntKernel>&, std::span<const IntKernel::Point>);
template bool find_lattice(Mesh<WindowedKernel>&, std::span<const WindowedKernel::Point>,
                           std::uint32_t);
template void fill_lattice(Mesh<WindowedKernel>&, std::span<const WindowedKernel::Point>);
#endif

}  // namespace terrace::tri::planar
