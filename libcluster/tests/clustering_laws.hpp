// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"

/// Checks of the guarantees of every clustering of a block, independent of how it was found.

namespace terrace::cluster::laws {

/// Nearest facilities are found in single precision relative to the block's box. A facility may be
/// this much farther than another, in diagonals, and still count as the nearer one.
inline constexpr double kFloatSlack = 1e-6;

/// Allowed because denormal lengths have few digits.
inline constexpr double kDenormalSlack = 1e-319;

/// Returns the distance without overflow or underflow.
inline double distance(const Point3& a, const Point3& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

inline double diagonal(std::span<const Point3> points) {
  Point3 low = points.front();
  Point3 high = low;
  for (const Point3& p : points) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  return distance(low, high);
}

inline double weight(std::span<const double> weights, std::size_t i) {
  return weights.empty() ? 1.0 : weights[i];
}

/// Checks the structure, recomputed costs, and that every point is at its nearest facility. `slack`
/// is the tolerance of the last check, in diagonals.
inline void expect_valid(std::span<const Point3> points, std::span<const double> weights,
                         const BlockOptions& options, const BlockClustering& clustering,
                         double slack) {
  ASSERT_EQ(clustering.assignment.size(), points.size());
  if (points.empty()) {
    EXPECT_TRUE(clustering.facilities.empty());
    return;
  }
  ASSERT_FALSE(clustering.facilities.empty());
  const std::set<std::uint32_t> distinct(clustering.facilities.begin(),
                                         clustering.facilities.end());
  ASSERT_EQ(distinct.size(), clustering.facilities.size()) << "a facility is listed twice";
  ASSERT_LT(*distinct.rbegin(), points.size());
  for (std::size_t c = 0; c < clustering.facilities.size(); ++c) {
    ASSERT_EQ(clustering.assignment[clustering.facilities[c]], c) << "facility outside its cluster";
  }
  const double diameter = diagonal(points);
  double connections = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_LT(clustering.assignment[i], clustering.facilities.size());
    const double own = distance(points[i], points[clustering.facilities[clustering.assignment[i]]]);
    connections += weight(weights, i) * own;
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::uint32_t f : clustering.facilities) {
      nearest = std::min(nearest, distance(points[i], points[f]));
    }
    ASSERT_LE(own, nearest + slack * diameter + kDenormalSlack) << "point " << i;
  }
  const double fc = options.facility_cost * diameter;
  EXPECT_NEAR(clustering.facility_cost, fc, 1e-9 * fc + kDenormalSlack);
  EXPECT_NEAR(clustering.connection_cost, connections, 1e-9 * connections + kDenormalSlack);
  EXPECT_TRUE(std::isfinite(clustering.cost()));
}

/// Returns the least cost over all sets of facilities. Requires: at most 12 points.
inline double optimum(std::span<const Point3> points, std::span<const double> weights,
                      double facility_cost) {
  double best = std::numeric_limits<double>::infinity();
  const double fc = facility_cost * diagonal(points);
  for (unsigned set = 1; set < (1u << points.size()); ++set) {
    double cost = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if ((set >> i) & 1u) cost += fc;
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < points.size(); ++j) {
        if ((set >> j) & 1u) nearest = std::min(nearest, distance(points[i], points[j]));
      }
      cost += weight(weights, i) * nearest;
    }
    best = std::min(best, cost);
  }
  return best;
}

/// Runs the textbook search, with whose costs others are compared. It evaluates every candidate by
/// a scan of all points.
inline FacilitySolution textbook_search(std::span<const Point3> points, double facility_cost,
                                        Effort effort, std::uint64_t seed) {
  return solve(FacilityPoints{.points = points, .facility_cost = facility_cost},
               {.strategy = FacilityStrategy::full_scan, .effort = effort, .seed = seed});
}

}  // namespace terrace::cluster::laws
