// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/point_matrix.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "facility/point_space.hpp"

namespace terrace::cluster {

PointMatrix point_matrix(const FacilityPoints& problem, std::uint64_t memory_limit) {
  check(problem);
  const std::uint64_t n = problem.points.size();
  if (memory_limit == 0) memory_limit = std::numeric_limits<std::size_t>::max() / 2;
  // n is below 2^32, so that n^2 is in range and 8 n^2 may not be.
  if (n * n > memory_limit / sizeof(double)) {
    throw std::invalid_argument("the costs of " + std::to_string(n) + " points would need " +
                                std::to_string((n * n >> 17) + 1) +
                                " MiB of memory, but the limit is " +
                                std::to_string(memory_limit >> 20) +
                                " MiB; take fewer points, or a method without a matrix");
  }
  SearchFrame frame = make_frame(problem);
  PointMatrix matrix;
  const double opening = frame.true_facility_cost;
  const int exponent = frame.cost_exponent;
  with_space(problem, frame, problem.points, [&](const auto& space) {
    const PointRows<std::decay_t<decltype(space)>> rows(space, frame.weights, frame.outlier_price);
    matrix.opening.assign(n, opening);
    matrix.connection.resize(n * n);
    std::vector<double> scratch;
    for (std::uint64_t j = 0; j < n; ++j) {
      const double* const row = rows.row(j, scratch);
      double* const out = matrix.connection.data() + j * n;
      for (std::uint64_t i = 0; i < n; ++i) out[i] = std::ldexp(row[i], exponent);
    }
    return 0;
  });
  check(matrix.view());
  return matrix;
}

}  // namespace terrace::cluster
