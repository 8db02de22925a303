// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace terrace::matching {

/// Returns the least cost over all ways to assign min(rows, columns) rows to columns.
template <class Number>
double brute_force(const std::vector<Number>& costs, std::size_t rows, std::size_t columns) {
  // Permutes the longer side. Its first elements are matched to the shorter side.
  const bool tall = rows > columns;
  std::vector<std::size_t> permutation(tall ? rows : columns);
  std::iota(permutation.begin(), permutation.end(), std::size_t{0});
  double best = std::numeric_limits<double>::infinity();
  do {
    double sum = 0;
    for (std::size_t k = 0; k < std::min(rows, columns); ++k) {
      const std::size_t entry = tall ? permutation[k] * columns + k : k * columns + permutation[k];
      sum += static_cast<double>(costs[entry]);
    }
    best = std::min(best, sum);
  } while (std::next_permutation(permutation.begin(), permutation.end()));
  return best;
}

/// Returns a random number in [0, 1).
inline double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// Returns the message of the std::invalid_argument that `call` throws.
inline std::string message_of(const auto& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace terrace::matching
