// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::cluster {

/// How long to search for facilities, both in blocks (block.hpp, hierarchy.hpp) and in
/// facility_location.hpp.
///
/// The percentages for blocks say how much the cost exceeds that of the thesis's full search, on
/// average over blocks of 10,000 points. The first is for surfaces, the second for volumes. For
/// local search over n points or entities, the effort is a number of random candidates. For
/// interchange on a matrix, it is a number of restarts and of perturbations per restart.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 7.3.1, whose full search is
/// `fine`.
enum class Effort : std::uint8_t {
  /// Blocks: at least one candidate per 32 points; 1.2 and 2.9 %. Local search: 0.1 n, at
  /// least 1. Interchange: 2 restarts, 50 perturbations.
  fast,
  /// Blocks: facilities also move, and points are assigned, twice; 0.8 and 2.3 %. Local
  /// search: like `fast`. Interchange: 8 restarts, 200 perturbations.
  standard,
  /// Blocks: three sweeps of one candidate per 16 points; 0.4 and 1.2 %. Local search:
  /// n ceil(log10 n). Interchange: 8 restarts, 1000 perturbations.
  fine,
  /// Blocks: n ceil(log2 n) random candidates, 3.5 times as many as in the thesis; within 0.1 % of
  /// its cost. Local search: n ceil(log2 n). Interchange: 32 restarts, 1000 perturbations.
  full,
};

}  // namespace terrace::cluster
