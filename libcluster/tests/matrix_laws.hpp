// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "inputs.hpp"
#include "terrace/cluster/facility_location.hpp"

/// Small random problems with a cost matrix, their optimum by brute force, and checks of the
/// guarantees of every solution, independent of how it was found.

namespace terrace::cluster::laws {

struct MatrixProblem {
  std::string kind;
  std::size_t facilities = 0, clients = 0;
  std::vector<double> opening, connection;
  bool metric = false;  ///< connection costs obey the triangle inequality

  [[nodiscard]] FacilityMatrix matrix() const { return {facilities, clients, opening, connection}; }
  void scale(double factor) {
    for (double& c : opening) c *= factor;
    for (double& c : connection) c *= factor;
  }
};

/// Makes a random problem. Seeds select in turn: uniform costs, integers with many ties, points in
/// a square, points on a small grid with duplicates, sparse problems where most connections are
/// prohibitively expensive, and free facilities.
inline MatrixProblem random_problem(std::uint64_t seed, std::size_t max_facilities,
                                    std::size_t max_clients) {
  std::mt19937_64 random(seed);
  const auto uniform = [&random] { return inputs::uniform(random); };
  MatrixProblem p;
  p.facilities = 1 + random() % max_facilities;
  p.clients = 1 + random() % max_clients;
  p.connection.resize(p.facilities * p.clients);
  const double level = 0.02 + 2.0 * uniform();
  for (std::size_t j = 0; j < p.facilities; ++j) p.opening.push_back(level * (0.5 + uniform()));
  switch (seed % 6) {
    case 0:
      p.kind = "uniform";
      for (double& c : p.connection) c = uniform();
      break;
    case 1:
      p.kind = "whole";
      for (double& c : p.connection) c = std::floor(5 * uniform());
      for (double& c : p.opening) c = std::floor(4 * c);
      break;
    case 2:
    case 3: {
      p.kind = seed % 6 == 2 ? "square" : "grid";
      p.metric = true;
      std::vector<Point3> at(p.facilities + p.clients);
      for (Point3& q : at) {
        q = {uniform(), uniform(), 0};
        if (seed % 6 == 3) q = {std::floor(3 * q[0]), std::floor(3 * q[1]), 0};
      }
      for (std::size_t j = 0; j < p.facilities; ++j) {
        for (std::size_t i = 0; i < p.clients; ++i) {
          const Point3 &a = at[j], &b = at[p.facilities + i];
          p.connection[j * p.clients + i] = std::hypot(a[0] - b[0], a[1] - b[1]);
        }
      }
      break;
    }
    case 4:
      p.kind = "sparse";
      for (double& c : p.connection) c = uniform() < 0.3 ? uniform() : 1e6;
      break;
    default:
      p.kind = "free";
      for (double& c : p.connection) c = uniform();
      for (double& c : p.opening) c = uniform() < 0.5 ? 0.0 : c;
      break;
  }
  return p;
}

/// Returns the least cost over all sets of facilities, or over sets of exactly `count` if that is
/// not 0.
/// Requires: at most 16 facilities.
inline double optimum(const FacilityMatrix& problem, std::size_t count = 0) {
  double best = std::numeric_limits<double>::infinity();
  for (unsigned set = 1; set < (1u << problem.facilities); ++set) {
    double cost = 0.0;
    std::size_t open = 0;
    for (std::size_t j = 0; j < problem.facilities; ++j) {
      if (!((set >> j) & 1u)) continue;
      if (count == 0) cost += problem.opening[j];
      ++open;
    }
    if (count != 0 && open != count) continue;
    for (std::size_t i = 0; i < problem.clients && cost < best; ++i) {
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < problem.facilities; ++j) {
        if ((set >> j) & 1u) least = std::min(least, problem.cost(j, i));
      }
      cost += least;
    }
    best = std::min(best, cost);
  }
  return best;
}

/// Checks the structure, recomputed costs, and that every client is at a cheapest open facility.
/// `pays` is whether opening costs count. In a k-median problem they do not, and facilities may
/// have no clients.
inline void expect_solution(const FacilityMatrix& problem, const FacilitySolution& solution,
                            bool pays = true) {
  ASSERT_FALSE(solution.facilities.empty());
  ASSERT_EQ(solution.assignment.size(), problem.clients);
  double opening = 0.0, connection = 0.0;
  for (std::size_t k = 0; k < solution.facilities.size(); ++k) {
    ASSERT_LT(solution.facilities[k], problem.facilities);
    if (k > 0) {
      ASSERT_LT(solution.facilities[k - 1], solution.facilities[k]);
    }
    opening += pays ? problem.opening[solution.facilities[k]] : 0.0;
  }
  std::vector<bool> used(solution.facilities.size(), false);
  for (std::size_t i = 0; i < problem.clients; ++i) {
    ASSERT_LT(solution.assignment[i], solution.facilities.size());
    used[solution.assignment[i]] = true;
    const double own = problem.cost(solution.facilities[solution.assignment[i]], i);
    for (const std::uint32_t j : solution.facilities) ASSERT_LE(own, problem.cost(j, i));
    connection += own;
  }
  if (pays) {
    EXPECT_EQ(std::count(used.begin(), used.end(), false), 0) << "a facility has no clients";
  }
  EXPECT_NEAR(solution.opening_cost, opening, 1e-12 * opening);
  EXPECT_NEAR(solution.connection_cost, connection, 1e-12 * connection);
  EXPECT_EQ(solution.outlier_cost, 0.0);
}

inline bool same(const FacilitySolution& a, const FacilitySolution& b) {
  return a.facilities == b.facilities && a.assignment == b.assignment &&
         a.opening_cost == b.opening_cost && a.connection_cost == b.connection_cost &&
         a.lower_bound == b.lower_bound;
}

}  // namespace terrace::cluster::laws
