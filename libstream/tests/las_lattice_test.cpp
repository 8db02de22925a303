// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "las_testing.hpp"

namespace terrace::stream {
namespace {

TEST_F(Las, ReadsFilesWithDifferentOffsetsOntoOneLattice) {
  LasParts first{.points = 1, .records = std::string(28, '\0')}, second = first;
  second.offset = {1.25, -3, 0};
  const AllPoints both = read_all({put_file("1.las", first), put_file("2.las", second)});
  EXPECT_EQ(both.points.positions, (std::vector<Point3>{{0, 0, 0}, {125, -300, 0}}));
}

// Each coordinate stays what it is in its own file, whatever the scales and offsets.
TEST_F(Las, ReadsFilesOfAnyScaleAndOffsetTogether) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    const auto pick = [&](const std::vector<double>& values) {
      return values[random() % values.size()];
    };
    const std::size_t count = 2 + random() % 4;
    std::vector<std::string> files;
    std::vector<Point3> world;
    for (std::size_t i = 0; i < count; ++i) {
      LasParts parts{.points = 3, .records = std::string(3 * 28, '\0')};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        parts.scale[axis] = pick({0.01, 0.001, 0.00025, 0.005});
        parts.offset[axis] = pick({0, 5e4, 6.5e4 + 0.37, 6.5e4 + 0.0125, -7e4 - 0.0005});
        for (std::size_t k = 0; k < 3; ++k) {
          put(parts.records, 28 * k + 4 * axis, static_cast<std::int32_t>(random() % 20'000'001));
        }
      }
      files.push_back(put_file(std::to_string(i) + ".las", parts));
      const AllPoints one = read_file(files.back());
      for (const Point3& p : one.points.positions) world.push_back(world_point(one.info, p));
    }
    const AllPoints all = read_all(files);
    ASSERT_EQ(all.points.size(), world.size());
    EXPECT_TRUE(lattice_of(all.info)) << "all of these lie on a lattice";
    for (std::size_t i = 0; i < world.size(); ++i) {
      const Point3 place = world_point(all.info, all.points.positions[i]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(all.points.positions[i][axis], std::round(all.points.positions[i][axis]));
        EXPECT_NEAR(place[axis], world[i][axis], 1e-8) << i << ", "
                                                       << "xyz"[axis];
      }
    }
  }
}

TEST_F(Las, UsesTheCoarsestCommonLattice) {
  LasParts first{.points = 1, .records = std::string(28, '\0')}, second = first;
  const auto together = [&] {
    return read_all({put_file("1.las", first), put_file("2.las", second)});
  };
  second.scale = {0.001, 0.001, 0.00025};
  second.offset = {1, 1, 0.25};
  EXPECT_EQ(lattice_of(together().info), (Lattice{.scale = second.scale, .offset = {}}));
  // Equal steps in x and y stay equal even if only one axis needs finer ones.
  second.scale = first.scale;
  second.offset = {1.255, 0, 0};
  const AllPoints finer = together();
  EXPECT_EQ(lattice_of(finer.info), (Lattice{.scale = {0.005, 0.005, 0.01}, .offset = {}}));
  EXPECT_EQ(finer.points.positions, (std::vector<Point3>{{0, 0, 0}, {251, 0, 0}}));
  EXPECT_EQ(finer.info.note, "");
}

TEST_F(Las, UsesDoublesWithoutACommonLattice) {
  LasParts first{.points = 1, .records = std::string(28, '\0')}, second = first;
  first.offset = {1e5, 0, 0};
  put(second.records, 0, std::int32_t{12345});
  const auto together = [&] {
    return read_all({put_file("1.las", first), put_file("2.las", second)});
  };
  second.scale = {0.0123456789, 0.01, 0.01};  // like a range divided into 2^32 steps
  AllPoints all = together();
  EXPECT_EQ(all.info.coordinates[0].type, ScalarType::f64);
  EXPECT_EQ(all.points.positions, (std::vector<Point3>{{1e5, 0, 0}, {12345 * 0.0123456789, 0, 0}}));
  EXPECT_NE(all.info.note.find("kept as doubles"), std::string::npos);
  // On one lattice, but too far apart for 32 bits.
  second.scale = first.scale;
  second.offset = {1e8, 0, 0};
  second.bounds = {{1e8, 0, 0}, {1e8 + 1000, 0, 0}};
  first.bounds = {{1e5, 0, 0}, {1e5 + 1000, 0, 0}};
  all = together();
  EXPECT_EQ(all.points.positions, (std::vector<Point3>{{1e5, 0, 0}, {1e8 + 123.45, 0, 0}}));
  ASSERT_TRUE(all.info.stated_bounds);
  EXPECT_EQ(all.info.stated_bounds->max[0], 1e8 + 1000);
  // The offset moves if that suffices.
  second.offset = {3e7, 0, 0};
  second.bounds = {{3e7, 0, 0}, {3e7 + 1000, 0, 0}};
  all = together();
  ASSERT_TRUE(lattice_of(all.info));
  EXPECT_NEAR(world_point(all.info, all.points.positions[1])[0], 3e7 + 123.45, 1e-8);
  // If headers have no bounds, it depends on the points.
  first.bounds = second.bounds = {.min = {}, .max = {}};
  EXPECT_NE(error_of(together).find("out of range"), std::string::npos);
}

