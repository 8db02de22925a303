// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <vector>

#include <GeographicLib/Geocentric.hpp>
#include <gtest/gtest.h>
#include <terrace/base/random.hpp>

#include "base/vector.hpp"
#include "tile/format/ellipsoid.hpp"

namespace terrace::terrain {
namespace {

using stream::Point3;

struct Random {
  std::uint64_t seed;
  double between(double low, double high) {
    seed = base::splitmix64(seed);
    return low + (high - low) * base::unit_interval(seed);
  }
};

TEST(Ellipsoid, CoordinatesAndFramesMatchGeographicLib) {
  Random random{11};
  for (int round = 0; round < 2000; ++round) {
    SCOPED_TRACE(round);
    double lon = random.between(-180, 180), lat = random.between(-90, 90);
    if (round < 4) lat = round < 2 ? 90 : -90;
    if (round % 7 == 0) lon = 180;
    const double h = random.between(-11000, 9000);
    Point3 expected;
    std::vector<double> rotation(9);
    GeographicLib::Geocentric::WGS84().Forward(lat, lon, h, expected[0], expected[1], expected[2],
                                               rotation);
    const Point3 p = geocentric(lon, lat, h);
    const LocalFrame frame = local_frame(lon, lat);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(p[axis], expected[axis], 5e-9);
      EXPECT_NEAR(frame.east[axis], rotation[3 * axis], 1e-14);
      EXPECT_NEAR(frame.north[axis], rotation[3 * axis + 1], 1e-14);
      EXPECT_NEAR(frame.up[axis], rotation[3 * axis + 2], 1e-14);
    }
  }
}

TEST(Ellipsoid, BoundingSpheresContainTheirPoints) {
  Random random{5};
  std::vector<Point3> points{geocentric(10, 46, 0)};
  EXPECT_EQ(bounding_sphere(points).radius, 0);
  for (int i = 0; i < 500; ++i) {
    points.push_back(geocentric(random.between(9, 12), random.between(45, 47), 3000));
    const Sphere sphere = bounding_sphere(points);
    for (const Point3& p : points) {
      const Point3 d{p[0] - sphere.centre[0], p[1] - sphere.centre[1], p[2] - sphere.centre[2]};
      EXPECT_LE(std::sqrt(dot(d, d)), sphere.radius);
    }
  }
}

// Whether the ellipsoid hides a point from a viewer, both in units of the radii.
bool hidden(const Point3& viewer, const Point3& point) {
  const Point3 ray{point[0] - viewer[0], point[1] - viewer[1], point[2] - viewer[2]};
  const double a = dot(ray, ray), b = 2 * dot(viewer, ray), c = dot(viewer, viewer) - 1;
  const double root = b * b - 4 * a * c;
  if (root <= 0) return false;
  const double first = (-b - std::sqrt(root)) / (2 * a);
  return first > 0 && first < 1 - 1e-9;
}

TEST(Ellipsoid, TileIsHiddenIfHorizonPointIs) {
  Random random{3};
  int hidden_tiles = 0;
  for (int round = 0; round < 3000; ++round) {
    SCOPED_TRACE(round);
    const double lon = random.between(-180, 180), lat = random.between(-80, 80);
    const double reach = random.between(0.01, 8);
    std::vector<Point3> points;
    for (int i = 0; i < 30; ++i) {
      points.push_back(geocentric(lon + random.between(-reach, reach),
                                  lat + random.between(-reach, reach), random.between(0, 9000)));
    }
    const Point3 occlusion = horizon_occlusion_point(geocentric(lon, lat, 0), points);
    const Point3 place = geocentric(random.between(-180, 180), random.between(-90, 90),
                                    std::exp(random.between(std::log(1e4), std::log(1e8))));
    const Point3 viewer{place[0] / kEquatorialRadius, place[1] / kEquatorialRadius,
                        place[2] / kPolarRadius};
    if (!hidden(viewer, occlusion)) continue;
    ++hidden_tiles;
    for (const Point3& p : points) {
      EXPECT_TRUE(hidden(
          viewer, {p[0] / kEquatorialRadius, p[1] / kEquatorialRadius, p[2] / kPolarRadius}));
    }
  }
  EXPECT_GT(hidden_tiles, 500);
}

TEST(Ellipsoid, HemisphereIsNeverHidden) {
  std::vector<Point3> points;
  for (double lon = -180; lon <= 0; lon += 15) {
    for (double lat = -90; lat <= 90; lat += 15) points.push_back(geocentric(lon, lat, 0));
  }
  const Point3 occlusion = horizon_occlusion_point(geocentric(-90, 0, 0), points);
  EXPECT_GT(std::sqrt(dot(occlusion, occlusion)), 1e5);
  for (const double c : occlusion) EXPECT_TRUE(std::isfinite(c));
}

}  // namespace
}  // namespace terrace::terrain
