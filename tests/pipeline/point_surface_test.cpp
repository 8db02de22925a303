// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the surface at single positions, found without a triangulation, with the triangulation
// of all points.
#include "surface/point_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/predicates.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cloud_case.hpp"
#include "surface/point_window.hpp"
#include "terrace/terrain/heights.hpp"

namespace terrace {
namespace {

using terrain::Point2;
using terrain::PointCloud;
using terrain::PointSurface;
using terrain::StoredBox;
using terrain::SurfacePoint;
using tests::cloud_store;
using tests::Points;
using tests::points_of;
using tests::Random;
using tests::same_bits;
using tests::Whole;

/// Positions around the store, on its points and near the midpoints of its edges.
std::vector<Point2> places_of(const tri::Delaunay2<double>& whole, const stream::Box3& box) {
  Random random(23);
  std::vector<Point2> points, places;
  for (const tri::VertexId v : whole.all_vertices()) points.push_back(whole.point(v));
  for (int i = 0; i < 240; ++i) {
    Point2 p{};
    for (std::size_t k = 0; k < 2; ++k) {
      p[k] = box.min[k] + (random.unit() * 1.1 - 0.05) * (box.max[k] - box.min[k]);
      if (i % 4 == 1) p[k] = std::round(2 * p[k]) / 2;
    }
    if (i % 4 == 2) p = points[random.below(points.size())];
    if (i % 4 == 3) {
      const Point2 a = points[random.below(points.size())], b = points[random.below(points.size())];
      p = {0.5 * a[0] + 0.5 * b[0], 0.5 * a[1] + 0.5 * b[1]};
    }
    places.push_back(p);
  }
  return places;
}

class SurfaceOfClouds : public testing::TestWithParam<std::string> {};

TEST_P(SurfaceOfClouds, MatchesTheTriangulationWhateverIsLoaded) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      stream::Store::open(cloud_store(folder.path(), points_of(GetParam())));
  for (unsigned level = 0; level <= store.top(); ++level) {
    SCOPED_TRACE("level " + std::to_string(level));
    const Whole whole(store, level);
    const auto& triangulation = whole.triangulation;
    const std::vector<Point2> places = places_of(triangulation, store.bounds());
    const StoredBox all = terrain::flat(store.bounds());
    StoredBox part = all;
    for (std::size_t k = 0; k < 2; ++k) {
      part.min[k] += 0.3 * (all.max[k] - all.min[k]);
      part.max[k] -= 0.3 * (all.max[k] - all.min[k]);
    }
    PointCloud cloud(store, level), with_border(store, level);
    PointSurface loaded(cloud), some(cloud), none(cloud), bordered(with_border);
    ASSERT_TRUE(loaded.load(all, 1U << 20, true));
    ASSERT_TRUE(some.load(part, 1U << 20, true));
    // With the border of the voids known.
    terrain::PointWindow scratch(with_border);
    ASSERT_EQ(with_border.voids.find(scratch), triangulation.triangle_count() > 0);
    for (std::size_t i = 0; i < places.size(); ++i) {
      SCOPED_TRACE("place " + std::to_string(i));
      const SurfacePoint expected = whole.at(places[i]);
      const Point2 nearest = triangulation.point(triangulation.nearest(places[i]));
      for (PointSurface* surface : {&loaded, &some, &none, &bordered}) {
        const SurfacePoint found = surface->linear(places[i]);
        ASSERT_TRUE(same_bits(found.height, expected.height));
        ASSERT_TRUE(same_bits(found.per_column, expected.per_column));
        ASSERT_TRUE(same_bits(found.per_row, expected.per_row));
        ASSERT_EQ(surface->nearest(places[i]), nearest);
      }
      // The exact areas of cells of hundreds of cocircular points take milliseconds each.
      const bool is_round = GetParam() == "circle" || GetParam() == "parabola";
      if (is_round && (level > 0 || i >= 4)) continue;
      const SurfacePoint natural = loaded.natural(places[i]);
      ASSERT_EQ(std::isnan(natural.height), std::isnan(expected.height));
      const SurfacePoint again = some.natural(places[i]), alone = none.natural(places[i]);
      ASSERT_TRUE(same_bits(natural.height, again.height));
      ASSERT_TRUE(same_bits(natural.per_column, again.per_column));
      ASSERT_TRUE(same_bits(natural.height, alone.height));
      ASSERT_TRUE(same_bits(natural.per_row, alone.per_row));
      ASSERT_TRUE(same_bits(natural.height, bordered.natural(places[i]).height));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(PointSurface, SurfaceOfClouds,
                         testing::Values("random", "lattice", "duplicates", "voids", "clusters",
                                         "turned", "winding", "straight borders", "circle",
                                         "parabola", "far", "huge", "tiny", "line", "nearly a line",
                                         "one", "two", "one place"),
                         [](const auto& one) {
                           std::string name = one.param;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

// Points between the ends of an edge of the hull were not found if they were many cells away, so
// gradients at its ends were wrong.
TEST(PointSurface, FindsSparsePointsOnAnEdgeOfTheHull) {
  const tests::TemporaryFolder folder;
  Random random(5);
  Points points{{225, 1, 3}};
  for (int i = 0; i < 3000; ++i) points.push_back({random.unit() * 40, 0, random.unit()});
  for (const double x : {50.0, 60.0, 72.0, 87.0, 120.0, 200.0, 449.0}) {
    points.push_back({x, 0, 10 * random.unit()});
  }
  const stream::Store store = stream::Store::open(cloud_store(folder.path(), points));
  const Whole whole(store, 0);
  PointCloud cloud(store, 0);
  PointSurface surface(cloud);
  ASSERT_TRUE(surface.load(terrain::flat(store.bounds()), 1U << 20, true));
  for (const stream::Point3& p : points) {
    const SurfacePoint expected = whole.at({p[0], p[1]}), found = surface.linear({p[0], p[1]});
    ASSERT_TRUE(same_bits(found.per_column, expected.per_column)) << p[0];
    ASSERT_TRUE(same_bits(found.per_row, expected.per_row)) << p[0];
  }
}

// The circle above a position in a bend contains most of the swath's border. Each position once
// searched all of it separately, which took minutes.
TEST(PointSurface, SearchesInBendsOfASwathVisitFewPoints) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(cloud_store(folder.path(), points_of("winding")));
  PointCloud cloud(store, 0);
  PointSurface surface(cloud);
  const Whole whole(store, 0);
  const stream::Box3& box = store.bounds();
  constexpr int kSide = 100;
  std::uint64_t places = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Point2 p{box.min[0] + (box.max[0] - box.min[0]) * (i % kSide + 0.5) / kSide,
                   box.min[1] + (box.max[1] - box.min[1]) * (i / kSide + 0.5) / kSide};
    const double height = surface.linear(p).height;
    ASSERT_TRUE(same_bits(height, whole.at(p).height));
    if (!std::isnan(height)) ++places;
  }
  RecordProperty("places", std::to_string(places));
  RecordProperty("looks", std::to_string(cloud.voids.looks()));
  EXPECT_TRUE(cloud.voids.known());
  // Up to 16 visits per point, then only the points near each position.
  EXPECT_LT(cloud.voids.looks(), 17 * store.points() + 400 * places);
}

TEST(PointSurface, RejectsMorePointsThanFitAndCrowds) {
  const tests::TemporaryFolder folder;
  Random random(5);
  Points points;
  for (int i = 0; i < 3000; ++i) points.push_back({random.unit(), random.unit(), 0});
  for (int i = 0; i < 3000; ++i) {
    points.push_back({0.5 + 1e-6 * random.unit(), 0.5 + 1e-6 * random.unit(), 1});
  }
  const stream::Store store = stream::Store::open(cloud_store(folder.path(), points));
  PointCloud cloud(store, 0);
  PointSurface surface(cloud);
  const StoredBox all = terrain::flat(store.bounds());
  EXPECT_FALSE(surface.load(all, 5999, true));
  EXPECT_FALSE(surface.load(all, 6000, false));
  EXPECT_TRUE(surface.load(all, 6000, true));
  EXPECT_TRUE(surface.load({{0, 0}, {0.4, 0.4}}, 6000, false));
}

/// Loading all points at once gives the same result as loading a box around them, in the order of
/// the cells, for any number of threads.
TEST(PointCells, AreTheSameForAnyNumberOfThreads) {
  const tests::TemporaryFolder folder;
  for (const char* kind : {"random", "duplicates", "lattice", "nearly a line"}) {
    SCOPED_TRACE(kind);
    const stream::Store store =
        stream::Store::open(cloud_store(folder.path() / kind, points_of(kind)));
    for (unsigned level = 0; level <= store.top(); ++level) {
      SCOPED_TRACE("level " + std::to_string(level));
      const StoredBox all = terrain::flat(store.bounds());
      const auto visited = [&](const terrain::PointCells& cells) {
        std::vector<std::pair<Point2, double>> points;
        cells.visit_points(cells.cells_of(all),
                           [&](const Point2& p) { points.emplace_back(p, cells.height(p)); });
        return points;
      };
      stream::StoreQuery query(store);
      terrain::PointCells expected;
      const bool goes_apart = expected.load(query, level, all, store.points(), false);
      for (const unsigned threads : {1U, 3U, 64U}) {
        SCOPED_TRACE(threads);
        terrain::PointCells cells;
        ASSERT_EQ(cells.load_all(store, level, threads), goes_apart);
        ASSERT_EQ(visited(cells), visited(expected));
      }
    }
  }
}

/// A part of the area with more points than memory allows is halved repeatedly.
TEST(PointSampler, HalvesPartsThatDoNotFitWithoutChangingAnswers) {
  const tests::TemporaryFolder folder;
  Random random(11);
  Points points;
  for (int i = 0; i < 60000; ++i) {
    points.push_back({random.unit(), random.unit(), 10 * random.unit()});
  }
  for (int i = 0; i < 240000; ++i) {
    points.push_back({0.3 + 1e-3 * random.unit(), 0.7 + 1e-3 * random.unit(), random.unit()});
  }
  const stream::Store store = stream::Store::open(cloud_store(folder.path(), points));
  std::vector<Point2> places;
  for (int i = 0; i < 3000; ++i) {
    places.push_back({random.unit(), random.unit()});
    places.push_back({0.3 + 1e-3 * random.unit(), 0.7 + 1e-3 * random.unit()});
  }
  for (const auto method : {tri::Interpolation::linear, tri::Interpolation::nearest}) {
    terrain::SamplerOptions options;
    options.method = method;
    std::vector<SurfacePoint> expected(places.size()), found(places.size());
    terrain::make_sampler(store, options, {.threads = 2})->sample(places, expected);
    // Half of it is for positions, and 12 MiB of the rest is for reading.
    terrain::make_sampler(store, options, {.threads = 1, .memory_bytes = std::uint64_t{28} << 20})
        ->sample(places, found);
    for (std::size_t i = 0; i < places.size(); ++i) {
      ASSERT_TRUE(same_bits(found[i].height, expected[i].height)) << i;
      ASSERT_TRUE(same_bits(found[i].per_row, expected[i].per_row)) << i;
    }
  }
}

}  // namespace
}  // namespace terrace
