// SPDX-License-Identifier: Apache-2.0
#include "earth/grid_geography.hpp"

#include <algorithm>
#include <cassert>
#include <vector>

#include "earth/geography_patch.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kPatch = 256;  // samples along a side of the first patches
constexpr std::size_t kFewest = 64;  // samples below which polynomials cost more than they save

}  // namespace

struct GridGeography::Output {
  std::int64_t first_column, first_row;
  std::size_t columns;
  double* longitude;
  double* latitude;
};

/// A rectangle of samples, relative to the window's corner.
struct GridGeography::Patch {
  std::size_t column, row, columns, rows;
};

GridGeography::GridGeography(const CoordinateSystem& system, const stream::WorldTransform& world)
    : system_(system), world_(world) {
  plain_ = system_.is_geographic() && system_.counts_as_wgs84();
  static_cast<void>(system_.to_geographic(Point2{world.xy[2], world.xy[5]}));
}

Point2 GridGeography::place(double column, double row) const {
  Point2 lattice{column, row};
  exact(std::span(&lattice, 1));
  return lattice;
}

void GridGeography::exact(std::span<Point2> lattice) const {
  const std::array<double, 6>& m = world_.xy;
  for (Point2& p : lattice) {
    p = {p[0] * m[0] + p[1] * m[1] + m[2], p[0] * m[3] + p[1] * m[4] + m[5]};
  }
  system_.to_geographic(lattice);
}

void GridGeography::exact(const Patch& patch, const Output& output) const {
  std::vector<Point2> places(patch.columns);
  for (std::size_t j = 0; j < patch.rows; ++j) {
    const std::size_t row = patch.row + j;
    for (std::size_t i = 0; i < patch.columns; ++i) {
      places[i] = {
          static_cast<double>(output.first_column + static_cast<std::int64_t>(patch.column + i)),
          static_cast<double>(output.first_row + static_cast<std::int64_t>(row))};
    }
    exact(places);
    for (std::size_t i = 0; i < patch.columns; ++i) {
      const std::size_t at = row * output.columns + patch.column + i;
      output.longitude[at] = places[i][0];
      output.latitude[at] = places[i][1];
    }
  }
}

bool GridGeography::interpolated(const Patch& patch, const Output& output) const {
  const double width = static_cast<double>(patch.columns - 1);
  const double height = static_cast<double>(patch.rows - 1);
  const double left =
      static_cast<double>(output.first_column + static_cast<std::int64_t>(patch.column));
  const double top = static_cast<double>(output.first_row + static_cast<std::int64_t>(patch.row));
  const auto fit = GeographyPatch::fit({left, top}, {width, height}, kTolerance,
                                       [this](std::span<Point2> places) { exact(places); });
  if (!fit) return false;
  const double step_across = 1.0 / width, step_down = 1.0 / height;
  for (std::size_t j = 0; j < patch.rows; ++j) {
    const GeographyPatch::Row row = fit->row(static_cast<double>(j) * step_down);
    const std::size_t start = (patch.row + j) * output.columns + patch.column;
    double* const x = output.longitude + start;
    double* const y = output.latitude + start;
    const int columns = static_cast<int>(patch.columns);
    for (int i = 0; i < columns; ++i) {
      const double s = static_cast<double>(i) * step_across;
      x[i] = row.longitude(s);
      y[i] = row.latitude(s);
    }
    if (fit->is_within_turn()) continue;
    for (std::size_t i = 0; i < patch.columns; ++i) x[i] = GeographyPatch::in_turn(x[i]);
  }
  return true;
}

void GridGeography::fill(const Patch& patch, const Output& output) const {
  // A single row or column has no area to fit.
  if (patch.columns * patch.rows < kFewest || patch.columns == 1 || patch.rows == 1) {
    return exact(patch, output);
  }
  if (interpolated(patch, output)) return;
  const std::size_t left = patch.columns / 2, upper = patch.rows / 2;
  fill({patch.column, patch.row, left, upper}, output);
  fill({patch.column + left, patch.row, patch.columns - left, upper}, output);
  fill({patch.column, patch.row + upper, left, patch.rows - upper}, output);
  fill({patch.column + left, patch.row + upper, patch.columns - left, patch.rows - upper}, output);
}

void GridGeography::window(std::int64_t first_column, std::int64_t first_row, std::size_t columns,
                           std::size_t rows, std::span<double> longitude,
                           std::span<double> latitude) const {
  assert(longitude.size() == columns * rows && latitude.size() == columns * rows);
  const Output output{first_column, first_row, columns, longitude.data(), latitude.data()};
  if (plain_) return exact({0, 0, columns, rows}, output);
  for (std::size_t row = 0; row < rows; row += kPatch) {
    for (std::size_t column = 0; column < columns; column += kPatch) {
      fill({column, row, std::min(kPatch, columns - column), std::min(kPatch, rows - row)}, output);
    }
  }
}

}  // namespace terrace::terrain
