// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include "terrace/stream/point.hpp"

/// The WGS 84 ellipsoid as web globes use it. Angles are in degrees, lengths in metres; geocentric
/// coordinates are Earth-centred, Earth-fixed. Uses portable_math, so that tiles have the same
/// bytes on every machine.

namespace terrace::terrain {

inline constexpr double kEquatorialRadius = 6378137.0;
inline constexpr double kPolarRadius = 6356752.3142451793;

/// Returns the geocentric coordinates of a place at `height` above the ellipsoid.
stream::Point3 geocentric(double longitude, double latitude, double height);

/// Unit vectors to the east, the north and up at a place.
struct LocalFrame {
  stream::Point3 east, north, up;
};
LocalFrame local_frame(double longitude, double latitude);

struct Sphere {
  stream::Point3 centre{};
  double radius = 0.0;
};
/// Returns a sphere around all points, with the centre of their box, so at most sqrt(3) times as
/// wide as the smallest one. points: at least one.
Sphere bounding_sphere(std::span<const stream::Point3> points);

/// Returns the horizon occlusion point: a point on the line from the Earth's centre through
/// `towards`, in units of the ellipsoid's radii along each axis. Whenever the ellipsoid hides it,
/// the ellipsoid hides all of `points`. If there is no such point, because the points extend
/// further than a quarter of the Earth from `towards`, returns a point that is practically never
/// hidden. Source: K. Ring, Horizon culling (2013),
/// https://cesium.com/blog/2013/04/25/horizon-culling/.
stream::Point3 horizon_occlusion_point(const stream::Point3& towards,
                                       std::span<const stream::Point3> points);

}  // namespace terrace::terrain
