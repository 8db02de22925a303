// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "point_tin_oracle.hpp"
#include "terrace/tri/point_tin.hpp"

namespace terrace::tri {
namespace {

using namespace point_tin_oracle;

TEST(PointTin, HandlesDuplicates) {
  const Cloud cloud{{0, 10, 10, 0, 5, 5, 5}, {0, 0, 10, 10, 5, 5, 5}, {0, 0, 0, 0, 7, 2, 6}};
  const std::pair<PointDuplicates, double> cases[] = {{PointDuplicates::first, 7},
                                                      {PointDuplicates::min, 2},
                                                      {PointDuplicates::max, 7},
                                                      {PointDuplicates::mean, 5}};
  PointTinOptions options;
  for (const auto& [duplicates, height] : cases) {
    options.duplicates = duplicates;
    const PointTin tin = make(cloud, {}, options);
    EXPECT_EQ(tin.duplicates, 2u);
    ASSERT_EQ(tin.vertices.size(), 5u);
    EXPECT_EQ(tin.vertices[4], (Point3{5, 5, height}));
    EXPECT_EQ(tin.sample[4], 4u);
    EXPECT_EQ(tin.errors.largest, 0);
  }
  // All count: one of them is the vertex, and the other is measured there.
  options.duplicates = PointDuplicates::all;
  for (const TinQuality quality : {TinQuality::greedy, TinQuality::removal, TinQuality::fitted}) {
    options.quality = quality;
    options.max_error = 5;
    const PointTin close = make(cloud, {}, options);
    EXPECT_EQ(close.duplicates, 2u);
    EXPECT_EQ(close.duplicate_range, 5);
    EXPECT_EQ(close.errors.covered, 6u);
    EXPECT_LE(close.errors.largest, 5);
    EXPECT_EQ(close.stuck, 0u);
    EXPECT_LE(measure_surface(cloud.x, cloud.y, cloud.z, close.vertices, close.triangles).largest,
              5);
    options.max_error = 1;
    const PointTin separate = make(cloud, {}, options);
    EXPECT_EQ(separate.stuck, 1u);
    EXPECT_GE(separate.errors.largest, 2.5);
    EXPECT_EQ(
        measure_surface(cloud.x, cloud.y, cloud.z, separate.vertices, separate.triangles).largest,
        separate.errors.largest);
  }
  options = {};
  options.duplicates = PointDuplicates::error;
  try {
    make(cloud, {}, options);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("sample 5"), std::string::npos) << error.what();
  }
}

TEST(PointTin, HasNoSurfaceWithoutArea) {
  const PointTinOptions options;
  for (const std::size_t count : {0u, 1u, 2u, 3u, 50u}) {
    Cloud equal;
    Cloud line;
    for (std::size_t i = 0; i < count; ++i) {
      equal.add(3, 4, static_cast<double>(i));
      line.add(0.1 * static_cast<double>(i), 0, 1);
    }
    const PointTin none = make(equal, {}, options);
    EXPECT_TRUE(none.vertices.empty());
    EXPECT_EQ(none.errors.uncovered, count == 0 ? 0u : 1u);
    const PointTin flat = make(line, {}, options);
    EXPECT_TRUE(flat.vertices.empty());
    EXPECT_EQ(flat.errors.uncovered, count);
  }
  // A frame alone is a surface.
  const std::vector<Point3> frame{{0, 0, 1}, {2, 0, 2}, {1, 3, 3}};
  const PointTin tin = make({}, frame, options);
  check_frame(tin, frame);
  EXPECT_EQ(tin.errors.covered, 0u);
}

TEST(PointTin, HandlesHugeAndTinyCoordinates) {
  for (const double scale : {1e90, 1e-90, 1e-160}) {
    Cloud cloud = make_cloud(PointSet::uniform, 300, 11);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      cloud.x[i] = cloud.x[i] * scale - scale / 2;
      cloud.y[i] *= scale;
    }
    for (const TinQuality quality : kQualities) {
      SCOPED_TRACE(scale);
      PointTinOptions options;
      options.max_error = 3;
      options.quality = quality;
      const PointTin tin = make(cloud, {}, options);
      check_mesh(tin);
      EXPECT_EQ(tin.errors.covered, cloud.size());
      EXPECT_LE(tin.errors.largest, 3);
    }
  }
}

TEST(PointTin, RefusesBadInput) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Cloud cloud{{0, 10, 10, 0}, {0, 0, 10, 10}, {0, 0, 0, 0}};
  const auto with_value = [&](std::vector<double> Cloud::*axis, double value) {
    Cloud bad = cloud;
    (bad.*axis)[2] = value;
    return refused([&] { make(bad, {}, {}); });
  };
  EXPECT_NE(with_value(&Cloud::x, nan).find("x of sample 2"), std::string::npos);
  EXPECT_NE(with_value(&Cloud::y, HUGE_VAL).find("y of sample 2"), std::string::npos);
  EXPECT_NE(with_value(&Cloud::z, 1e200).find("z of sample 2"), std::string::npos);
  EXPECT_NE(refused([&] { (void)point_tin(cloud.x, cloud.y, {}, {}, {}); }), "accepted");
  const auto options = [&](auto change) {
    PointTinOptions bad;
    change(bad);
    return refused([&] { make(cloud, {}, bad); });
  };
  EXPECT_NE(options([&](auto& o) { o.max_error = -1; }), "accepted");
  EXPECT_NE(options([&](auto& o) { o.max_error = nan; }), "accepted");
  EXPECT_NE(options([&](auto& o) { o.min_angle_degrees = 40; }), "accepted");
  EXPECT_NE(options([&](auto& o) { o.lattice = TinLattice{0, 1}; }), "accepted");
  EXPECT_NE(options([&](auto& o) { o.lattice = TinLattice{0, 0}; }), "accepted");
  const auto frame = [&](std::vector<Point3> bad) {
    return refused([&] { make(cloud, bad, {}); });
  };
  EXPECT_NE(frame({{0, 0, 0}, {1, 0, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {0, 1, 0}, {1, 0, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {3, 1, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {4, 0, 0}, {4, 0, 0}, {4, 4, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {4, 0, 0}, {2, 0, 0}, {4, 4, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {4, 0, 0}, {4, 4, nan}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}}), "accepted");
  // A pentagram turns left everywhere but goes around twice.
  EXPECT_NE(frame({{0, 3, 0}, {-2, -2, 0}, {3, 1, 0}, {-3, 1, 0}, {2, -2, 0}}), "accepted");
  PointTinOptions lattice;
  lattice.lattice = TinLattice{0, 1};
  EXPECT_NE(refused([&] {
              make(cloud, {{0, 0, 0}, {4.5, 0, 0}, {4, 4, 0}}, lattice);
            }),
            "accepted");
  EXPECT_EQ(refused([&] { make(cloud, {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}}, lattice); }), "accepted");
  EXPECT_NE(refused([&] {
              const std::vector<Point3> v{{0, 0, 0}};
              const std::vector<std::array<std::uint32_t, 3>> t{{0, 0, 1}};
              (void)measure_surface(cloud.x, cloud.y, cloud.z, v, t);
            }),
            "accepted");
}

}  // namespace
}  // namespace terrace::tri
