// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "terrace/stream/point.hpp"
#include "terrace/terrain/context.hpp"
#include "terrace/terrain/crs.hpp"

/// Ground distances. Points are stored as they came, in degrees, feet, or columns and rows; what is
/// near or far is measured in metres on the ground.

namespace terrace::terrain {

/// A linear map, row-major: ground = map * stored, in metres (east, north, up weighed).
using GroundMap = std::array<double, 9>;

struct MetresPerDegree {
  double longitude = 0.0, latitude = 0.0;
};
/// On the WGS 84 ellipsoid at `latitude` (degrees, clamped to [-90, 90]): the radii of the parallel
/// and of the meridian's curvature, times pi/180. Within 1e-14 relative. The same bits on every
/// machine, unlike what calls the C library's sin and cos.
MetresPerDegree metres_per_degree(double latitude);

/// Metres in a unit of length, by any word that stream::canonical_unit() knows; nothing for a unit
/// that is not known.
std::optional<double> metres_in_unit(std::string_view unit);

/// Local ground maps for a source or a store.
class Ground {
 public:
  /// z_weight: what heights are multiplied by besides, `--z-weight`.
  explicit Ground(stream::Placement placement, double z_weight = 1.0);

  /// The map near the centre of `stored`, a box in stored coordinates: the local scale of the
  /// projection, on the axes of the CRS (its east and north, not the meridian's). Without a known
  /// CRS it is the same everywhere.
  [[nodiscard]] GroundMap map(const stream::Box3& stored) const;

  [[nodiscard]] bool same_everywhere() const { return kind_ == Kind::linear; }
  /// Whether the map is a projection's scale, which changes little over a hundredth of an area.
  [[nodiscard]] bool projected() const { return kind_ == Kind::projected; }

  /// What had to be assumed because the source does not say; empty if nothing.
  [[nodiscard]] const std::string& assumption() const { return assumption_; }
  /// The part of assumption() that says which unit of heights, named by the source, is not known.
  /// Empty if it is known or not named. Whatever turns heights into metres reports it.
  [[nodiscard]] const std::string& unknown_height_unit() const { return unknown_height_unit_; }
  /// Metres in a unit of heights, times the weight of heights.
  [[nodiscard]] double metres_vertical() const { return metres_vertical_; }
  /// The name of the unit of z that was found or assumed.
  [[nodiscard]] const std::string& height_unit() const { return height_unit_; }

 private:
  enum class Kind : std::uint8_t { linear, geographic, web_mercator, projected };

  [[nodiscard]] std::array<double, 3> projected_scale(const stream::Point3& centre) const;

  stream::Placement placement_;
  Kind kind_ = Kind::linear;
  std::optional<CoordinateSystem> system_;  ///< of projected ones
  double degrees_ = 1.0;                    ///< of a unit of x, y
  double metres_horizontal_ = 1.0;          ///< of a unit of x, y
  double metres_vertical_ = 1.0;            ///< of a unit of z, weighed
  std::string height_unit_ = "metre";
  std::string assumption_, unknown_height_unit_;
};

/// Tells the user if the unit of the heights, which the job turns into metres, is not known.
void say_unknown_height_unit(const Ground& ground, const Context& context);

/// map * v.
stream::Point3 apply(const GroundMap& map, const stream::Point3& v);

}  // namespace terrace::terrain
