// SPDX-License-Identifier: Apache-2.0
// Writes the complete grid directly. All corners of a cell are cocircular, and the perturbation
// gives every cell the diagonal from lower right to upper left: of the four corners the upper right
// one is raised most, so the circle through the other three does not contain it. The same holds in
// the metric Windowed with any step: its lift, like x^2 + y^2, is a sum of a convex function of x
// and one of y, so the lifted corners of a cell are in one plane, and no other vertex is below it.
#include "double_kernel.hpp"
#include "int_kernel.hpp"
#include "operations.hpp"
#include "windowed_kernel.hpp"

namespace terrace::tri::planar {
namespace {

/// Numbers of vertices and triangles of a grid.
struct GridNumbers {
  std::uint32_t columns;
  std::uint32_t rows;
  std::uint32_t first_vertex;

  [[nodiscard]] std::uint32_t vertex(std::uint32_t i, std::uint32_t j) const {
    return first_vertex + j * columns + i;
  }
  /// The triangle at the lower left of cell (i, j). The one at its upper right follows.
  [[nodiscard]] std::uint32_t lower(std::uint32_t i, std::uint32_t j) const {
    return 2 * (j * (columns - 1) + i);
  }
  [[nodiscard]] std::uint32_t upper(std::uint32_t i, std::uint32_t j) const {
    return lower(i, j) + 1;
  }
  // Number of ghosts beyond the hull edges, numbered counter-clockwise from the lower left corner.
  [[nodiscard]] std::uint32_t ghosts() const { return 2 * (columns - 1) + 2 * (rows - 1); }
  [[nodiscard]] std::uint32_t ghost(std::uint32_t number) const {
    return 2 * (columns - 1) * (rows - 1) + number;
  }
  [[nodiscard]] std::uint32_t ghost_below(std::uint32_t i) const { return ghost(i); }
  [[nodiscard]] std::uint32_t ghost_right(std::uint32_t j) const { return ghost(columns - 1 + j); }
  [[nodiscard]] std::uint32_t ghost_above(std::uint32_t i) const {
    return ghost(columns - 1 + rows - 1 + (columns - 2 - i));
  }
  [[nodiscard]] std::uint32_t ghost_left(std::uint32_t j) const {
    return ghost(2 * (columns - 1) + rows - 1 + (rows - 2 - j));
  }
};

// Let the cell's corners be a (lower left), b, c, d, counter-clockwise. The triangles are then (a,
// b, d) and (c, d, b), so the corners opposite to the diagonal d-b are a and c, both with index 0.
void write_cells(const GridNumbers& grid, Triangle* triangle) {
  const std::uint32_t last_i = grid.columns - 2;
  const std::uint32_t last_j = grid.rows - 2;
  for (std::uint32_t j = 0; j <= last_j; ++j) {
    const auto write = [&](std::uint32_t i, Side left, Side below, Side right, Side above) {
      const std::uint32_t a = grid.vertex(i, j);
      const std::uint32_t b = a + 1;
      const std::uint32_t d = a + grid.columns;
      const std::uint32_t c = d + 1;
      const std::uint32_t t = grid.lower(i, j);
      triangle[t] = {{a, b, d}, {make_side(t + 1, 0), left, below}};
      triangle[t + 1] = {{c, d, b}, {make_side(t, 0), right, above}};
    };
    const auto below = [&](std::uint32_t i) {
      return j == 0 ? make_side(grid.ghost_below(i), 0) : make_side(grid.upper(i, j - 1), 2);
    };
    const auto above = [&](std::uint32_t i) {
      return j == last_j ? make_side(grid.ghost_above(i), 0) : make_side(grid.lower(i, j + 1), 2);
    };
    const auto left = [&](std::uint32_t i) {
      return i == 0 ? make_side(grid.ghost_left(j), 0) : make_side(grid.upper(i - 1, j), 1);
    };
    const auto right = [&](std::uint32_t i) {
      return i == last_i ? make_side(grid.ghost_right(j), 0) : make_side(grid.lower(i + 1, j), 1);
    };
    for (std::uint32_t i = 0; i <= last_i; ++i) write(i, left(i), below(i), right(i), above(i));
  }
}

void write_ghosts(const GridNumbers& grid, Triangle* triangle) {
  const std::uint32_t count = grid.ghosts();
  std::uint32_t number = 0;
  // Writes the ghost beyond the counter-clockwise hull edge from a to b. `inner`: the inner side of
  // that edge.
  const auto write = [&](std::uint32_t a, std::uint32_t b, Side inner) {
    const std::uint32_t t = grid.ghost(number);
    const std::uint32_t previous = grid.ghost(number == 0 ? count - 1 : number - 1);
    const std::uint32_t next = grid.ghost(number + 1 == count ? 0 : number + 1);
    triangle[t] = {{kGhost, b, a}, {inner, make_side(previous, 2), make_side(next, 1)}};
    ++number;
  };
  const std::uint32_t last_i = grid.columns - 2;
  const std::uint32_t last_j = grid.rows - 2;
  for (std::uint32_t i = 0; i <= last_i; ++i)
    write(grid.vertex(i, 0), grid.vertex(i + 1, 0), make_side(grid.lower(i, 0), 2));
  for (std::uint32_t j = 0; j <= last_j; ++j)
    write(grid.vertex(last_i + 1, j), grid.vertex(last_i + 1, j + 1),
          make_side(grid.upper(last_i, j), 1));
  for (std::uint32_t i = last_i + 1; i-- > 0;)
    write(grid.vertex(i + 1, last_j + 1), grid.vertex(i, last_j + 1),
          make_side(grid.upper(i, last_j), 2));
  for (std::uint32_t j = last_j + 1; j-- > 0;)
    write(grid.vertex(0, j + 1), grid.vertex(0, j), make_side(grid.lower(0, j), 1));
}

void write_incident(const GridNumbers& grid, std::uint32_t* incident) {
  const std::uint32_t last_i = grid.columns - 2;
  const std::uint32_t last_j = grid.rows - 2;
  for (std::uint32_t j = 0; j <= last_j; ++j) {
    std::uint32_t* row = incident + grid.vertex(0, j);
    for (std::uint32_t i = 0; i <= last_i; ++i) row[i] = grid.lower(i, j);
    row[last_i + 1] = grid.lower(last_i, j);
  }
  std::uint32_t* row = incident + grid.vertex(0, last_j + 1);
  row[0] = grid.lower(0, last_j);
  for (std::uint32_t i = 0; i <= last_i; ++i) row[i + 1] = grid.upper(i, last_j);
  incident[kGhost] = grid.ghost(0);
}

}  // namespace

template <class Kernel>
std::uint32_t build_grid(Mesh<Kernel>& mesh, std::span<const typename Kernel::Coord> xs,
                         std::span<const typename Kernel::Coord> ys) {
  const auto columns = static_cast<std::uint32_t>(xs.size());
  const auto rows = static_cast<std::uint32_t>(ys.size());
  mesh.forget_slots();
  const std::uint32_t first = mesh.point.size();
  const std::uint32_t count = columns * rows;
  if (count == 0) return first;
  mesh.point.reserve(first + count);
  mesh.incident.reserve(first + count);
  mesh.point.resize(first + count);
  mesh.incident.resize(first + count);
  typename Kernel::Point* point = mesh.point.data() + first;
  for (const auto y : ys)
    for (const auto x : xs) *point++ = {x, y};
  mesh.vertex_count = count;
  mesh.last_vertex = first;
  if (columns == 1 || rows == 1) {
    // Ascending coordinates are already in lexicographic order.
    for (std::uint32_t v = first; v < first + count; ++v) {
      mesh.incident[v] = kNoIncident;
      mesh.line.push_back(v);
    }
  } else {
    mesh.triangle.reserve(2 * std::size_t{count} - 2);
    mesh.triangle.resize(2 * count - 2);
    const GridNumbers grid{columns, rows, first};
    write_cells(grid, mesh.triangle.data());
    write_ghosts(grid, mesh.triangle.data());
    write_incident(grid, mesh.incident.data());
    mesh.flat = false;
  }
  if (mesh.journal.on()) {
    constexpr Triangle kUnused{{kFreeCorner, 0, 0}, {}};
    for (std::uint32_t v = first; v < first + count; ++v)
      mesh.journal.touch_vertex(v, false, mesh.point[v]);
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t)
      mesh.journal.touch_cell(t, kUnused.corner);
  }
  return first;
}

#ifdef TERRACE_TRI_CORE
template std::uint32_t build_grid(Mesh<IntKernel>&, std::span<const IntKernel::Coord>,
                                  std::span<const IntKernel::Coord>);
template std::uint32_t build_grid(Mesh<WindowedKernel>&, std::span<const WindowedKernel::Coord>,
                                  std::span<const WindowedKernel::Coord>);
#else
template std::uint32_t build_grid(Mesh<DoubleKernel>&, std::span<const DoubleKernel::Coord>,
                                  std::span<const DoubleKernel::Coord>);
#endif

}  // namespace terrace::tri::planar
