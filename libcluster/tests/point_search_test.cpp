// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "facility/points/local_search.hpp"
#include "facility/points/search_frame.hpp"
#include "inputs.hpp"
#include "search_laws.hpp"

namespace terrace::cluster {
namespace {

using inputs::kInfinity;
using laws::OwnedProblem;

constexpr FacilityStrategy kSearches[] = {FacilityStrategy::full_scan, FacilityStrategy::quadtree,
                                          FacilityStrategy::octree, FacilityStrategy::kd_tree,
                                          FacilityStrategy::facilities};

bool admits(const OwnedProblem& p, FacilityStrategy strategy) {
  if (strategy == FacilityStrategy::full_scan) return true;
  if (strategy == FacilityStrategy::facilities) {
    return linear_map(p.metric, base::box_of(p.points)) ||
           (is_symmetric(p.metric) && obeys_triangle_inequality(p.metric));
  }
  return !std::holds_alternative<CustomMetric>(p.metric);
}

// Returns every metric with every input, and with weights, channels and outliers in turn.
std::vector<OwnedProblem> all_problems(std::size_t count) {
  std::vector<OwnedProblem> all;
  std::mt19937_64 random(77);
  unsigned turn = 0;
  for (const Metric& metric : laws::metrics()) {
    for (OwnedProblem& p : laws::problems(count, 5)) {
      for (unsigned variant = 0; variant < 2; ++variant, ++turn) {
        OwnedProblem& q = all.emplace_back(p);
        q.metric = metric;
        q.facility_cost = turn % 3 == 0 ? 0.1 : 0.6;
        if (turn % 2 == 1) laws::add_weights(q, random);
        if (turn % 3 == 1) laws::add_channels(q, random);
        if (turn % 5 < 2) q.outlier_price = 0.15;
        q.name = name_of(metric) + ", " + p.name + ", turn " + std::to_string(turn);
      }
    }
  }
  return all;
}

void expect_same(const FacilitySolution& a, const FacilitySolution& b) {
  EXPECT_EQ(a.facilities, b.facilities);
  EXPECT_EQ(a.assignment, b.assignment);
  EXPECT_EQ(a.cost(), b.cost());
}

TEST(PointSearch, GainEqualsTheSavingInEveryStrategy) {
  for (const OwnedProblem& p : all_problems(60)) {
    SCOPED_TRACE(p.name);
    std::vector<std::unique_ptr<SearchEngine>> searches;
    for (const FacilityStrategy strategy : kSearches) {
      if (admits(p, strategy)) searches.push_back(make_search(p.view(), strategy));
    }
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      SCOPED_TRACE(testing::Message() << "seed " << seed);
      for (const auto& search : searches) {
        std::mt19937_64 random(seed);
        search->start(random);
      }
      std::mt19937_64 random(seed);
      for (int step = 0; step < 25; ++step) {
        const auto candidate = static_cast<std::uint32_t>(random() % p.points.size());
        const FacilitySolution before = searches[0]->solution();
        const double gain = searches[0]->gain(candidate);
        for (const auto& search : searches) {
          ASSERT_EQ(search->gain(candidate), gain);  // equal to the last bit
        }
        // Also opens candidates that raise the cost, because the gain must be right whatever its
        // sign.
        if (gain <= 0 && step % 3 != 0) continue;
        for (const auto& search : searches) search->open(candidate);
        const FacilitySolution after = searches[0]->solution();
        ASSERT_NEAR(before.cost() - after.cost(), gain, 1e-9 * before.cost());
        ASSERT_NEAR(searches[0]->cost(), after.cost(), 1e-9 * before.cost());
        ASSERT_NO_FATAL_FAILURE(laws::expect_solution(p, after));
        for (const auto& search : searches) {
          ASSERT_NO_FATAL_FAILURE(expect_same(search->solution(), after));
        }
      }
    }
  }
}

TEST(PointSearch, WholeSearchesAgree) {
  for (const OwnedProblem& p : all_problems(120)) {
    SCOPED_TRACE(p.name);
    const FacilityPoints view = p.view();
    for (const std::size_t batch : {1u, 4u}) {
      FacilityOptions options;
      options.strategy = FacilityStrategy::full_scan;
      options.effort = Effort::fine;
      options.batch = batch;
      FacilityReport full_report;
      const FacilitySolution expected = solve(view, options, &full_report);
      ASSERT_NO_FATAL_FAILURE(laws::expect_solution(p, expected));
      const SearchStatistics& full = full_report.search;
      EXPECT_EQ(full.inspected, full.candidates * p.points.size());
      for (const FacilityStrategy strategy : kSearches) {
        options.strategy = strategy;
        if (!admits(p, strategy)) {
          EXPECT_THROW((void)solve(view, options), std::invalid_argument);
          continue;
        }
        SCOPED_TRACE(name_of(strategy));
        FacilityReport report;
        expect_same(solve(view, options, &report), expected);
        const SearchStatistics& statistics = report.search;
        EXPECT_EQ(statistics.positive, full.positive);
        EXPECT_EQ(statistics.opened, full.opened);
        EXPECT_EQ(statistics.wrongly_assigned, full.wrongly_assigned);
      }
      options.strategy = FacilityStrategy::automatic;
      options.threads = 3;
      expect_same(solve(view, options), expected);
    }
  }
}

TEST(PointSearch, ThreadsDoNotChangeTheSolution) {
  std::mt19937_64 random(11);
  OwnedProblem p;
  p.points = inputs::cube(1500, random);
  p.outlier_price = 0.2;
  laws::add_weights(p, random);
  for (const std::size_t batch : {1u, 7u}) {
    for (const FacilityStrategy strategy : kSearches) {
      SCOPED_TRACE(testing::Message() << name_of(strategy) << ", batch " << batch);
      FacilityOptions options;
      options.strategy = strategy;
      options.steps = 300;
      options.batch = batch;
      const FacilitySolution one = solve(p.view(), options);
      for (const unsigned threads : {2u, 5u}) {
        options.threads = threads;
        expect_same(solve(p.view(), options), one);
      }
    }
  }
}

TEST(PointSearch, BatchAppliesTheGreatestGainAlone) {
  std::mt19937_64 points_random(3);
  OwnedProblem p;
  p.points = inputs::cube(400, points_random);
  constexpr std::size_t kBatch = 5;
  const auto search = make_search(p.view());
  const auto by_hand = make_search(p.view());
  std::mt19937_64 random(9), same(9);
  search->start(random);
  by_hand->start(same);
  search->improve(200, random, kBatch);
  std::size_t discarded = 0;
  for (std::size_t done = 0; done < 200;) {
    const std::size_t now = std::min(kBatch, 200 - done);
    std::size_t positive = 0;
    double best = 0.0;
    std::uint32_t chosen = 0;
    for (std::size_t k = 0; k < now; ++k) {
      const auto candidate = static_cast<std::uint32_t>(((same() >> 32) * 400) >> 32);
      const double gain = by_hand->gain(candidate);
      positive += gain > 0 ? 1u : 0u;
      if (gain > best) {
        best = gain;
        chosen = candidate;
      }
    }
    if (positive > 0) by_hand->open(chosen);
    done += now - (positive > 1 ? positive - 1 : 0);
    discarded += positive > 1 ? positive - 1 : 0;
  }
  expect_same(search->solution(), by_hand->solution());
  EXPECT_GT(discarded, 0u);
  EXPECT_EQ(search->statistics().candidates, 200 + discarded);
  EXPECT_EQ(search->statistics().positive, search->statistics().opened + discarded);
}

TEST(PointSearch, NeverBeatsTheOptimumAndComesNear) {
  double ratios = 0.0;
  int metric_problems = 0;
  std::mt19937_64 random(21);
  for (const Metric& metric : laws::metrics()) {
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      OwnedProblem p;
      p.metric = metric;
      p.points = inputs::cube(1 + seed, random);
      if (seed % 2 == 0) laws::add_weights(p, random);
      if (seed % 3 == 0) laws::add_channels(p, random);
      if (seed % 4 == 0) p.outlier_price = 0.3;
      p.facility_cost = 0.1 + 0.3 * inputs::uniform(random);
      SCOPED_TRACE(name_of(metric) + ", seed " + std::to_string(seed));
      FacilityOptions options;
      options.steps = 40;
      options.seed = seed;
      options.assign_nearest = true;
      const FacilitySolution found = solve(p.view(), options);
      const double best = laws::optimum(p);
      ASSERT_GE(found.cost(), best * (1 - 1e-9));
      if (best == 0.0) continue;
      ratios += found.cost() / best;
      ++metric_problems;
    }
  }
  EXPECT_LE(ratios / metric_problems, 1.05);
}

