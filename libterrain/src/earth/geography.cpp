// SPDX-License-Identifier: Apache-2.0
#include "earth/geography.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <optional>
#include <vector>

namespace terrace::terrain {
namespace {

/// Polynomials for longitude and latitude in a box.
struct GeographyPatch {
  PlacePatch patch;
  /// Whether all longitudes are in [-180, 180]; otherwise they may be up to a turn beyond.
  bool is_within_turn = true;
};

double in_turn(double longitude) {
  return longitude > 180 ? longitude - 360 : longitude < -180 ? longitude + 360 : longitude;
}

/// exact: converts plane coordinates to longitudes and latitudes in place, NaN for places without
/// an image. Longitudes must be within one turn.
template <class Exact>
std::optional<GeographyPatch> fit(const Point2& low, const Point2& size, const Exact& exact) {
  std::array<Point2, PlacePatch::kPlaces> places = PlacePatch::places(low, size);
  exact(places);
  // Unwraps longitudes from the first one, also beyond 180, and finds their range.
  const double first = places[0][0];
  double least = first, greatest = first;
  for (Point2& p : places) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1])) return std::nullopt;
    p[0] += 360.0 * std::round((first - p[0]) / 360.0);
    least = std::min(least, p[0]);
    greatest = std::max(greatest, p[0]);
  }
  const std::optional<PlacePatch> patch = PlacePatch::through(places, kGeographyTolerance);
  if (!patch) return std::nullopt;
  // The extremes may be between the sampled places, so leave a margin.
  const double margin = greatest - least;
  return GeographyPatch{*patch, least - margin >= -180.0 && greatest + margin <= 180.0};
}

}  // namespace

BoxGeography::BoxGeography(const CoordinateSystem& system, const stream::Box3& box)
    : system_(system) {
  constexpr double kPatchMetres = 20e3, kMetresPerDegree = 111e3;
  const Point2 low{box.min[0], box.min[1]}, high{box.max[0], box.max[1]};
  static_cast<void>(system_.to_geographic(low));
  if (system_.is_geographic() && system_.counts_as_wgs84()) return;  // nothing to compute
  const double metres = system_.is_geographic() ? kMetresPerDegree : system_.metres_per_unit();
  const double longest = kPatchMetres / metres;
  patches_ = PatchGrid(
      low, high, {longest, longest},
      [this](const Point2& corner, const Point2& size) -> std::optional<PlacePatch> {
        const auto fitted =
            fit(corner, size, [this](std::span<Point2> places) { system_.to_geographic(places); });
        if (!fitted) return std::nullopt;
        return fitted->patch;
      });
}

void BoxGeography::operator()(std::span<Point2> places) const {
  patches_.convert(
      places, [this](std::span<Point2> batch) { system_.to_geographic(batch); },
      [](const Point2& place) -> Point2 {
        return {in_turn(place[0]), place[1]};
      });
}

/// The samples of a window.
struct GridGeography::Output {
  std::int64_t first_column, first_row;
  std::size_t columns;
  double* longitude;
  double* latitude;

  [[nodiscard]] double column(std::size_t i) const {
    return static_cast<double>(first_column + static_cast<std::int64_t>(i));
  }
  [[nodiscard]] double row(std::size_t j) const {
    return static_cast<double>(first_row + static_cast<std::int64_t>(j));
  }
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

void GridGeography::exact(const LatticePart& part, const Output& output) const {
  std::vector<Point2> places(part.columns);
  for (std::size_t row = part.row; row < part.row + part.rows; ++row) {
    for (std::size_t i = 0; i < part.columns; ++i) {
      places[i] = {output.column(part.column + i), output.row(row)};
    }
    exact(places);
    for (std::size_t i = 0; i < part.columns; ++i) {
      const std::size_t at = row * output.columns + part.column + i;
      output.longitude[at] = places[i][0];
      output.latitude[at] = places[i][1];
    }
  }
}

bool GridGeography::interpolated(const LatticePart& part, const Output& output) const {
  const double width = static_cast<double>(part.columns - 1);
  const double height = static_cast<double>(part.rows - 1);
  const auto fitted = fit({output.column(part.column), output.row(part.row)}, {width, height},
                          [this](std::span<Point2> places) { exact(places); });
  if (!fitted) return false;
  const double step_across = 1.0 / width, step_down = 1.0 / height;
  for (std::size_t j = 0; j < part.rows; ++j) {
    const PlacePatch::Row row = fitted->patch.row(static_cast<double>(j) * step_down);
    const std::size_t start = (part.row + j) * output.columns + part.column;
    double* const x = output.longitude + start;
    double* const y = output.latitude + start;
    const int columns = static_cast<int>(part.columns);
    for (int i = 0; i < columns; ++i) {
      const double s = static_cast<double>(i) * step_across;
      x[i] = row(0, s);
      y[i] = row(1, s);
    }
    if (fitted->is_within_turn) continue;
    for (std::size_t i = 0; i < part.columns; ++i) x[i] = in_turn(x[i]);
  }
  return true;
}

void GridGeography::window(std::int64_t first_column, std::int64_t first_row, std::size_t columns,
                           std::size_t rows, std::span<double> longitude,
                           std::span<double> latitude) const {
  assert(longitude.size() == columns * rows && latitude.size() == columns * rows);
  constexpr std::size_t kPart = 256;   // samples along a side of the first parts
  constexpr std::size_t kFewest = 64;  // samples below which polynomials cost more than they save
  const Output output{first_column, first_row, columns, longitude.data(), latitude.data()};
  if (plain_) return exact({0, 0, columns, rows}, output);
  const auto fill = [&](const LatticePart& part) {
    // A single row or column has no area to fit.
    if (part.columns * part.rows < kFewest || part.columns == 1 || part.rows == 1) {
      exact(part, output);
      return true;
    }
    return interpolated(part, output);
  };
  for (std::size_t row = 0; row < rows; row += kPart) {
    for (std::size_t column = 0; column < columns; column += kPart) {
      divide({column, row, std::min(kPart, columns - column), std::min(kPart, rows - row)}, fill);
    }
  }
}

}  // namespace terrace::terrain
