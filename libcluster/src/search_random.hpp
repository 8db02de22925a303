// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>

/// Own conversions: the distributions of the standard library differ between implementations.

namespace terrace::cluster {

/// Uniform in [0, 1).
inline double random_unit(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// Uniform in 0 ... bound - 1. Requires: 0 < bound <= 2^32.
inline std::uint32_t random_below(std::size_t bound, std::mt19937_64& random) {
  return static_cast<std::uint32_t>(((random() >> 32) * bound) >> 32);
}

}  // namespace terrace::cluster
