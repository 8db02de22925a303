// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>

#include "facility/matrix/strategies.hpp"
#include "facility/points/point_space.hpp"

namespace terrace::cluster {
namespace {

void check_memory(std::uint64_t n, std::uint64_t limit, const char* what) {
  if (limit == 0) limit = std::numeric_limits<std::size_t>::max() / 2;
  // n is below 2^32, so n^2 cannot overflow, but 8 n^2 can.
  if (n * n <= limit / sizeof(double)) return;
  throw std::invalid_argument("the costs of " + std::to_string(n) + " " + what + " would need " +
                              std::to_string((n * n >> 17) + 1) +
                              " MiB of memory, but the limit is " + std::to_string(limit >> 20) +
                              " MiB; use fewer " + what + ", or a method without a matrix");
}

template <class Space>
CostMatrix fill(const Space& space, const SearchFrame& frame, const base::StopCheck& check_stop) {
  const PointRows<Space> rows(space, frame.weights, frame.outlier_price, check_stop);
  const std::size_t n = frame.weights.size();
  CostMatrix matrix;
  matrix.opening.assign(n, frame.true_facility_cost);
  // Memory is first touched row by row, as that takes seconds.
  matrix.connection.reserve(n * n);
  std::vector<double> scratch;
  for (std::size_t j = 0; j < n; ++j) {
    const double* const row = rows.row(j, scratch);
    for (std::size_t i = 0; i < n; ++i) {
      matrix.connection.push_back(std::ldexp(row[i], frame.cost_exponent));
    }
  }
  check(matrix.view(), check_stop);
  return matrix;
}

}  // namespace

CostMatrix cost_matrix(const FacilityPoints& problem, std::uint64_t memory_limit,
                       const base::StopCheck& check_stop) {
  check_memory(problem.points.size(), memory_limit, "points");
  SearchFrame frame = make_frame(problem);
  return visit_space(problem, frame, problem.points,
                     [&](const auto& space) { return fill(space, frame, check_stop); });
}

CostMatrix cost_matrix(const FacilityEntities& problem, std::uint64_t memory_limit,
                       const base::StopCheck& check_stop) {
  check_memory(problem.count, memory_limit, "entities");
  return fill(space_of(problem), make_frame(problem), check_stop);
}

}  // namespace terrace::cluster
