// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "earth/quintic_surface.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// Polynomials for longitude and latitude in a rectangle of plane coordinates.
class GeographyPatch {
 public:
  /// The polynomials along a parallel to two of the rectangle's sides.
  struct Row {
    Point2 base{};
    QuinticSurface::Quintic a{}, b{};
    [[nodiscard]] double longitude(double s) const { return base[0] + QuinticSurface::value(a, s); }
    [[nodiscard]] double latitude(double s) const { return base[1] + QuinticSurface::value(b, s); }
  };

  /// Fits the polynomials to 42 exact places. exact: converts plane coordinates to longitudes and
  /// latitudes in place, NaN for places without an image. Longitudes must be within one turn.
  /// Returns nullopt if a place in the rectangle could be off by more than `tolerance` degrees,
  /// according to QuinticSurface.
  static std::optional<GeographyPatch> fit(const Point2& low, const Point2& size, double tolerance,
                                           const std::function<void(std::span<Point2>)>& exact);

  /// t: 0 to 1 along the second side.
  [[nodiscard]] Row row(double t) const {
    return {{longitude_.base(), latitude_.base()}, longitude_.along(t), latitude_.along(t)};
  }
  /// Whether the polynomials give all longitudes in [-180, 180].
  [[nodiscard]] bool is_within_turn() const { return within_turn_; }
  static double in_turn(double longitude) {
    return longitude > 180 ? longitude - 360 : longitude < -180 ? longitude + 360 : longitude;
  }

 private:
  GeographyPatch(const QuinticSurface& longitude, const QuinticSurface& latitude)
      : longitude_(longitude), latitude_(latitude) {}

  QuinticSurface longitude_, latitude_;
  bool within_turn_ = true;
};

/// A grid of patches over a box. Several threads may call const members at once.
class GeographyPatches {
 public:
  /// Without patches.
  GeographyPatches() = default;
  /// longest: the longest side of a patch; exceeded if the box would need more than 64 patches
  /// along a side. For the other parameters see GeographyPatch::fit().
  GeographyPatches(const Point2& low, const Point2& high, const Point2& longest, double tolerance,
                   const std::function<void(std::span<Point2>)>& exact);

  /// Converts a place; returns false and leaves it unchanged where polynomials are not accurate
  /// enough. The longitude is not normalised to one turn.
  bool convert(Point2& place) const;

 private:
  Point2 low_{}, per_unit_{};  ///< of the box; patches per unit of the coordinates
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<std::optional<GeographyPatch>> patches_;
};

/// Converts many places in a box of a CRS to longitudes and latitudes of WGS 84, fast. Uses
/// GeographyPatch in patches of at most 20 km (larger if the box would need more than 64 along a
/// side), and exact conversion where polynomials are not accurate enough. Several threads may call
/// const members at once.
class BoxGeography {
 public:
  /// Largest error of a place in degrees, a hundredth of a millimetre on the ground.
  static constexpr double kTolerance = 1e-10;

  /// box: in x and y of `system`. Throws: stream::Error if no operation leads to WGS 84.
  BoxGeography(const CoordinateSystem& system, const stream::Box3& box);

  /// As CoordinateSystem::to_geographic(), within kTolerance. The result for a place does not
  /// depend on the other places. 29 million places per second and core
  /// (tests/bench/geography_bench).
  void operator()(std::span<Point2> places) const;
  [[nodiscard]] const CoordinateSystem& system() const { return system_; }

 private:
  CoordinateSystem system_;
  GeographyPatches patches_;
};

}  // namespace terrace::terrain
