// SPDX-License-Identifier: Apache-2.0
// Long work calls the stop check at intervals, and an exception from it ends the work.

#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/stop_check.hpp>

#include "inputs.hpp"
#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"
#include "terrace/cluster/hierarchy.hpp"
#include "terrace/cluster/k_means.hpp"
#include "terrace/cluster/k_median.hpp"
#include "terrace/cluster/linkage.hpp"

namespace terrace::cluster {
namespace {

struct Stop {};
using Work = std::function<void(const base::StopCheck&)>;

/// work: must use one thread, so that the calls are the same each time.
void expect_stops(const Work& work, std::size_t least_calls) {
  std::size_t calls = 0;
  work([&] { ++calls; });
  const std::size_t all = calls;
  ASSERT_GE(all, least_calls);
  for (const std::size_t last : {std::size_t{1}, (all + 1) / 2, all}) {
    calls = 0;
    EXPECT_THROW(work([&] {
                   if (++calls == last) throw Stop();
                 }),
                 Stop);
    EXPECT_EQ(calls, last) << "of " << all;
  }
}

std::vector<Point3> some(std::size_t count) {
  std::mt19937_64 random(1);
  return inputs::cube(count, random);
}

TEST(StopCheck, EndsEveryLinkage) {
  const std::vector<Point3> points = some(3000), many = some(40000);
  using enum LinkageMethod;
  for (const LinkageMethod method : {single, complete, average, weighted, ward, centroid, median}) {
    SCOPED_TRACE(static_cast<int>(method));
    for (const MatrixEntry entry : {MatrixEntry::float32, MatrixEntry::float64}) {
      expect_stops(
          [&](const base::StopCheck& check) {
            static_cast<void>(linkage(method == single ? many : points, method,
                                      {.entry = entry, .check_stop = check}));
          },
          60);
    }
    expect_stops(
        [&](const base::StopCheck& check) {
          const auto of_pair = [&](std::uint32_t i, std::uint32_t j) {
            return distance(Euclidean{}, points[i], points[j]);
          };
          static_cast<void>(linkage(1000, of_pair, method, {.check_stop = check}));
        },
        200);
  }
}

TEST(StopCheck, EndsTheChainOfCompleteLinkage) {
  // With points in geometric progression, each round finds only one pair.
  std::vector<Point3> points;
  for (int i = 0; i < 600; ++i) points.push_back({std::ldexp(1.0, i), 0, 0});
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(linkage(points, LinkageMethod::complete, {.check_stop = check}));
      },
      60);
}

TEST(StopCheck, EndsWorkOfSeveralThreads) {
  const std::vector<Point3> points = some(3000);
  std::atomic<std::size_t> calls{0};
  constexpr std::size_t kLast = 20;
  constexpr unsigned kThreads = 4;
  const auto stop = [&] {
    if (++calls >= kLast) throw Stop();
  };
  EXPECT_THROW(static_cast<void>(linkage(points, LinkageMethod::complete,
                                         {.threads = kThreads, .check_stop = stop})),
               Stop);
  EXPECT_LE(calls, kLast + kThreads);
}

TEST(StopCheck, EndsKMeans) {
  const std::vector<Point3> points = some(20000);
  const auto work = [&](const base::StopCheck& check) {
    static_cast<void>(k_means(points, {}, {.clusters = 300, .check_stop = check}));
  };
  expect_stops(work, 100);
  const std::vector<Point3> centres = some(300);
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(
            k_means_from(centres, points, {}, {.max_iterations = 20, .check_stop = check}));
      },
      30);
}

TEST(StopCheck, EndsKMeansWhereEveryCentreIsEquallyNear) {
  // No box excludes a centre, so a chunk of points alone is a lot of work.
  std::vector<Point3> points(4000, Point3{0, 0, 0}), centres;
  for (std::size_t i = 0; i < 4000; ++i) {
    centres.push_back(
        {std::cos(0.001 * static_cast<double>(i)), std::sin(0.001 * static_cast<double>(i)), 0});
  }
  points.back() = {1e-6, 0, 0};
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(
            k_means_from(centres, points, {}, {.max_iterations = 0, .check_stop = check}));
      },
      20);
}

