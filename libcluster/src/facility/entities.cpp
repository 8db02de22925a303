// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/entities.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "facility/make_search.hpp"

namespace terrace::cluster {
namespace {

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument(what); }

template <std::size_t kCorners>
double corner_distance(const std::array<Point3, kCorners>& a,
                       const std::array<Point3, kCorners>& b) {
  // Halves, as differences may leave the range of double; relative to the largest, as squares may.
  double largest = 0.0;
  for (const Point3& p : a) {
    for (const Point3& q : b) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        largest = std::max(largest, std::abs(0.5 * p[axis] - 0.5 * q[axis]));
      }
    }
  }
  if (largest == 0.0) return 0.0;
  std::array<std::array<double, kCorners>, kCorners> squares{};
  for (std::size_t i = 0; i < kCorners; ++i) {
    for (std::size_t j = 0; j < kCorners; ++j) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double d = (0.5 * a[i][axis] - 0.5 * b[j][axis]) / largest;
        squares[i][j] += d * d;
      }
    }
  }
  std::array<std::size_t, kCorners> match{};
  std::iota(match.begin(), match.end(), std::size_t{0});
  double least = std::numeric_limits<double>::infinity();
  do {
    std::array<double, kCorners> terms{};
    for (std::size_t i = 0; i < kCorners; ++i) terms[i] = squares[i][match[i]];
    std::sort(terms.begin(), terms.end());  // so that the sum is symmetric to the last bit
    const double sum = std::accumulate(terms.begin(), terms.end(), 0.0);
    least = std::min(least, sum);
  } while (std::next_permutation(match.begin(), match.end()));
  return 2.0 * (largest * std::sqrt(least / static_cast<double>(kCorners)));
}

}  // namespace

void check(const EntityProblem& problem) {
  constexpr std::size_t kMost = 0xfffffffe;
  if (problem.count == 0) refuse("facility location without entities");
  if (problem.count > kMost) {
    refuse(std::to_string(problem.count) + " entities: at most " + std::to_string(kMost) +
           " are possible");
  }
  if (!problem.distance) refuse("facility location of entities without a distance function");
  if (!problem.weights.empty() && problem.weights.size() != problem.count) {
    refuse("weights: " + std::to_string(problem.weights.size()) + " for " +
           std::to_string(problem.count) + " entities");
  }
  for (std::size_t i = 0; i < problem.weights.size(); ++i) {
    if (problem.weights[i] > 0.0 && std::isfinite(problem.weights[i])) continue;
    refuse("the weight of entity " + std::to_string(i) + " is " +
           std::to_string(problem.weights[i]) + ": weights must be positive and finite");
  }
  if (!(problem.facility_cost > 0.0) || !std::isfinite(problem.facility_cost)) {
    refuse("the facility cost is " + std::to_string(problem.facility_cost) +
           ": it must be positive and finite, in the unit of the distances");
  }
  if (!(problem.outlier_price > 0.0)) {
    refuse("the price of an outlier is " + std::to_string(problem.outlier_price) +
           ": it must be positive, in the unit of the distances (infinite: no outliers)");
  }
}

FacilitySolution search_entities(const EntityProblem& problem, const PointSearchOptions& options,
                                 PointSearchStatistics* statistics) {
  check(problem);
  SearchFrame frame;
  frame.weights.assign(problem.weights.begin(), problem.weights.end());
  if (frame.weights.empty()) frame.weights.assign(problem.count, 1.0);
  set_costs(frame, problem.facility_cost, problem.outlier_price, 0);
  const std::unique_ptr<SearchEngine> engine = make_search(
      frame, IndexSpace(problem.distance, problem.symmetric && problem.triangle_inequality),
      options.strategy, options.threads);
  return run_search(*engine, options, statistics);
}

double segment_distance(const Segment& a, const Segment& b) { return corner_distance(a, b); }
double triangle_distance(const Triangle& a, const Triangle& b) { return corner_distance(a, b); }

}  // namespace terrace::cluster
