// SPDX-License-Identifier: GPL-3.0-or-later
// Random and degenerate clouds: the triangles of random windows, and the surface at random places
// with any part of the cloud loaded, are those of the triangulation of all points. Each cloud
// depends only on its seed, which failures name.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cloud_case.hpp"
#include "surface/point_surface.hpp"
#include "surface/point_window.hpp"

namespace terrace {
namespace {

using terrain::Point2;
using terrain::PointCloud;
using terrain::PointSurface;
using terrain::PointWindow;
using terrain::StoredBox;
using terrain::SurfacePoint;
using tests::Points;
using tests::Random;
using tests::same_bits;
using tests::Whole;

/// Adds points of one kind in about the square from 0 to 1000.
void add_some(Points& points, Random& random) {
  const std::uint64_t count = 1 + random.below(400);
  const std::uint64_t kind = random.below(8);
  const Point2 at{std::round(random(0, 1000)), std::round(random(0, 1000))};
  const double size = std::pow(10.0, random(-3, 2.5));
  const auto steps = [&] { return static_cast<double>(random.below(7)) - 3; };
  const Point2 step{steps(), steps()};
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto k = static_cast<double>(i);
    Point2 p = at;
    switch (kind) {
      case 0:  // evenly spread
        p = {random(0, 1000), random(0, 1000)};
        break;
      case 1:  // a cluster
        p = {at[0] + size * random.unit(), at[1] + size * random.unit()};
        break;
      case 2:  // a grid, turned if the steps are
      case 3: {
        const double u = static_cast<double>(i % 20), v = static_cast<double>(i / 20);
        p = {at[0] + u * step[0] - v * step[1], at[1] + u * step[1] + v * step[0]};
        break;
      }
      case 4:  // a line
        p = {at[0] + k * step[0], at[1] + k * step[1]};
        break;
      case 5: {  // places on the circles x * x + y * y = 1105 and 4 * 1105
        constexpr std::array<Point2, 8> kOn{
            {{33, 4}, {32, 9}, {31, 12}, {24, 23}, {23, 24}, {12, 31}, {9, 32}, {4, 33}}};
        const Point2 on = kOn[random.below(8)];
        const auto side = [&] { return (random.below(2) == 0 ? -1.0 : 1.0); };
        const double scale = random.below(2) == 0 ? 1 : 2;
        p = {at[0] + scale * side() * on[0], at[1] + scale * side() * on[1]};
        break;
      }
      case 6:  // whole numbers, many of them equal
        p = {at[0] + static_cast<double>(random.below(15)),
             at[1] + static_cast<double>(random.below(15))};
        break;
      default:  // copies of earlier places, with other heights
        if (points.empty()) break;
        const stream::Point3& other = points[random.below(points.size())];
        p = {other[0], other[1]};
        break;
    }
    points.push_back({p[0], p[1], 10 * random.unit()});
  }
}

Points random_cloud(Random& random) {
  Points points;
  for (std::uint64_t kinds = 1 + random.below(4); kinds > 0; --kinds) add_some(points, random);
  // A power of two keeps lines straight and circles round.
  const double scale = std::pow(2.0, std::round(random(-12, 12)));
  for (stream::Point3& p : points) {
    p[0] *= scale;
    p[1] *= scale;
  }
  return points;
}

/// A box of any size that is often beyond the bounds, or has borders or corners on points.
StoredBox random_box(const stream::Box3& bounds, const std::vector<Point2>& points,
                     Random& random) {
  const auto place = [&] {
    Point2 p{};
    for (std::size_t k = 0; k < 2; ++k) {
      p[k] = bounds.min[k] + random(-0.2, 1.2) * (bounds.max[k] - bounds.min[k]);
      if (random.below(3) == 0) p[k] = points[random.below(points.size())][k];
    }
    return p;
  };
  const Point2 from = place();
  Point2 to = place();
  const double share = random.below(2) == 0 ? 1 : random(0, 0.2);
  for (std::size_t k = 0; k < 2; ++k) to[k] = from[k] + share * (to[k] - from[k]);
  return base::box_of(std::array{from, to});
}

Point2 random_place(const stream::Box3& bounds, const std::vector<Point2>& points, Random& random) {
  const Point2 a = points[random.below(points.size())], b = points[random.below(points.size())];
  switch (random.below(4)) {
    case 0:
      return a;
    case 1:
      return {0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])};
    case 2:
      return {a[0], b[1]};
    default:
      return {bounds.min[0] + random(-0.1, 1.1) * (bounds.max[0] - bounds.min[0]),
              bounds.min[1] + random(-0.1, 1.1) * (bounds.max[1] - bounds.min[1])};
  }
}

void check(PointSurface& surface, const Whole& whole, const Point2& place,
           const terrain::TooLong& too_long) {
  const SurfacePoint expected = whole.at(place, too_long), found = surface.linear(place);
  ASSERT_TRUE(same_bits(found.height, expected.height));
  ASSERT_TRUE(same_bits(found.per_column, expected.per_column));
  ASSERT_TRUE(same_bits(found.per_row, expected.per_row));
  const auto& all = whole.triangulation;
  ASSERT_EQ(surface.nearest(place), all.point(all.nearest(place)));
}

class RandomClouds : public testing::TestWithParam<std::uint64_t> {};

TEST_P(RandomClouds, HaveTheTrianglesOfAllPoints) {
  const std::uint64_t seed = GetParam();
  SCOPED_TRACE("seed " + std::to_string(seed));
  const tests::TemporaryFolder folder;
  Random random(seed);
  const Points points = random_cloud(random);
  const stream::Store store =
      stream::Store::open(tests::cloud_store(folder.path(), points, 16 + random.below(150)));
  for (const unsigned level : {0U, static_cast<unsigned>(random.below(store.top() + 1))}) {
    SCOPED_TRACE("level " + std::to_string(level));
    const Whole whole(store, level);
    std::vector<Point2> places;
    for (const tri::VertexId v : whole.triangulation.all_vertices()) {
      places.push_back(whole.triangulation.point(v));
    }
    // The border of the voids is found when windows have searched enough, or at once.
    PointCloud cloud(store, level);
    PointWindow window(cloud);
    if (random.below(2) == 0) cloud.voids.find(window);
    for (int i = 0; i < 8; ++i) {
      SCOPED_TRACE("box " + std::to_string(i));
      const StoredBox box = random_box(store.bounds(), places, random);
      window.load(box);
      tests::check_window(whole, window, box);
      if (testing::Test::HasFatalFailure()) return;
    }
    const double longest = random(0, 1) * (store.bounds().max[0] - store.bounds().min[0]);
    terrain::TooLong too_long;
    if (random.below(3) == 0) {
      too_long = [longest](const Point2& a, const Point2& b) {
        return std::max(std::abs(a[0] - b[0]), std::abs(a[1] - b[1])) > longest;
      };
    }
    PointSurface loaded(cloud, too_long), unloaded(cloud, too_long);
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(loaded.load(random_box(store.bounds(), places, random), points.size(), true));
      for (int k = 0; k < 12; ++k) {
        SCOPED_TRACE("place " + std::to_string(i) + "." + std::to_string(k));
        const Point2 place = random_place(store.bounds(), places, random);
        check(loaded, whole, place, too_long);
        check(unloaded, whole, place, too_long);
        if (testing::Test::HasFatalFailure()) return;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomClouds, testing::Range<std::uint64_t>(1, 81));

}  // namespace
}  // namespace terrace
