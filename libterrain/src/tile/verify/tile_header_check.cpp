// SPDX-License-Identifier: Apache-2.0
#include "tile/verify/tile_header_check.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/portable_math.hpp"
#include "base/units.hpp"
#include "base/vector.hpp"
#include "tile/format/ellipsoid.hpp"
#include "tile/make/tile_sides.hpp"

namespace terrace::terrain {
namespace {

using stream::Point3;

/// Metres and shares that a header may be off: what rounding does, and no more.
constexpr double kLengthSlack = 1e-3;
constexpr double kShareSlack = 1e-3;
constexpr std::uint64_t kSphereAt = 32, kHorizonAt = 64;

double distance(const Point3& a, const Point3& b) {
  const Point3 d{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return std::sqrt(dot(d, d));
}

}  // namespace

std::vector<TileFault> check_tile_header(const TileAddress& address, const DecodedTile& tile) {
  std::vector<TileFault> faults;
  const auto fault = [&](std::uint64_t offset, std::string what) {
    faults.push_back({offset, std::move(what)});
  };
  const TileMesh& mesh = tile.mesh;
  std::vector<Point3> points;
  points.reserve(mesh.size());
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    points.push_back(geocentric(longitude_at(address, mesh.u[i]), latitude_at(address, mesh.v[i]),
                                mesh.metres(i)));
  }
  const Sphere& sphere = tile.header.sphere;
  double farthest = 0.0;
  for (const Point3& p : points) farthest = std::max(farthest, distance(p, sphere.centre));
  if (farthest > sphere.radius + kLengthSlack) {
    fault(kSphereAt, "the bounding sphere leaves out vertices by up to " +
                         readable_number(farthest - sphere.radius) + " m");
  } else if (sphere.radius > farthest * (1.0 + kShareSlack) + kLengthSlack) {
    fault(kSphereAt + 24, "the bounding sphere is " + readable_number(sphere.radius / farthest) +
                              " times as wide as its centre asks for");
  }
  if (distance(tile.header.centre, bounding_sphere(points).centre) >
      bounding_sphere(points).radius + kLengthSlack) {
    fault(0, "the centre lies outside the sphere around the tile");
  }
  // The point may lie in any direction: what counts is how far out.
  const Point3& given = tile.header.horizon_occlusion;
  const double length = std::sqrt(dot(given, given));
  const Point3 towards{given[0] * kEquatorialRadius, given[1] * kEquatorialRadius,
                       given[2] * kPolarRadius};
  if (!(length > 0.0)) {
    fault(kHorizonAt, "the horizon occlusion point is the centre of the Earth");
    return faults;
  }
  const Point3 right = horizon_occlusion_point(towards, points);
  const double needed = std::sqrt(dot(right, right));
  if (length < needed * (1.0 - 1e-9)) {
    fault(kHorizonAt, "the horizon occlusion point is hidden while a vertex is not: it is " +
                          readable_number(length) + " radii out, " + readable_number(needed) +
                          " are needed");
  } else if (length > needed * (1.0 + kShareSlack)) {
    fault(kHorizonAt, "the horizon occlusion point is " + readable_number(length) + " radii out, " +
                          readable_number(needed) + " are needed");
  }
  return faults;
}

}  // namespace terrace::terrain
