// SPDX-License-Identifier: Apache-2.0
#include "earth/grid_geography.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <vector>

#include "base/portable_math.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kNodes = 6;
constexpr std::size_t kPatch = 64;    // samples along a side at first
constexpr std::size_t kSmallest = 8;  // below it polynomials cost more than they spare

/// Chebyshev's nodes in [0, 1]: the error of the polynomial through them is spread evenly, with
/// extremes at (1 - cos(k pi / 6)) / 2. C. W. Clenshaw, A. R. Curtis 1960; L. N. Trefethen,
/// Approximation Theory and Approximation Practice (2013), chapter 2.
constexpr std::array<double, kNodes> kNode{0.01703708685546585, 0.14644660940672624,
                                           0.37059047744873963, 0.62940952255126037,
                                           0.85355339059327376, 0.98296291314453415};
constexpr double kInner = 0.06698729810778066;
/// Where the polynomials are checked: each sign of the error along one axis with each of the other.
constexpr std::array<Point2, 6> kChecks{
    {{0, 0}, {1, kInner}, {1 - kInner, 1}, {kInner, 1 - kInner}, {0.5, 0.5}, {0, 1}}};

/// Coefficients of the polynomial in t through values at the nodes: row k gives those of t^k.
using NodeMatrix = std::array<std::array<double, kNodes>, kNodes>;
NodeMatrix monomials() {
  NodeMatrix matrix{};
  for (std::size_t i = 0; i < kNodes; ++i) {
    // The product of (t - node) over the others, divided by its value at node i.
    std::array<double, kNodes> product{1};
    double scale = 1;
    std::size_t degree = 0;
    for (std::size_t j = 0; j < kNodes; ++j) {
      if (j == i) continue;
      ++degree;
      for (std::size_t k = degree + 1; k-- > 0;) {
        product[k] = (k > 0 ? product[k - 1] : 0.0) - kNode[j] * product[k];
      }
      scale *= kNode[i] - kNode[j];
    }
    for (std::size_t k = 0; k < kNodes; ++k) matrix[k][i] = product[k] / scale;
  }
  return matrix;
}

using Quintic = std::array<double, kNodes>;

double value(const Quintic& c, double t) {
  return ((((c[5] * t + c[4]) * t + c[3]) * t + c[2]) * t + c[1]) * t + c[0];
}

/// A polynomial in both directions: coefficient[k][m] of s^k t^m, s along rows of the lattice.
struct Surface {
  std::array<Quintic, kNodes> coefficients{};

  Surface(const std::array<double, kNodes * kNodes>& values, const NodeMatrix& matrix) {
    std::array<Quintic, kNodes> along{};
    for (std::size_t j = 0; j < kNodes; ++j) {
      for (std::size_t k = 0; k < kNodes; ++k) {
        for (std::size_t i = 0; i < kNodes; ++i)
          along[k][j] += matrix[k][i] * values[j * kNodes + i];
      }
    }
    for (std::size_t k = 0; k < kNodes; ++k) {
      for (std::size_t m = 0; m < kNodes; ++m) {
        for (std::size_t j = 0; j < kNodes; ++j) coefficients[k][m] += matrix[m][j] * along[k][j];
      }
    }
  }
  [[nodiscard]] Quintic at_row(double t) const {
    Quintic row{};
    for (std::size_t k = 0; k < kNodes; ++k) row[k] = value(coefficients[k], t);
    return row;
  }
};

}  // namespace

struct GridGeography::Output {
  std::int64_t first_column, first_row;
  std::size_t columns;
  double* longitude;
  double* latitude;
};

/// Samples within the window, counted from its corner.
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
  static const NodeMatrix matrix = monomials();
  const double width = static_cast<double>(patch.columns - 1);
  const double height = static_cast<double>(patch.rows - 1);
  const double left =
      static_cast<double>(output.first_column + static_cast<std::int64_t>(patch.column));
  const double top = static_cast<double>(output.first_row + static_cast<std::int64_t>(patch.row));
  std::array<Point2, kNodes * kNodes + kChecks.size()> places{};
  for (std::size_t j = 0; j < kNodes; ++j) {
    for (std::size_t i = 0; i < kNodes; ++i) {
      places[j * kNodes + i] = {left + kNode[i] * width, top + kNode[j] * height};
    }
  }
  for (std::size_t k = 0; k < kChecks.size(); ++k) {
    places[kNodes * kNodes + k] = {left + kChecks[k][0] * width, top + kChecks[k][1] * height};
  }
  exact(places);
  // Longitudes counted on from the first beyond 180, and how far that goes.
  double least = places[0][0], most = places[0][0];
  for (Point2& p : places) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1])) return false;
    if (!plain_) p[0] += 360.0 * std::round((places[0][0] - p[0]) / 360.0);
    least = std::min(least, p[0]);
    most = std::max(most, p[0]);
  }
  // Small numbers: powers of t amplify what is rounded.
  const Point2 base = places[0];
  std::array<double, kNodes * kNodes> longitudes{}, latitudes{};
  for (std::size_t i = 0; i < longitudes.size(); ++i) {
    longitudes[i] = places[i][0] - base[0];
    latitudes[i] = places[i][1] - base[1];
  }
  const Surface longitude(longitudes, matrix), latitude(latitudes, matrix);
  for (std::size_t k = 0; k < kChecks.size(); ++k) {
    const Point2& truth = places[kNodes * kNodes + k];
    const Point2& where = kChecks[k];
    const double off =
        std::max(std::abs(value(longitude.at_row(where[1]), where[0]) + base[0] - truth[0]),
                 std::abs(value(latitude.at_row(where[1]), where[0]) + base[1] - truth[1]));
    // Between the places checked the error may be some times larger.
    if (!(off <= kTolerance / 8)) return false;
  }

  // What the extremes of the samples themselves are is not known: a margin for the edges.
  const bool within = least - (most - least) >= -180.0 && most + (most - least) <= 180.0;
  const double step_across = 1.0 / width, step_down = 1.0 / height;
  for (std::size_t j = 0; j < patch.rows; ++j) {
    const double t = static_cast<double>(j) * step_down;
    const Quintic a = longitude.at_row(t), b = latitude.at_row(t);
    const std::size_t start = (patch.row + j) * output.columns + patch.column;
    double* const x = output.longitude + start;
    double* const y = output.latitude + start;
    const int columns = static_cast<int>(patch.columns);
    for (int i = 0; i < columns; ++i) {
      const double s = static_cast<double>(i) * step_across;
      x[i] = base[0] + value(a, s);
      y[i] = base[1] + value(b, s);
    }
    if (within) continue;
    for (std::size_t i = 0; i < patch.columns; ++i) {
      if (x[i] > 180) x[i] -= 360;
      if (x[i] < -180) x[i] += 360;
    }
  }
  return true;
}

void GridGeography::fill(const Patch& patch, const Output& output) const {
  if (patch.columns < kSmallest || patch.rows < kSmallest) return exact(patch, output);
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
