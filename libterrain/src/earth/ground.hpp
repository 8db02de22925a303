// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "terrace/stream/point.hpp"
#include "terrace/terrain/context.hpp"
#include "terrace/terrain/crs.hpp"

/// Ground distances. Stores keep points in degrees, feet, or columns and rows, as their files have
/// them. Distances are measured in metres on the ground.

namespace terrace::terrain {

/// A linear map, row-major: ground = map * stored, in metres (east, north, weighted up).
using GroundMap = std::array<double, 9>;

struct MetresPerDegree {
  double longitude = 0.0, latitude = 0.0;
};
/// Returns metres per degree on the WGS 84 ellipsoid at `latitude` (degrees, clamped to [-90, 90]):
/// the radii of the parallel and of the meridian's curvature, times pi/180. The relative error is
/// at most 1e-14. The bits are the same on every machine, because it does not call the C library's
/// sin and cos.
MetresPerDegree metres_per_degree(double latitude);

/// Returns metres per unit of length, for any name that stream::canonical_unit() knows and for the
/// form of recorded_unit(); nullopt for an unknown unit.
std::optional<double> metres_in_unit(std::string_view unit);

/// Local maps to the ground for a source or a store.
class Ground {
 public:
  /// z_weight: an extra factor for heights, `--z-weight`.
  explicit Ground(stream::Placement placement, double z_weight = 1.0);

  /// Returns the map near the centre of `stored`, a box in stored coordinates: the local scale of
  /// the projection, along the axes of the CRS (its east and north, not the meridian's). Without a
  /// known CRS it is the same everywhere.
  [[nodiscard]] GroundMap map(const stream::Box3& stored) const;

  [[nodiscard]] bool same_everywhere() const { return kind_ == Kind::linear; }
  /// Whether the map is the scale of a projection, which changes little over a hundredth of an
  /// area.
  [[nodiscard]] bool projected() const { return kind_ == Kind::projected; }

  /// Returns a note on assumptions about units that the source does not name. Empty if there are
  /// none.
  [[nodiscard]] const std::string& assumption() const { return assumption_; }
  /// The part of assumption() about a unit of heights that is named in the source and unknown.
  /// Empty if the unit is known or not named. Every conversion of heights to metres reports it.
  [[nodiscard]] const std::string& unknown_height_unit() const { return unknown_height_unit_; }
  /// Metres per unit of height, times the weight of heights.
  [[nodiscard]] double metres_vertical() const { return metres_vertical_; }
  /// The name of the known or assumed unit of z.
  [[nodiscard]] const std::string& height_unit() const { return height_unit_; }

 private:
  enum class Kind : std::uint8_t { linear, geographic, web_mercator, projected };

  [[nodiscard]] std::array<double, 3> projected_scale(const stream::Point3& centre) const;

  stream::Placement placement_;
  Kind kind_ = Kind::linear;
  std::optional<CoordinateSystem> system_;  ///< only if projected
  double degrees_ = 1.0;                    ///< per unit of x, y
  double metres_horizontal_ = 1.0;          ///< per unit of x, y
  double metres_vertical_ = 1.0;            ///< per unit of z, weighted
  std::string height_unit_ = "metre";
  std::string assumption_, unknown_height_unit_;
};

/// Notes that the unit of heights is unknown, for a job that converts heights to metres.
void say_unknown_height_unit(const Ground& ground, const Context& context);

/// Returns map * v.
stream::Point3 apply(const GroundMap& map, const stream::Point3& v);

}  // namespace terrace::terrain
