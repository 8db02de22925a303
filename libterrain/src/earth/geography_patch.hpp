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

/// Longitudes and latitudes in a rectangle of plane coordinates by polynomials.
class GeographyPatch {
 public:
  /// The polynomials along a parallel of the rectangle's sides.
  struct Row {
    Point2 base{};
    QuinticSurface::Quintic a{}, b{};
    [[nodiscard]] double longitude(double s) const { return base[0] + QuinticSurface::value(a, s); }
    [[nodiscard]] double latitude(double s) const { return base[1] + QuinticSurface::value(b, s); }
  };

  /// exact: turns plane coordinates into longitudes and latitudes in place, NaN where there are
  /// none. Longitudes must lie within one turn. nullopt where a place in the rectangle could be off
  /// by more than `tolerance` degrees, as QuinticSurface tells. 42 exact places.
  static std::optional<GeographyPatch> fit(const Point2& low, const Point2& size, double tolerance,
                                           const std::function<void(std::span<Point2>)>& exact);

  /// t: 0 to 1 along the second side.
  [[nodiscard]] Row row(double t) const {
    return {{longitude_.base(), latitude_.base()}, longitude_.along(t), latitude_.along(t)};
  }
  /// Whether all longitudes lie in [-180, 180] as the polynomials give them.
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

/// Patches side by side over a box. Const members may be called by several threads at once.
class GeographyPatches {
 public:
  /// None.
  GeographyPatches() = default;
  /// longest: of a patch's sides; where the box has more than 64 of them along a side they are
  /// longer. The others: as GeographyPatch::fit() wants them.
  GeographyPatches(const Point2& low, const Point2& high, const Point2& longest, double tolerance,
                   const std::function<void(std::span<Point2>)>& exact);

  /// Converts a place; false, and nothing done, where polynomials do not suffice. The first
  /// coordinate is not brought into one turn.
  bool convert(Point2& place) const;

 private:
  Point2 low_{}, per_unit_{};  ///< of the box; patches per unit of the coordinates
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<std::optional<GeographyPatch>> patches_;
};

/// Longitudes and latitudes of WGS 84 for many places in a box of a reference system, fast: by
/// GeographyPatch in patches of at most 20 km where the box has no more than 64 of them along a
/// side, exactly where polynomials do not suffice. Const members may be called by several threads
/// at once.
class BoxGeography {
 public:
  /// Degrees: what a place may be off, a hundredth of a millimetre on the ground.
  static constexpr double kTolerance = 1e-10;

  /// box: x and y of `system`. Throws: stream::Error if no operation leads to WGS 84.
  BoxGeography(const CoordinateSystem& system, const stream::Box3& box);

  /// As CoordinateSystem::to_geographic(), within kTolerance; the same bits for a place whatever
  /// the others. 29 million places per second and core (tests/bench/geography_bench).
  void operator()(std::span<Point2> places) const;
  [[nodiscard]] const CoordinateSystem& system() const { return system_; }

 private:
  CoordinateSystem system_;
  GeographyPatches patches_;
};

}  // namespace terrace::terrain
