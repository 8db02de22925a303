// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/local_search.hpp"

#include <algorithm>
#include <utility>

#include "terrace/cluster/point_search.hpp"

namespace terrace::cluster {
namespace {

std::size_t ceil_log(std::size_t value, std::size_t base) {
  std::size_t exponent = 0;
  for (std::size_t power = 1; power < value; ++exponent) {
    if (power > value / base) return exponent + 1;
    power *= base;
  }
  return exponent;
}

}  // namespace

std::size_t candidate_count(SearchLength length, std::size_t points) {
  switch (length) {
    case SearchLength::tenth:
      return std::max<std::size_t>(points / 10, points > 0 ? 1 : 0);
    case SearchLength::log10_full:
      return points * std::max<std::size_t>(ceil_log(points, 10), 1);
    case SearchLength::log2_full:
      break;
  }
  return points * std::max<std::size_t>(ceil_log(points, 2), 1);
}

void local_search(std::span<const Point3> points, std::span<const double> weights,
                  double facility_cost, SearchLength length, std::uint64_t seed,
                  BlockClustering& clustering) {
  clustering = {};
  if (points.empty()) return;
  const FacilityPoints problem{
      .points = points, .weights = weights, .facility_cost = facility_cost};
  FacilitySolution solution =
      search_points(problem, {.strategy = GainStrategy::full_scan, .length = length, .seed = seed});
  clustering.facility_cost =
      solution.opening_cost / static_cast<double>(solution.facilities.size());
  clustering.connection_cost = solution.connection_cost;
  clustering.facilities = std::move(solution.facilities);
  clustering.assignment = std::move(solution.assignment);
}

}  // namespace terrace::cluster
