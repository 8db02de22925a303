// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "earth/polynomial_patch.hpp"
#include "terrace/terrain/crs.hpp"

/// Longitudes and latitudes of many places, by polynomials where these are accurate enough.

namespace terrace::terrain {

/// Largest error of a place in degrees, a hundredth of a millimetre on the ground.
inline constexpr double kGeographyTolerance = 1e-10;

/// Converts many places in a box of a CRS to longitudes and latitudes of WGS 84, fast. Uses patches
/// of at most 20 km (larger if the box would need more than 64 along a side), and exact conversion
/// where polynomials are not within kGeographyTolerance. Several threads may call const members at
/// once.
class BoxGeography {
 public:
  /// box: in x and y of `system`. Throws: stream::Error if no operation leads to WGS 84.
  BoxGeography(const CoordinateSystem& system, const stream::Box3& box);

  /// As CoordinateSystem::to_geographic(), within kGeographyTolerance. The result for a place does
  /// not depend on the other places. 29 million places per second and core
  /// (tests/bench/geography_bench).
  void operator()(std::span<Point2> places) const;
  [[nodiscard]] const CoordinateSystem& system() const { return system_; }

 private:
  CoordinateSystem system_;
  PatchGrid patches_;
};

/// Computes longitudes and latitudes of a raster's samples by column and row, fast. A patch where
/// polynomials are not within kGeographyTolerance is quartered, in the worst case down to samples
/// that are computed one by one (near poles, across the antimeridian).
///
/// Several threads may call const members at once.
class GridGeography {
 public:
  /// world: from columns and rows to x and y of `system`. Throws: stream::Error if no operation
  /// leads from the datum of `system` to WGS 84.
  GridGeography(const CoordinateSystem& system, const stream::WorldTransform& world);

  /// Computes WGS 84 places of the samples (first_column + i, first_row + j), row-major:
  /// longitude[j * columns + i]. Both spans have columns * rows elements. Samples without a place
  /// become NaN. Longitudes are in [-180, 180], except that a raster in degrees keeps its own.
  /// Windows that share a sample agree on it within kGeographyTolerance, not to the last bit. 150
  /// to 270 million samples per second and core, depending on the projection, in windows of 1024 x
  /// 1024 samples (tests/bench/geography_bench); for single places 0.6 to 21 million.
  void window(std::int64_t first_column, std::int64_t first_row, std::size_t columns,
              std::size_t rows, std::span<double> longitude, std::span<double> latitude) const;

  /// Converts one place, exactly; column and row may be fractional.
  [[nodiscard]] Point2 place(double column, double row) const;

 private:
  struct Output;
  void exact(std::span<Point2> lattice) const;
  void exact(const LatticePart& part, const Output& output) const;
  [[nodiscard]] bool interpolated(const LatticePart& part, const Output& output) const;

  CoordinateSystem system_;
  stream::WorldTransform world_;
  bool plain_ = false;  ///< whether longitudes and latitudes are linear in column and row
};

}  // namespace terrace::terrain
