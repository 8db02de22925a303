// SPDX-License-Identifier: Apache-2.0
// Compares assignments of small matrices with few distinct values with brute force over all
// permutations.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <vector>

#include "terrace/matching/assignment.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::size_t columns = 1 + data[0] % 6, rows = 1 + data[1] % columns;
  std::vector<double> costs(rows * columns);
  for (std::size_t k = 0; k < costs.size() && 2 + k < size; ++k) {
    costs[k] = static_cast<double>(data[2 + k] % 7) - 2.0;
  }
  std::vector<std::size_t> permutation(columns);
  std::iota(permutation.begin(), permutation.end(), std::size_t{0});
  double least = 1e300;
  do {
    double sum = 0;
    for (std::size_t i = 0; i < rows; ++i) sum += costs[i * columns + permutation[i]];
    least = std::min(least, sum);
  } while (std::next_permutation(permutation.begin(), permutation.end()));
  if (terrace::matching::assign(costs, rows, columns).cost != least) std::abort();
  return 0;
}
