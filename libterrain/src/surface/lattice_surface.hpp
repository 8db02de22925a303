// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "terrace/terrain/heights.hpp"

/// The surface of a raster between its samples.
///
/// A square of four samples with data is split along the diagonal from (column + 1, row) to
/// (column, row + 1), as in the Delaunay triangulation of the lattice, which breaks ties that way
/// (see terrace/tri/delaunay2.hpp). So this is exactly the mesh that `terrace mesh` writes at level
/// 0. Any three samples with data form one triangle. A square with fewer has no surface except for
/// lattice edges between two samples with data, and the samples themselves.

namespace terrace::terrain {

/// Heights of a window of the lattice by rows; NaN where there is none, and outside the window.
template <class T>
struct LatticeView {
  const T* heights = nullptr;
  std::int64_t column = 0, row = 0;    ///< position of the first sample
  std::int64_t columns = 0, rows = 0;  ///< size

  [[nodiscard]] double at(std::int64_t c, std::int64_t r) const {
    if (c < column || r < row || c >= column + columns || r >= row + rows) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    return static_cast<double>(heights[(r - row) * columns + (c - column)]);
  }
};

/// The four corners of a square: (column, row), then one column further, one row further, and both.
struct LatticeSquare {
  double h00 = 0, h10 = 0, h01 = 0, h11 = 0;
};

/// The triangles of the square that contain (u, v) in [0, 1] x [0, 1], borders included: at most
/// two, and two only if u + v = 1.
struct SquareTriangles {
  int count = 0;
  SurfacePoint first, second;
};
inline SquareTriangles triangles_at(const LatticeSquare& s, double u, double v) {
  SquareTriangles found;
  const auto add = [&found](double height, double per_column, double per_row) {
    (found.count++ == 0 ? found.first : found.second) = {height, per_column, per_row};
  };
  const bool b00 = s.h00 == s.h00, b10 = s.h10 == s.h10, b01 = s.h01 == s.h01, b11 = s.h11 == s.h11;
  if (b10 && b01) {
    if (b00 && u + v <= 1) {
      const double du = s.h10 - s.h00, dv = s.h01 - s.h00;
      add(s.h00 + u * du + v * dv, du, dv);
    }
    if (b11 && u + v >= 1) {
      const double du = s.h11 - s.h01, dv = s.h11 - s.h10;
      add(s.h11 - (1 - u) * du - (1 - v) * dv, du, dv);
    }
  } else if (b00 && b11) {
    if (b01 && v >= u) {
      const double du = s.h11 - s.h01, dv = s.h01 - s.h00;
      add(s.h00 + v * dv + u * du, du, dv);
    } else if (b10 && u >= v) {
      const double du = s.h10 - s.h00, dv = s.h11 - s.h10;
      add(s.h00 + u * du + v * dv, du, dv);
    }
  }
  return found;
}

/// Evaluates on a lattice line or a diagonal: the height from the samples on it alone, the gradient
/// as the mean over the triangles that meet there.
/// view: like LatticeView, with at().
template <class View>
SurfacePoint linear_on_lines(const View& view, std::int64_t column, std::int64_t row, double u,
                             double v) {
  SurfacePoint result;
  double per_column = 0, per_row = 0, height = 0;
  int count = 0;
  for (std::int64_t r = v == 0 ? row - 1 : row; r <= row; ++r) {
    for (std::int64_t c = u == 0 ? column - 1 : column; c <= column; ++c) {
      const LatticeSquare square{view.at(c, r), view.at(c + 1, r), view.at(c, r + 1),
                                 view.at(c + 1, r + 1)};
      const SquareTriangles found = triangles_at(square, c < column ? 1.0 : u, r < row ? 1.0 : v);
      for (int k = 0; k < found.count; ++k) {
        const SurfacePoint& one = k == 0 ? found.first : found.second;
        height = one.height;
        per_column += one.per_column;
        per_row += one.per_row;
        ++count;
      }
    }
  }
  if (count > 0) result = {height, per_column / count, per_row / count};
  const double centre = view.at(column, row);
  if (u == 0 && v == 0) {
    result.height = centre;
  } else if (v == 0) {
    result.height = centre + u * (view.at(column + 1, row) - centre);
  } else if (u == 0) {
    result.height = centre + v * (view.at(column, row + 1) - centre);
  }
  return result;
}

/// Evaluates the linear surface at (x, y), in columns and rows from the lattice's first sample. The
/// view must extend one sample around the square of (x, y), unless the raster ends there.
template <class T>
SurfacePoint linear_at(const LatticeView<T>& view, double x, double y) {
  const double left = std::floor(x), top = std::floor(y);
  const auto column = static_cast<std::int64_t>(left), row = static_cast<std::int64_t>(top);
  const double u = x - left, v = y - top;
  if (u == 0 || v == 0 || u + v == 1) return linear_on_lines(view, column, row, u, v);
  if (column < view.column || row < view.row || column + 1 >= view.column + view.columns ||
      row + 1 >= view.row + view.rows) {
    return {};
  }
  const T* at = view.heights + (row - view.row) * view.columns + (column - view.column);
  const LatticeSquare square{static_cast<double>(at[0]), static_cast<double>(at[1]),
                             static_cast<double>(at[view.columns]),
                             static_cast<double>(at[view.columns + 1])};
  return triangles_at(square, u, v).first;
}

}  // namespace terrace::terrain
