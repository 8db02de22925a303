// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "inputs.hpp"
#include "terrace/cluster/facility_location.hpp"

/// Independent checks of facility location of points: costs from the definitions, in the points'
/// own coordinates, and the least cost over all solutions.

namespace terrace::cluster::laws {

/// A problem that owns its data.
struct OwnedProblem {
  std::string name;
  std::vector<Point3> points;
  std::vector<double> weights, values, channel_weights;
  Metric metric = Euclidean{};
  double facility_cost = 0.5;
  double outlier_price = std::numeric_limits<double>::infinity();

  [[nodiscard]] FacilityPoints view() const {
    return {points, weights, metric, {values, channel_weights}, facility_cost, outlier_price};
  }
};

/// Returns the distance including channels, as defined in metric.hpp.
inline double full_distance(const OwnedProblem& p, std::uint32_t facility, std::uint32_t client) {
  const double d = distance(p.metric, p.points[facility], p.points[client]);
  const std::size_t count = p.channel_weights.size();
  if (count == 0) return d;
  double power = 2.0;
  if (const auto* minkowski = std::get_if<Minkowski>(&p.metric)) power = minkowski->p;
  const bool squared = std::holds_alternative<SquaredEuclidean>(p.metric);
  double sum = std::isinf(power) ? d : squared ? d : std::pow(d, power);
  for (std::size_t c = 0; c < count; ++c) {
    const double v = p.channel_weights[c] *
                     std::abs(p.values[facility * count + c] - p.values[client * count + c]);
    sum = std::isinf(power) ? std::max(sum, v) : sum + std::pow(v, power);
  }
  return squared || std::isinf(power) ? sum : std::pow(sum, 1.0 / power);
}

/// Returns the factor of facility_cost and outlier_price.
inline double full_diagonal(const OwnedProblem& p) {
  OwnedProblem box;
  box.metric = p.metric;
  box.channel_weights = p.channel_weights;
  box.points = {{}, {}};
  // Combines the ranges of the channels with a coordinate as long as the diagonal in the metric.
  const double d = diagonal(p.metric, base::box_of(p.points));
  const std::size_t count = p.channel_weights.size();
  if (count == 0) return d;
  std::vector<double> low(count, 1e308), high(count, -1e308);
  for (std::size_t k = 0; k < p.values.size(); ++k) {
    low[k % count] = std::min(low[k % count], p.values[k]);
    high[k % count] = std::max(high[k % count], p.values[k]);
  }
  box.values = low;
  box.values.insert(box.values.end(), high.begin(), high.end());
  if (!std::holds_alternative<SquaredEuclidean>(p.metric) &&
      !std::holds_alternative<Minkowski>(p.metric)) {
    box.metric = Euclidean{};
  }
  box.points[1][0] = std::holds_alternative<SquaredEuclidean>(p.metric) ? std::sqrt(d) : d;
  return full_distance(box, 0, 1);
}

/// Returns the price of leaving out a client of weight 1, infinite if outliers are not allowed.
inline double outlier_price(const OwnedProblem& p) {
  return std::isinf(p.outlier_price) ? p.outlier_price : p.outlier_price * full_diagonal(p);
}

/// Checks the structure, and the three costs against their definitions.
inline void expect_solution(const OwnedProblem& p, const FacilitySolution& s, double slack = 1e-9) {
  ASSERT_EQ(s.assignment.size(), p.points.size());
  ASSERT_FALSE(s.facilities.empty());
  ASSERT_TRUE(std::is_sorted(s.facilities.begin(), s.facilities.end()));
  const double unit = full_diagonal(p);
  const double price = outlier_price(p);
  double connections = 0.0, prices = 0.0;
  for (std::uint32_t c = 0; c < s.facilities.size(); ++c) {
    ASSERT_LT(s.facilities[c], p.points.size());
    ASSERT_EQ(s.assignment[s.facilities[c]], c) << "a facility is not in its cluster";
  }
  for (std::uint32_t i = 0; i < s.assignment.size(); ++i) {
    const double w = p.weights.empty() ? 1.0 : p.weights[i];
    if (s.assignment[i] == kOutlier) {
      prices += w * price;
      continue;
    }
    ASSERT_LT(s.assignment[i], s.facilities.size());
    const double d = full_distance(p, s.facilities[s.assignment[i]], i);
    EXPECT_LE(d, price * (1 + 1e-9)) << "this client is connected above the price: " << i;
    connections += w * d;
  }
  const double opening = static_cast<double>(s.facilities.size()) * p.facility_cost * unit;
  const double tolerance = slack * (opening + connections + prices);
  EXPECT_NEAR(s.opening_cost, opening, tolerance);
  EXPECT_NEAR(s.connection_cost, connections, tolerance);
  EXPECT_NEAR(s.outlier_cost, prices, tolerance);
}

/// Returns the least cost of all solutions with a facility. Requires: at most 12 points.
inline double optimum(const OwnedProblem& p) {
  const double unit = full_diagonal(p);
  const auto n = static_cast<std::uint32_t>(p.points.size());
  double best = std::numeric_limits<double>::infinity();
  for (unsigned set = 1; set < (1u << n); ++set) {
    double cost = 0.0;
    for (std::uint32_t i = 0; i < n; ++i) {
      double least = outlier_price(p);
      for (std::uint32_t j = 0; j < n; ++j) {
        if ((set >> j) & 1u) least = std::min(least, full_distance(p, j, i));
      }
      cost += (p.weights.empty() ? 1.0 : p.weights[i]) * least;
      if ((set >> i) & 1u) cost += p.facility_cost * unit;
    }
    best = std::min(best, cost);
  }
  return best;
}

inline std::vector<Metric> metrics() {
  using inputs::kInfinity;
  const double s = std::sqrt(0.5);
  const auto taxi_in_x = [](const Point3& a, const Point3& b) {
    return 2 * std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
  };
  const auto uphill = [](const Point3& f, const Point3& c) {
    return std::hypot(c[0] - f[0], c[1] - f[1], c[2] - f[2]) + 0.5 * std::max(0.0, c[1] - f[1]);
  };
  return {
      Euclidean{},
      SquaredEuclidean{},
      Minkowski{1.0},
      Minkowski{3.0},
      Minkowski{kInfinity},
      Minkowski{0.5},
      Elliptical(2.0, 0.25, 30.0),
      Elliptical({3.0, 0.5, 2.0}, {s, s, 0, -s, s, 0, 0, 0, 1}),
      EllipticalField(
          {{{{-kInfinity, -kInfinity, -kInfinity}, {0.5, 0.4, kInfinity}}, {4.0, 0.5, 70.0}},
           {{{0.5, 0.4, -1.0}, {1.0, 1.0, 1.0}}, {0.3, 1.5, 10.0}}}),
      EllipticalField({{{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}},
                        {4.0, 0.5, 70.0}}}),
      CustomMetric{taxi_in_x, true, true},
      CustomMetric{uphill, false, true}};
}

