// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

/// Random draws that are the same everywhere: the distributions of the standard library differ
/// between implementations.

namespace terrace::cluster {

/// Uniform in [0, 1).
inline double draw_unit(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// Below `bound`, which is positive and at most 2^32.
inline std::uint32_t draw_below(std::size_t bound, std::mt19937_64& random) {
  return static_cast<std::uint32_t>(((random() >> 32) * bound) >> 32);
}

template <class T>
void draw_order(std::vector<T>& items, std::mt19937_64& random) {
  for (std::size_t i = items.size(); i > 1; --i) {
    std::swap(items[i - 1], items[draw_below(i, random)]);
  }
}

inline constexpr std::uint64_t kGoldenGamma = 0x9e3779b97f4a7c15u;

/// G. Steele, D. Lea, C. Flood, Fast splittable pseudorandom number generators, OOPSLA 2014.
inline std::uint64_t splitmix64(std::uint64_t x) {
  x += kGoldenGamma;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// A different seed for each of many runs.
inline std::uint64_t seed_of_run(std::uint64_t seed, std::uint64_t run) {
  return splitmix64(seed + run * kGoldenGamma);
}

}  // namespace terrace::cluster
