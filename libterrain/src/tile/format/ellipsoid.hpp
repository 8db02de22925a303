// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include "terrace/stream/point.hpp"

/// The WGS 84 ellipsoid as web globes see it. Angles in degrees, lengths in metres; geocentric
/// coordinates are Earth-centred, Earth-fixed. Built on portable_math, so that tiles have
/// the same bytes everywhere.

namespace terrace::terrain {

inline constexpr double kEquatorialRadius = 6378137.0;
inline constexpr double kPolarRadius = 6356752.3142451793;

/// Geocentric coordinates of a place at `height` above the ellipsoid.
stream::Point3 geocentric(double longitude, double latitude, double height);

/// The directions of east, north and up at a place, of unit length.
struct LocalFrame {
  stream::Point3 east, north, up;
};
LocalFrame local_frame(double longitude, double latitude);

struct Sphere {
  stream::Point3 centre{};
  double radius = 0.0;
};
/// A sphere around all points: about the centre of their box, so at most sqrt(3) times as wide as
/// the smallest one. points: at least one.
Sphere bounding_sphere(std::span<const stream::Point3> points);

/// The point on the line from the Earth's centre through `towards` such that, whenever it is hidden
/// behind the ellipsoid, all of `points` are. In units of the ellipsoid's radii along each axis.
/// Where there is none, because the points reach further than a quarter of the Earth from
/// `towards`, a point that is practically never hidden.
/// Source: K. Ring, Horizon culling (2013), https://cesium.com/blog/2013/04/25/horizon-culling/.
stream::Point3 horizon_occlusion_point(const stream::Point3& towards,
                                       std::span<const stream::Point3> points);

}  // namespace terrace::terrain