/// Returns point sets in about the unit cube, including degenerate ones.
inline std::vector<OwnedProblem> problems(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<OwnedProblem> sets;
  const auto add = [&](const char* name, std::vector<Point3> points) {
    OwnedProblem& p = sets.emplace_back();
    p.name = name;
    p.points = std::move(points);
  };
  std::vector<Point3> points = inputs::cube(count, random);
  add("cube", points);
  for (Point3& p : points) p[2] = 0.0;
  add("square", points);
  for (Point3& p : points) {
    for (double& x : p) x = std::floor(4 * x) / 4;
  }
  add("grid with ties", points);
  for (Point3& p : points) {
    const double t = inputs::uniform(random);
    p = {t, 0.5 * t, 1 - t};
  }
  add("collinear", points);
  points.assign(count, {0.25, 0.5, 0.125});
  add("all equal", points);
  points.resize(1);
  add("one point", points);
  return sets;
}

inline void add_weights(OwnedProblem& p, std::mt19937_64& random) {
  p.weights.clear();
  for (std::size_t i = 0; i < p.points.size(); ++i) {
    p.weights.push_back(0.01 + 3 * inputs::uniform(random) * inputs::uniform(random));
  }
}

inline void add_channels(OwnedProblem& p, std::mt19937_64& random) {
  p.channel_weights = {0.4, 0.0, 0.05};
  p.values.clear();
  for (std::size_t k = 0; k < 3 * p.points.size(); ++k) {
    p.values.push_back(std::floor(4 * inputs::uniform(random)));
  }
}

}  // namespace terrace::cluster::laws