TEST(StopCheck, EndsFacilityLocation) {
  const std::vector<Point3> points = some(600), many = some(30000);
  using enum FacilityStrategy;
  const std::vector<std::pair<FacilityStrategy, std::size_t>> least_calls{
      {full_scan, 40},  {quadtree, 40},      {octree, 40},          {kd_tree, 40},
      {facilities, 40}, {interchange, 1000}, {jain_vazirani, 1000}, {greedy_stars, 600}};
  for (const auto& [strategy, least] : least_calls) {
    SCOPED_TRACE(name_of(strategy));
    const FacilityPoints problem{.points = points, .facility_cost = 0.2};
    expect_stops(
        [&, strategy = strategy](const base::StopCheck& check) {
          static_cast<void>(solve(
              problem, {.strategy = strategy, .restarts = 1, .steps = 50, .check_stop = check}));
        },
        least);
  }
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(solve(FacilityPoints{.points = many, .facility_cost = 0.02},
                                {.strategy = fast, .check_stop = check}));
      },
      10);
  // A single candidate of a large set takes long.
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(solve(FacilityPoints{.points = many, .facility_cost = 1.0},
                                {.strategy = full_scan, .steps = 30, .check_stop = check}));
      },
      30);
}

TEST(StopCheck, EndsTheCheckOfAMatrix) {
  constexpr std::size_t kSide = 1000;
  const std::vector<double> opening(kSide, 1.0), connection(kSide * kSide, 1.0);
  expect_stops(
      [&](const base::StopCheck& stop) {
        check(FacilityMatrix{kSide, kSide, opening, connection}, stop);
      },
      15);
}

TEST(StopCheck, EndsClustersOfASize) {
  const std::vector<Point3> points = some(30000);
  // The first calls are made while blocks are cut, before any is clustered.
  std::size_t calls = 0;
  const auto no_block = [](std::uint64_t) { FAIL() << "a block is done"; };
  EXPECT_THROW(static_cast<void>(clusters_of_size(points, 1000, 1, 1, no_block,
                                                  [&] {
                                                    if (++calls == 5) throw Stop();
                                                  })),
               Stop);
  expect_stops(
      [&](const base::StopCheck& stop) {
        static_cast<void>(clusters_of_size(points, 1000, 1, 1, {}, stop));
      },
      20);
}

TEST(StopCheck, LeavesABlockClustererUsable) {
  const std::vector<Point3> points = some(30000);
  BlockClusterer clusterer;
  BlockClustering stopped, after, other;
  const auto stop = [] { throw Stop(); };
  EXPECT_THROW(clusterer.run(points, {}, {.facility_cost = 0.02, .check_stop = stop}, stopped),
               Stop);
  clusterer.run(points, {}, {.facility_cost = 0.02}, after);
  BlockClusterer().run(points, {}, {.facility_cost = 0.02}, other);
  EXPECT_EQ(after.facilities, other.facilities);
  EXPECT_EQ(after.assignment, other.assignment);
}

TEST(StopCheck, EndsKMedianAndBounds) {
  const std::vector<Point3> points = some(1500);
  const FacilityPoints problem{.points = points, .facility_cost = 0.2};
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(
            k_median(problem, 10, {.restarts = 1, .bound_steps = 2, .check_stop = check}));
      },
      1000);
  const FacilitySolution solution = solve(problem, {.steps = 50});
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(lower_bound(problem, solution, {.steps = 3, .check_stop = check}));
      },
      100);
  std::vector<double> costs;
  for (std::size_t j = 0; j < 60; ++j) {
    for (std::size_t i = 0; i < 60; ++i) {
      costs.push_back(distance(Euclidean{}, points[j], points[i]));
    }
  }
  const std::vector<double> opening(60, 0.5);
  const FacilityMatrix matrix{60, 60, opening, costs};
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(lower_bound(matrix, {}, {.steps = 3, .check_stop = check}));
      },
      100);
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(k_median(matrix, 5, {.restarts = 1, .check_stop = check}));
      },
      100);
}

}  // namespace
}  // namespace terrace::cluster
