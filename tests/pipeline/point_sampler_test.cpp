// SPDX-License-Identifier: GPL-3.0-or-later
// Compares heights between the points of stores with libtri's on the triangulation of all points.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/interpolation.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cloud_case.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/heights.hpp"

namespace terrace {
namespace {

using terrain::Point2;
using terrain::SurfacePoint;
using tests::Random;
using tests::same_bits;
using tests::Whole;
using tri::Interpolation;

bool same_bits(const SurfacePoint& a, const SurfacePoint& b) {
  return same_bits(a.height, b.height) && same_bits(a.per_column, b.per_column) &&
         same_bits(a.per_row, b.per_row);
}

/// Positions around the store, on its points and at the midpoints of its edges.
std::vector<Point2> places_of(const stream::Store& store, const Whole& whole, std::size_t count) {
  Random random(17);
  std::vector<Point2> places;
  std::vector<Point2> points;
  for (const tri::VertexId v : whole.triangulation.all_vertices()) {
    points.push_back(whole.triangulation.point(v));
  }
  const stream::Box3& box = store.bounds();
  for (std::size_t i = 0; i < count; ++i) {
    Point2 p{};
    for (std::size_t k = 0; k < 2; ++k) {
      p[k] = box.min[k] + (random.unit() * 1.2 - 0.1) * (box.max[k] - box.min[k]);
      if (i % 5 == 1) p[k] = std::round(2 * p[k]) / 2;
    }
    if (i % 5 == 2) p = points[random.below(points.size())];
    if (i % 5 == 3) {
      const Point2 a = points[random.below(points.size())], b = points[random.below(points.size())];
      const double t = 0.1 * random.unit();
      p = {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
    }
    places.push_back(p);
  }
  places.push_back({NAN, 0});
  places.push_back({0, INFINITY});
  return places;
}

/// Returns the answers, and checks that neither threads, memory nor the other positions change a
/// bit.
std::vector<SurfacePoint> sampled(const stream::Store& store,
                                  const terrain::SamplerOptions& options,
                                  const std::vector<Point2>& places) {
  std::vector<SurfacePoint> out(places.size()), again(1);
  terrain::make_sampler(store, options)->sample(places, out);
  const auto other = terrain::make_sampler(
      store, options, {.threads = 3, .memory_bytes = std::uint64_t{100} << 20});
  Random random(23);
  std::vector<std::size_t> order(places.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  for (std::size_t begin = 0; begin < order.size(); begin += 70) {
    const std::size_t end = std::min(begin + 70, order.size());
    std::vector<Point2> some;
    for (std::size_t k = begin; k < end; ++k) some.push_back(places[order[k]]);
    again.resize(some.size());
    other->sample(some, again);
    for (std::size_t k = begin; k < end; ++k) {
      EXPECT_TRUE(same_bits(out[order[k]], again[k - begin])) << order[k];
    }
  }
  return out;
}

void check_heights(const stream::Store& store, unsigned level, std::size_t count) {
  const Whole whole(store, level);
  const auto& triangulation = whole.triangulation;
  const std::vector<Point2> places = places_of(store, whole, count);
  const std::size_t finite = places.size() - 2;
  const std::span<const Point2> asked(places.data(), finite);
  for (const Interpolation method :
       {Interpolation::linear, Interpolation::natural_neighbour, Interpolation::nearest}) {
    SCOPED_TRACE("method " + std::to_string(static_cast<int>(method)));
    const auto found = sampled(store, {.method = method, .level = level}, places);
    EXPECT_TRUE(std::isnan(found[finite].height) && std::isnan(found[finite + 1].height));
    const auto heights = tri::heights_at(triangulation, whole.heights, asked, method, 1);
    const auto gradients = tri::gradients_at(triangulation, whole.heights, asked,
                                             method == Interpolation::natural_neighbour
                                                 ? tri::GradientFrom::natural_neighbours
                                                 : tri::GradientFrom::triangles,
                                             1);
    for (std::size_t i = 0; i < finite; ++i) {
      SCOPED_TRACE("place " + std::to_string(i));
      ASSERT_EQ(std::isnan(found[i].height), std::isnan(heights[i]));
      if (!std::isnan(heights[i])) {
        ASSERT_NEAR(found[i].height, heights[i], 1e-7);
      }
      if (method == Interpolation::nearest) continue;
      const tri::Location location = triangulation.locate(places[i]);
      const bool linear = method == Interpolation::linear;
      if (linear && location.place != tri::Place::inside) continue;  // a different average there
      ASSERT_EQ(std::isnan(found[i].per_column), std::isnan(gradients[i].x));
      if (std::isnan(gradients[i].x)) continue;
      const double size = std::hypot(gradients[i].x, gradients[i].y);
      ASSERT_NEAR(found[i].per_column, gradients[i].x, 1e-6 * size);
      ASSERT_NEAR(found[i].per_row, gradients[i].y, 1e-6 * size);
    }
  }
}

class CloudHeights : public testing::TestWithParam<std::string> {};

TEST_P(CloudHeights, MatchTheFullTriangulation) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      stream::Store::open(tests::cloud_store(folder.path(), tests::points_of(GetParam())));
  check_heights(store, 0, 700);
  check_heights(store, store.top(), 150);
}

INSTANTIATE_TEST_SUITE_P(PointSampler, CloudHeights,
                         testing::Values("random", "lattice", "duplicates", "voids", "clusters",
                                         "turned", "line", "nearly a line", "one", "two",
                                         "one place"),
                         [](const auto& one) {
                           std::string name = one.param;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(PointSampler, AnswersOnCoarserLevelsOfRasters) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(tests::raster_store(folder.path()));
  for (unsigned level = 1; level <= store.top(); ++level) check_heights(store, level, 400);
}

TEST(PointSampler, AnswersDoNotDependOnTheSizeOfWindows) {
  // Unordered, so that the boxes of clusters overlap; some windows have many positions and some
  // few.
  const tests::TemporaryFolder folder;
  Random random(41);
  tests::Points points;
  for (int i = 0; i < 70000; ++i) {
    points.push_back({random.unit() * 100, random.unit() * 60, random.unit()});
  }
  const stream::Store store = stream::Store::open(tests::cloud_store(folder.path(), points));
  std::vector<Point2> places;
  for (int i = 0; i < 3000; ++i) {
    const bool is_crowd = i % 100 != 0;
    places.push_back({random.unit() * (is_crowd ? 40 : 100), random.unit() * (is_crowd ? 25 : 60)});
  }
  const Whole whole(store, 0);
  const std::vector<double> expected =
      tri::heights_at(whole.triangulation, whole.heights, places, Interpolation::linear, 1);
  for (const Interpolation method : {Interpolation::linear, Interpolation::nearest}) {
    std::vector<SurfacePoint> first(places.size()), out(places.size());
    terrain::make_sampler(store, {.method = method})->sample(places, first);
    for (const unsigned megabytes : {40U, 64U, 1024U}) {
      for (const unsigned threads : {1U, 3U}) {
        SCOPED_TRACE(testing::Message() << megabytes << "M, " << threads << " threads");
        terrain::make_sampler(store, {.method = method},
                              {.threads = threads, .memory_bytes = std::uint64_t{megabytes} << 20})
            ->sample(places, out);
        for (std::size_t i = 0; i < places.size(); ++i) {
          ASSERT_TRUE(same_bits(first[i], out[i])) << i;
          if (method == Interpolation::linear && !std::isnan(expected[i])) {
            ASSERT_NEAR(out[i].height, expected[i], 1e-9) << i;
          }
        }
      }
    }
  }
}

TEST(PointSampler, GivesNoHeightInTrianglesWithLongSides) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      stream::Store::open(tests::cloud_store(folder.path(), tests::points_of("voids")));
  const Whole whole(store, 0);
  const std::vector<Point2> places = places_of(store, whole, 500);
  for (const Interpolation method :
       {Interpolation::linear, Interpolation::natural_neighbour, Interpolation::nearest}) {
    const auto all = sampled(store, {.method = method}, places);
    for (const double limit : {8.0, 25.0, 70.0}) {
      SCOPED_TRACE(limit);
      const auto some = sampled(store, {.method = method, .max_edge = limit}, places);
      int left_out = 0;
      for (std::size_t i = 0; i + 2 < places.size(); ++i) {
        SCOPED_TRACE(i);
        const tri::Location found = whole.triangulation.locate(places[i]);
        if (found.place == tri::Place::vertex || found.place == tri::Place::edge) continue;
        bool is_long = found.place == tri::Place::outside;
        if (found.place == tri::Place::inside) {
          const auto v = whole.triangulation.vertices(found.triangle);
          for (std::size_t k = 0; k < 3; ++k) {
            const Point2 a = whole.triangulation.point(v[k]);
            const Point2 b = whole.triangulation.point(v[(k + 1) % 3]);
            is_long = is_long || std::hypot(b[0] - a[0], b[1] - a[1]) > limit;
          }
        }
        ASSERT_EQ(std::isnan(some[i].height), is_long);
        if (!is_long) {
          ASSERT_TRUE(same_bits(some[i].height, all[i].height));
        }
        left_out += is_long ? 1 : 0;
      }
      EXPECT_GT(left_out, 30);
    }
  }
}

TEST(PointSampler, RejectsAnEdgeLimitForRasters) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(tests::raster_store(folder.path()));
  EXPECT_THROW(terrain::make_sampler(store, {.max_edge = 5.0}), terrain::UsageError);
  EXPECT_THROW(terrain::make_sampler(store, {.level = store.top() + 1}), terrain::UsageError);
}

}  // namespace
}  // namespace terrace