// Figure 7.3: there are four clusters. The block contains three, and one point of the fourth.
TEST(PointSearch, LeavesOutTheSingleOutlier) {
  std::mt19937_64 random(4);
  OwnedProblem p;
  const Point3 centres[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (std::size_t i = 0; i < 600; ++i) {
    const Point3& c = centres[i % 3];
    p.points.push_back(
        {c[0] + 0.015 * inputs::bell(random), c[1] + 0.015 * inputs::bell(random), 0});
  }
  p.points.push_back({1.0, 1.0, 0.0});
  p.facility_cost = 1.0;
  const double s = std::sqrt(0.5);
  const auto uphill = [](const Point3& f, const Point3& c) {
    return std::hypot(c[0] - f[0], c[1] - f[1]) + 0.2 * std::max(0.0, c[1] - f[1]);
  };
  for (const Metric& metric :
       {Metric(Euclidean{}), Metric(Elliptical({1.5, 1.0, 1.0}, {s, s, 0, -s, s, 0, 0, 0, 1})),
        Metric(EllipticalField({{{{-9, -9, -9}, {0.5, 0.5, 9}}, Elliptical(1.2, 0.9, 20.0)}})),
        Metric(CustomMetric{uphill, false, true})}) {
    SCOPED_TRACE(name_of(metric));
    p.metric = metric;
    p.outlier_price = kInfinity;
    FacilityOptions options;
    options.effort = Effort::fine;
    const FacilitySolution connected = solve(p.view(), options);
    EXPECT_EQ(connected.facilities.size(), 3u);
    EXPECT_NE(connected.assignment.back(), kOutlier);
    EXPECT_EQ(connected.outlier_cost, 0.0);
    p.outlier_price = 0.3;
    const FacilitySolution left_out = solve(p.view(), options);
    EXPECT_EQ(left_out.facilities.size(), 3u);
    EXPECT_EQ(std::count(left_out.assignment.begin(), left_out.assignment.end(), kOutlier), 1);
    EXPECT_EQ(left_out.assignment.back(), kOutlier);
    EXPECT_LT(left_out.cost(), connected.cost());
    laws::expect_solution(p, left_out);
  }
}

TEST(PointSearch, LeavesOutAllButAFacility) {
  std::mt19937_64 random(4);
  OwnedProblem p;
  p.points = inputs::cube(50, random);
  p.facility_cost = 10.0;
  p.outlier_price = 1e-6;
  const FacilitySolution solution = solve(p.view(), {.effort = Effort::full});
  EXPECT_EQ(solution.facilities.size(), 1u);
  EXPECT_EQ(std::count(solution.assignment.begin(), solution.assignment.end(), kOutlier), 49);
  laws::expect_solution(p, solution);
}

TEST(PointSearch, DoesNotDependOnScaleAndOffset) {
  std::mt19937_64 random(8);
  OwnedProblem p;
  p.points = inputs::cube(150, random);
  for (Point3& q : p.points) {
    for (double& x : q) x = std::floor(x * 0x1p20) * 0x1p-20;
  }
  laws::add_channels(p, random);
  for (const Metric& metric :
       {Metric(Euclidean{}), Metric(Elliptical(2.0, 0.5, 90.0)), Metric(Minkowski{1.0}),
        Metric(Minkowski{4.0}), Metric(Elliptical(0x1p700, 0x1p690, 0.0)),
        Metric(Elliptical(0x1p-1015, 0x1p-1020, 45.0, 0x1p-1018))}) {
    SCOPED_TRACE(name_of(metric));
    OwnedProblem plain = p;
    plain.metric = metric;
    const FacilitySolution expected = solve(plain.view());
    for (const int exponent : {-1000, -990, 40, 900, 1022}) {
      SCOPED_TRACE(exponent);
      OwnedProblem q = plain;
      for (Point3& point : q.points) {
        for (double& x : point) x = std::ldexp(x, exponent);
      }
      for (double& x : q.channel_weights) x = std::ldexp(x, exponent);
      for (const FacilityStrategy strategy :
           {FacilityStrategy::full_scan, FacilityStrategy::kd_tree}) {
        const FacilitySolution solution = solve(q.view(), {.strategy = strategy});
        EXPECT_EQ(solution.facilities, expected.facilities);
        EXPECT_EQ(solution.assignment, expected.assignment);
      }
    }
    OwnedProblem heavy = plain;
    heavy.weights.assign(p.points.size(), 1e300);
    heavy.facility_cost = plain.facility_cost * 1e300;
    EXPECT_EQ(solve(heavy.view()).facilities, expected.facilities);
  }
  // Squares of 1e300 overflow a double. The search is still correct, but its costs are infinite.
  OwnedProblem squares = p;
  squares.metric = SquaredEuclidean{};
  squares.channel_weights.clear();
  squares.values.clear();
  const FacilitySolution expected = solve(squares.view());
  for (Point3& q : squares.points) {
    for (double& x : q) x *= 0x1p1000;
  }
  const FacilitySolution solution = solve(squares.view());
  EXPECT_EQ(solution.assignment, expected.assignment);
  EXPECT_EQ(solution.cost(), kInfinity);
}

TEST(PointSearch, ChannelsSeparateCoincidentPoints) {
  std::mt19937_64 random(6);
  OwnedProblem p;
  p.points.assign(200, Point3{1, 2, 3});
  p.channel_weights = {2.0};
  for (std::size_t i = 0; i < 200; ++i) {
    p.values.push_back((i % 2 == 0 ? 0.0 : 100.0) + inputs::uniform(random));
  }
  p.facility_cost = 1.0;
  const FacilitySolution solution = solve(p.view(), {.effort = Effort::fine});
  ASSERT_EQ(solution.facilities.size(), 2u);
  for (std::size_t i = 2; i < 200; ++i) {
    EXPECT_EQ(solution.assignment[i], solution.assignment[i % 2]);
  }
  laws::expect_solution(p, solution);
}

TEST(PointSearch, StartsFromAGivenSolution) {
  std::mt19937_64 random(12);
  OwnedProblem p;
  p.points = inputs::cube(300, random);
  const FacilitySolution first = solve(p.view());
  FacilityOptions options;
  options.steps = 0;
  options.start = &first;
  expect_same(solve(p.view(), options), first);
  options.steps = 500;
  EXPECT_LT(solve(p.view(), options).cost(), first.cost());

  FacilitySolution bad = first;
  bad.assignment.pop_back();
  options.start = &bad;
  EXPECT_THROW((void)solve(p.view(), options), std::invalid_argument);
  bad = first;
  bad.assignment[7] = 4000;
  EXPECT_THROW((void)solve(p.view(), options), std::invalid_argument);
  bad.assignment[7] = kOutlier;
  EXPECT_THROW((void)solve(p.view(), options), std::invalid_argument);
  bad = first;
  bad.facilities[0] = 300;
  EXPECT_THROW((void)solve(p.view(), options), std::invalid_argument);
  bad.facilities.clear();
  EXPECT_THROW((void)solve(p.view(), options), std::invalid_argument);
}

TEST(PointSearch, AssignNearestLeavesNoClientWronglyAssigned) {
  for (const OwnedProblem& p : all_problems(100)) {
    SCOPED_TRACE(p.name);
    std::mt19937_64 random(2);
    const auto search = make_search(p.view());
    search->start(random);
    search->improve(10, random);
    const double before = search->cost();
    const std::size_t wrong = search->wrongly_assigned();
    search->assign_nearest();
    EXPECT_EQ(search->wrongly_assigned(), 0u);
    EXPECT_LE(search->cost(), before * (1 + 1e-12));
    if (wrong > 0) {
      EXPECT_LT(search->cost(), before);
    }
    ASSERT_NO_FATAL_FAILURE(laws::expect_solution(p, search->solution()));
  }
}

TEST(PointSearch, ReportsProgressAndStops) {
  std::mt19937_64 random(12);
  OwnedProblem p;
  p.points = inputs::cube(500, random);
  std::size_t last = 0, calls = 0;
  FacilityOptions options;
  options.steps = 1000;
  options.progress = [&](std::size_t done, std::size_t total) {
    EXPECT_EQ(total, 1000u);
    EXPECT_GE(done, last);
    last = done;
    ++calls;
    return true;
  };
  const FacilitySolution complete = solve(p.view(), options);
  EXPECT_EQ(last, 1000u);
  EXPECT_GT(calls, 100u);
  options.progress = [](std::size_t done, std::size_t) { return done < 100; };
  FacilityReport report;
  const FacilitySolution part = solve(p.view(), options, &report);
  EXPECT_LT(report.search.candidates, 120u);
  EXPECT_GT(part.cost(), complete.cost());
  laws::expect_solution(p, part);
}

TEST(PointSearch, ReportsWhyAStrategyIsNotAdmitted) {
  OwnedProblem p;
  p.points = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  const auto message = [&](FacilityStrategy strategy) -> std::string {
    try {
      (void)solve(p.view(), {.strategy = strategy});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  p.metric = SquaredEuclidean{};
  EXPECT_NE(message(FacilityStrategy::facilities).find("\"squared\""), std::string::npos);
  EXPECT_NE(message(FacilityStrategy::facilities).find("kd_tree"), std::string::npos);
  EXPECT_EQ(message(FacilityStrategy::kd_tree), "");
  p.metric = CustomMetric{[](const Point3&, const Point3&) { return 0.0; }};
  EXPECT_NE(message(FacilityStrategy::octree).find("\"custom\""), std::string::npos);
  EXPECT_NE(message(FacilityStrategy::facilities).find("\"custom\""), std::string::npos);
  EXPECT_EQ(message(FacilityStrategy::automatic), "");
  p.metric = CustomMetric{[](const Point3& a, const Point3& b) { return a[1] - b[1]; }};
  EXPECT_NE(message(FacilityStrategy::automatic).find("distance from facility"), std::string::npos);
  p.metric = Euclidean{};
  EXPECT_THROW((void)solve(p.view(), {.batch = 0}), std::invalid_argument);
  p.points.clear();
  EXPECT_THROW((void)solve(p.view()), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::cluster
