// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

/// Random numbers that are the same on every machine. The engines of the standard library are
/// portable, but its distributions differ between implementations.

namespace terrace::base {

inline constexpr std::uint64_t kGoldenGamma = 0x9E3779B97F4A7C15u;

/// The finaliser of splitmix64: a bijection of 64 bits in which each bit of the result depends on
/// every bit of x. Source: G. Steele, D. Lea, C. Flood, Fast splittable pseudorandom number
/// generators, OOPSLA 2014, doi:10.1145/2660193.2660195.
constexpr std::uint64_t mix64(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}
/// Returns the output of the generator splitmix64 in state x.
constexpr std::uint64_t splitmix64(std::uint64_t x) { return mix64(x + kGoldenGamma); }

/// Returns a seed for run number `run`, different for each run.
constexpr std::uint64_t seed_of_run(std::uint64_t seed, std::uint64_t run) {
  return splitmix64(seed + run * kGoldenGamma);
}

/// Returns the upper 53 bits as a double in [0, 1).
constexpr double unit_interval(std::uint64_t bits) {
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

/// Returns a uniformly distributed number in [0, 1).
inline double draw_unit(std::mt19937_64& random) { return unit_interval(random()); }

/// Returns a uniformly distributed integer below `bound`. Requires 0 < bound <= 2^32.
inline std::uint32_t draw_below(std::size_t bound, std::mt19937_64& random) {
  return static_cast<std::uint32_t>(((random() >> 32) * bound) >> 32);
}

/// Shuffles the items (Fisher-Yates).
template <class T>
void shuffle(std::vector<T>& items, std::mt19937_64& random) {
  for (std::size_t i = items.size(); i > 1; --i) {
    std::swap(items[i - 1], items[draw_below(i, random)]);
  }
}

}  // namespace terrace::base
