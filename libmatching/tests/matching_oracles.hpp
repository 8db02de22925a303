// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "terrace/matching/point_matching.hpp"

namespace terrace::matching::oracles {

inline double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// Returns the least weight of a perfect matching by dynamic programming over subsets: the lowest
/// vertex of each set is paired with every other. Returns infinity if there is no perfect matching.
/// weight: n x n, infinite for absent edges.
inline double subset_optimum(const std::vector<double>& weight, std::size_t n) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<double> best(std::size_t{1} << n, kNever);
  best[0] = 0.0;
  for (std::size_t set = 1; set < best.size(); ++set) {
    std::size_t i = 0;
    while ((set >> i & 1) == 0) ++i;
    for (std::size_t j = i + 1; j < n; ++j) {
      if ((set >> j & 1) == 0) continue;
      best[set] = std::min(
          best[set], best[set & ~(std::size_t{1} << i | std::size_t{1} << j)] + weight[i * n + j]);
    }
  }
  return best.back();
}

template <std::size_t D>
double distance(const std::array<double, D>& a, const std::array<double, D>& b) {
  double sum = 0.0;
  for (std::size_t d = 0; d < D; ++d) sum += (a[d] - b[d]) * (a[d] - b[d]);
  return std::sqrt(sum);
}

/// Returns all pairs of points with their distances. If n is odd, an extra vertex has edges of cost
/// 0 to all points.
template <std::size_t D>
std::vector<WeightedEdge> complete_graph(const std::vector<std::array<double, D>>& points) {
  std::vector<WeightedEdge> edges;
  const auto n = static_cast<std::uint32_t>(points.size());
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = i + 1; j < n; ++j) {
      edges.push_back({i, j, distance(points[i], points[j])});
    }
    if (n % 2 != 0) edges.push_back({i, n, 0.0});
  }
  return edges;
}

/// Returns the least cost of matching at most 17 points, with one point left over if n is odd.
template <std::size_t D>
double point_optimum(const std::vector<std::array<double, D>>& points) {
  const std::size_t n = points.size() + points.size() % 2;
  std::vector<double> weight(n * n, std::numeric_limits<double>::infinity());
  for (const WeightedEdge& e : complete_graph(points)) {
    weight[e.i * n + e.j] = weight[e.j * n + e.i] = e.weight;
  }
  return subset_optimum(weight, n);
}

}  // namespace terrace::matching::oracles
