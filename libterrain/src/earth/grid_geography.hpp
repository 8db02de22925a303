// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// Longitudes and latitudes of a raster's samples by column and row, fast: exact places on a few
/// points of a patch, between them a polynomial of fifth degree in each direction, checked against
/// exact places where it is worst. Patches where it is off by more than kTolerance are quartered,
/// down to samples that are computed one by one (near poles, across the antimeridian).
///
/// Const members may be called by several threads at once.
class GridGeography {
 public:
  /// Degrees: what a sample may be off, a hundredth of a millimetre on the ground.
  static constexpr double kTolerance = 1e-10;

  /// world: columns and rows to x and y of `system`. Throws: stream::Error if the datum of `system`
  /// has no way to WGS 84.
  GridGeography(const CoordinateSystem& system, const stream::WorldTransform& world);

  /// WGS 84 of the samples (first_column + i, first_row + j), row-major: longitude[j * columns +
  /// i]. Both spans have columns * rows elements. What has no place is NaN; longitudes lie in
  /// [-180, 180], but those of a raster in degrees are left as they are. The same for every window
  /// that a sample is part of to within kTolerance, not to the last bit.
  /// 150 to 270 million samples per second and core, by the projection, in windows of 1024 x 1024
  /// samples (tests/bench/geography_bench); single places are 0.6 to 21 million.
  void window(std::int64_t first_column, std::int64_t first_row, std::size_t columns,
              std::size_t rows, std::span<double> longitude, std::span<double> latitude) const;

  /// One place, exact; column and row may lie between samples.
  [[nodiscard]] Point2 place(double column, double row) const;

 private:
  struct Output;
  struct Patch;
  void exact(const Patch& patch, const Output& output) const;
  [[nodiscard]] bool interpolated(const Patch& patch, const Output& output) const;
  void fill(const Patch& patch, const Output& output) const;
  void exact(std::span<Point2> lattice) const;

  CoordinateSystem system_;
  stream::WorldTransform world_;
  bool plain_ = false;  ///< longitudes and latitudes are linear in column and row
};

}  // namespace terrace::terrain