TEST_F(Las, UsesAsManyDecimalsAsThePointsNeed) {
  const auto written = [&](std::vector<Point3> points, std::optional<Box3> bounds = {},
                           bool degrees = false) {
    const std::string path = folder_.path() / "decimals.las";
    const auto system = [degrees] {
      Crs crs;
      crs.geographic = degrees;
      return crs;
    };
    const auto writer =
        open_point_writer(path, {.crs = system, .bounds = bounds}, {.replace = true});
    writer->append({.positions = points, .payload = {}});
    writer->finish();
    const AllPoints all = read_file(path);
    const Lattice lattice = *lattice_of(all.info);
    double largest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Point3 world = world_point(all.info, all.points.positions[i]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double moved = std::abs(world[axis] - points[i][axis]);
        EXPECT_LE(moved, lattice.scale[axis] * 0.5000001);
        largest = std::max(largest, moved);
      }
    }
    EXPECT_EQ(writer->rounding() > 0, largest > 1e-9);
    return lattice.scale;
  };
  EXPECT_EQ(written({{691000.25, 5338000.125, 7}}), (Point3{0.001, 0.001, 0.001}));
  EXPECT_EQ(written({{-0.0946899, 0.0329874, 1.5}, {0.06, 0.18, 0}}), (Point3{1e-7, 1e-7, 0.001}));
  // 1/3 gets as many decimals as 32 bits allow within the bounds.
  Box3 bounds{.min = {0, 0, 0}, .max = {1e6, 1e6, 1}};
  EXPECT_EQ(written({{1 / 3.0, 0, 0}}, bounds), (Point3{0.001, 0.001, 0.001}));
  bounds.max[1] = 1e12;
  EXPECT_EQ(written({{1 / 3.0, 0, 0}}, bounds), (Point3{1000, 1000, 0.001}));
  // Without bounds more points may follow: millimetre steps cover 200 km, finer steps less.
  EXPECT_EQ(written({{4e5, 5e6, 7}, {5e5, 5.1e6 + 0.125, 7}}), (Point3{0.001, 0.001, 0.001}));
  EXPECT_EQ(written({{4e5, 5e6, 7}, {5e5 + 1 / 3.0, 5.1e6, 7}}), (Point3{0.001, 0.001, 0.001}));
  EXPECT_EQ(written({{4e5, 5e6, 7}, {4e5 + 1 / 3.0, 5e6 + 400, 7}}), (Point3{1e-4, 1e-4, 0.001}));
  EXPECT_EQ(written({{4e5, 5e6, 7}, {8e5, 5.1e6 + 0.125, 7}}), (Point3{0.01, 0.01, 0.001}));
  EXPECT_EQ(written({{8, 46, 7}, {9, 47 - 1 / 3.0, 7}}, {}, true), (Point3{1e-7, 1e-7, 0.001}));
}

TEST_F(Las, KeepsTheDecimalsOfLaterPoints) {
  for (const char* const name : {"sea.las", "sea.laz", "sea.copc.laz"}) {
    const std::string path = folder_.path() / name;
    PointBlock sea, land;
    for (int i = 0; i < 100; ++i) sea.positions.push_back({5e5 + i, 5.2e6 - i, 0});
    for (int i = 0; i < 100; ++i) land.positions.push_back({5e5 + i, 5.1e6 + 0.125, 0.37 + i});
    const auto writer = open_point_writer(path, {}, {.replace = true});
    writer->append(sea);
    writer->append(land);
    writer->finish();
    EXPECT_EQ(writer->rounding(), 0) << name;
    const AllPoints all = read_file(path);
    Box3 box;
    for (const Point3& p : all.points.positions) box.include(world_point(all.info, p));
    EXPECT_NEAR(box.max[2], 99.37, 1e-9) << name;
    EXPECT_NEAR(box.min[1], 5.1e6 + 0.125, 1e-9) << name;
  }
}

}  // namespace
}  // namespace terrace::stream
