// SPDX-License-Identifier: Apache-2.0
// Long work calls the stop check at intervals, and an exception from it ends the work.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/stop_check.hpp>

#include "terrace/matching/assignment.hpp"
#include "terrace/matching/halving.hpp"
#include "terrace/matching/large_matching.hpp"
#include "terrace/matching/matching.hpp"
#include "terrace/matching/matching_tree.hpp"
#include "terrace/matching/point_assignment.hpp"
#include "terrace/matching/point_matching.hpp"
#include "terrace/matching/sparse_assignment.hpp"

namespace terrace::matching {
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

std::vector<Point2> some(std::size_t count, std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  std::vector<Point2> points(count);
  for (Point2& p : points) {
    for (double& c : p) c = static_cast<double>(random() >> 11) * 0x1p-53;
  }
  return points;
}

TEST(StopCheck, EndsExactMatchings) {
  const std::vector<Point2> points = some(4000);
  expect_stops(
      [&](const base::StopCheck& check) {
        PointMatchingOptions options;
        options.check_stop = check;
        match_points(points, options);
      },
      100);
  std::vector<WeightedEdge> edges;
  for (std::uint32_t i = 0; i < 400; ++i) {
    for (std::uint32_t j = i + 1; j < 400; ++j) {
      edges.push_back({i, j, std::hypot(points[i][0] - points[j][0], points[i][1] - points[j][1])});
    }
  }
  expect_stops(
      [&](const base::StopCheck& check) { min_weight_perfect_matching(400, edges, check); }, 20);
}

TEST(StopCheck, EndsMatchingsInWindowsBeforeTheFirstIsComplete) {
  const std::vector<Point2> points = some(6000);
  expect_stops(
      [&](const base::StopCheck& check) {
        match_large(points, {.exact_limit = 0, .window = 1000, .rounds = 2, .check_stop = check});
      },
      100);
  expect_stops([&](const base::StopCheck& check) { match_large(points, {.check_stop = check}); },
               100);
}

TEST(StopCheck, EndsAnIterationOfHalving) {
  std::vector<Point3> points;
  for (const Point2& p : some(1200)) points.push_back({p[0], p[1], 0});
  for (const Halving method : {Halving::monotone, Halving::monte_carlo}) {
    expect_stops(
        [&](const base::StopCheck& check) {
          static_cast<void>(
              match_by_halving(points, {.method = method, .iterations = 1, .check_stop = check}));
        },
        20);
  }
}

TEST(StopCheck, EndsAssignments) {
  const std::vector<Point2> rows = some(500), columns = some(500, 2);
  std::vector<double> costs;
  std::vector<CostEdge> edges;
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    for (std::uint32_t j = 0; j < columns.size(); ++j) {
      costs.push_back(std::hypot(rows[i][0] - columns[j][0], rows[i][1] - columns[j][1]));
      edges.push_back({i, j, costs.back()});
    }
  }
  expect_stops(
      [&](const base::StopCheck& check) { assign(costs, rows.size(), columns.size(), check); }, 10);
  const std::vector<float> singles(costs.begin(), costs.end());
  expect_stops(
      [&](const base::StopCheck& check) { assign(singles, rows.size(), columns.size(), check); },
      10);
  const std::vector<std::int32_t> numbers(costs.size(), 7);
  expect_stops(
      [&](const base::StopCheck& check) { assign(numbers, rows.size(), columns.size(), check); },
      2);
  expect_stops(
      [&](const base::StopCheck& check) {
        assign_sparse(edges, rows.size(), columns.size(), check);
      },
      10);
  expect_stops(
      [&](const base::StopCheck& check) { assign_points(some(3000), some(3000, 2), check); }, 10);
}

TEST(StopCheck, EndsTrees) {
  const std::vector<Point2> points = some(4000);
  std::vector<std::uint32_t> labels(points.size());
  for (std::uint32_t i = 0; i < labels.size(); ++i) labels[i] = i % 5;
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(make_matching_tree(points, {.check_stop = check}));
      },
      100);
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(make_matching_tree(points, {.labels = labels, .check_stop = check}));
      },
      100);
}

}  // namespace
}  // namespace terrace::matching
