// SPDX-License-Identifier: Apache-2.0
// Compares points near a place with all points of the store, and their distances with geodesics.
#include "terrace/terrain/near_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <GeographicLib/Geodesic.hpp>
#include <gtest/gtest.h>
#include <terrace/stream/store.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

using tests::TemporaryFolder;

/// Builds a store of 3,000 points within about 500 m of (x, y), with heights up to 100.
stream::Store cloud(const TemporaryFolder& folder, const std::string& crs, double x, double y,
                    double unit_x, double unit_y) {
  const std::filesystem::path text = folder.path() / "points.xyz";
  std::mt19937_64 random(17);
  {
    std::ofstream file(text);
    for (int i = 0; i < 3000; ++i) {
      const auto part = [&] { return static_cast<double>(random() % 100001) / 100000; };
      char line[100];
      std::snprintf(line, sizeof line, "%.9f %.9f %.2f\n", x + unit_x * (part() - 0.5),
                    y + unit_y * (part() - 0.5), 100 * part());
      file << line;
    }
  }
  BuildRequest request;
  request.inputs = {text.string()};
  request.store = folder.path() / "store";
  request.crs = stream::Crs{};
  request.crs->epsg = std::stoi(crs);
  request.crs->geographic = crs == "4326";
  request.block_points = 400;
  build_store(request);
  return stream::Store::open(request.store);
}

std::vector<stream::Point3> all_points(const stream::Store& store, unsigned from) {
  std::vector<stream::Point3> all;
  for (unsigned level = from; level <= store.top(); ++level) {
    store.for_each(level, [&](stream::ClusterId, const stream::ClusterRecord&,
                              const stream::ClusterPoints& points) {
      all.insert(all.end(), points.positions.begin(), points.positions.end());
    });
  }
  return all;
}

/// Compares the sorted distances of all points by `exact` with those that are found.
template <class Exact>
void expect_nearest(const stream::Store& store, const NearPlace& place, double tolerance,
                    const Exact& exact) {
  stream::StoreQuery query(store);
  for (unsigned level = 0; level <= store.top(); ++level) {
    std::vector<double> expected;
    for (const stream::Point3& p : all_points(store, level)) expected.push_back(exact(p));
    std::sort(expected.begin(), expected.end());
    const auto found = nearest_points(query, place, 50, level);
    ASSERT_EQ(found.size(), std::min<std::size_t>(50, expected.size()));
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(found[i].distance, exact(found[i].position), tolerance * (1 + expected[i]));
      EXPECT_NEAR(found[i].distance, expected[i], tolerance * (1 + expected[i]));
    }
    const auto within = points_within(query, place, found.back().distance, level);
    ASSERT_GE(within.size(), found.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(within[i].position, found[i].position);
    }
    EXPECT_EQ(within.back().distance, found.back().distance);
  }
}

TEST(NearPoints, DistancesInDegreesMatchGeodesics) {
  for (const double latitude : {0.0, 46.5, -70.0}) {
    SCOPED_TRACE(latitude);
    const TemporaryFolder folder;
    const double wide = 0.01 / std::cos(latitude * 3.14159265358979 / 180);
    const stream::Store store = cloud(folder, "4326", 7.5, latitude, wide, 0.01);
    const std::array<double, 2> place{7.5 + 0.2 * wide, latitude - 0.001};
    const auto geodesic = [&](const stream::Point3& p) {
      double metres = 0;
      GeographicLib::Geodesic::WGS84().Inverse(place[1], place[0], p[1], p[0], metres);
      return metres;
    };
    expect_nearest(store, {.xy = place}, 1e-4, geodesic);
    expect_nearest(store, {.xy = place, .z = 30.0}, 1e-4,
                   [&](const stream::Point3& p) { return std::hypot(geodesic(p), p[2] - 30.0); });
  }
}

TEST(NearPoints, DistancesOfProjectionAreOnTheGround) {
  const TemporaryFolder folder;
  // Far from the central meridian, a metre of the grid is 1.0011 metres.
  const stream::Store store = cloud(folder, "32632", 800000, 5200000, 900, 900);
  const auto scaled = [&](const stream::Point3& p) {
    return std::hypot(p[0] - 800100, p[1] - 5200050) / 1.000712;
  };
  expect_nearest(store, {.xy = {800100, 5200050}}, 2e-5, scaled);
}

TEST(NearPoints, RejectsInvalidArguments) {
  const TemporaryFolder folder;
  const stream::Store store = cloud(folder, "32632", 500000, 5200000, 900, 900);
  stream::StoreQuery query(store);
  const NearPlace place{.xy = {500000, 5200000}};
  EXPECT_THROW(static_cast<void>(nearest_points(query, place, 1, store.top() + 1)), UsageError);
  EXPECT_THROW(static_cast<void>(nearest_points(query, {.xy = {NAN, 0}}, 1)), UsageError);
  EXPECT_THROW(static_cast<void>(points_within(query, place, -1)), UsageError);
  EXPECT_THROW(static_cast<void>(points_within(query, place, INFINITY)), UsageError);
  EXPECT_EQ(points_within(query, place, 1e6).size(), store.points());
}

}  // namespace
}  // namespace terrace::terrain
