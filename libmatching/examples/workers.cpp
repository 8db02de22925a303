// SPDX-License-Identifier: Apache-2.0
// Assigns workers to jobs and proves that no other assignment is cheaper.
#include <cstdio>
#include <vector>

#include <terrace/matching/assignment.hpp>

int main() {
  // Three workers (rows), four jobs (columns).
  const std::vector<double> costs{4, 1, 3, 9,  //
                                  2, 0, 5, 9,  //
                                  3, 2, 2, 9};
  const auto best = terrace::matching::assign(costs, 3, 4);
  for (std::size_t i = 0; i < best.column.size(); ++i) {
    std::printf("worker %zu does job %u for %g\n", i, best.column[i],
                costs[i * 4 + best.column[i]]);
  }
  std::printf("total %g\n", best.cost);

  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      if (best.row_dual[i] + best.column_dual[j] > costs[i * 4 + j]) return 1;  // never
    }
  }
  return best.cost == 5 ? 0 : 1;
}
