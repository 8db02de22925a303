// SPDX-License-Identifier: Apache-2.0
// Compares matchings of small graphs, and of small point sets with many ties, with dynamic
// programming over subsets.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <vector>

#include "../tests/matching_oracles.hpp"
#include "terrace/matching/matching.hpp"
#include "terrace/matching/point_matching.hpp"

namespace {

using namespace terrace::matching;

void check_graph(std::size_t n, const std::vector<IntegerEdge>& edges) {
  std::vector<double> weight(n * n, std::numeric_limits<double>::infinity());
  for (const IntegerEdge& e : edges) {
    double& w = weight[e.i * n + e.j];
    w = weight[e.j * n + e.i] = std::min(w, static_cast<double>(e.weight));
  }
  const double optimum = oracles::subset_optimum(weight, n);
  try {
    const Matching m = min_weight_perfect_matching(n, edges);
    if (m.cost != optimum || !matching_error(m, edges).empty()) std::abort();
  } catch (const std::invalid_argument&) {
    if (!std::isinf(optimum)) std::abort();
  }
}

void check_points(const std::vector<Point2>& points, std::uint32_t neighbours) {
  PointMatchingOptions options;
  options.neighbours = neighbours;
  const PointMatching m = match_points(points, options);
  if (std::abs(m.cost - oracles::point_optimum(points)) > 1e-9) std::abort();
  if (!matching_error(m.proof, oracles::complete_graph(points)).empty()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  if (data[0] % 2 == 0) {
    std::vector<Point2> points;
    for (std::size_t k = 2; k < size && points.size() < 13; ++k) {
      points.push_back({static_cast<double>(data[k] % 16), static_cast<double>(data[k] / 16)});
    }
    check_points(points, 1 + data[1] % 4);
    return 0;
  }
  const auto n = static_cast<std::uint32_t>(2 * (1 + data[1] % 6));
  std::vector<IntegerEdge> edges;
  for (std::size_t k = 2; k + 1 < size; k += 2) {
    const std::uint32_t i = data[k] % n, j = data[k] / 16 % n;
    if (i != j) edges.push_back({i, j, static_cast<std::int64_t>(data[k + 1] % 13) - 3});
  }
  check_graph(n, edges);
  return 0;
}
