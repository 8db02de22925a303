// SPDX-License-Identifier: Apache-2.0
#pragma once

// Vectors of heights, and how blocks of samples are loaded into them. The rules of
// grid_scan_impl.hpp hold here.
#include "scan.hpp"

namespace terrace::tri::tin {
namespace {

template <class T>
struct Kernel;

template <>
struct Kernel<float> {
  static constexpr int kLanes = 16;
  using Int = std::int32_t;
  using Reals = float __attribute__((vector_size(64)));
  using Ints = std::int32_t __attribute__((vector_size(64)));
  using Quarter = float __attribute__((vector_size(16)));
  using Half = float __attribute__((vector_size(32)));
  [[gnu::always_inline]] static Int greatest_lane(Ints lanes) {
    using IntQuarter = std::int32_t __attribute__((vector_size(16)));
    using IntHalf = std::int32_t __attribute__((vector_size(32)));
    const IntHalf low = __builtin_shufflevector(lanes, lanes, 0, 1, 2, 3, 4, 5, 6, 7);
    const IntHalf high = __builtin_shufflevector(lanes, lanes, 8, 9, 10, 11, 12, 13, 14, 15);
    const IntHalf eight = high > low ? high : low;
    const IntQuarter first = __builtin_shufflevector(eight, eight, 0, 1, 2, 3);
    const IntQuarter second = __builtin_shufflevector(eight, eight, 4, 5, 6, 7);
    IntQuarter four = second > first ? second : first;
    const IntQuarter swapped = __builtin_shufflevector(four, four, 2, 3, 0, 1);
    four = swapped > four ? swapped : four;
    return four[1] > four[0] ? four[1] : four[0];
  }
  static constexpr Ints kLane = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  static constexpr Int kSignless = 0x7FFFFFFF;
  static constexpr float kRounding = 0x1p-24F;

  [[gnu::always_inline]] static Reals load(const float* from) {
    Reals lanes;
    __builtin_memcpy(&lanes, from, sizeof lanes);
    return lanes;
  }
  [[gnu::always_inline]] static Reals load_pair(const float* from, std::size_t stride) {
    Half a, b;
    __builtin_memcpy(&a, from, sizeof a);
    __builtin_memcpy(&b, from + stride, sizeof b);
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  }
  [[gnu::always_inline]] static Reals load_four(const float* from, std::size_t stride) {
    Quarter a, b, c, d;
    __builtin_memcpy(&a, from, sizeof a);
    __builtin_memcpy(&b, from + stride, sizeof b);
    __builtin_memcpy(&c, from + 2 * stride, sizeof c);
    __builtin_memcpy(&d, from + 3 * stride, sizeof d);
    const Half ab = __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
    const Half cd = __builtin_shufflevector(c, d, 0, 1, 2, 3, 4, 5, 6, 7);
    return __builtin_shufflevector(ab, cd, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  }
};

template <>
struct Kernel<double> {
  static constexpr int kLanes = 8;
  using Int = std::int64_t;
  using Reals = double __attribute__((vector_size(64)));
  using Ints = std::int64_t __attribute__((vector_size(64)));
  using Half = double __attribute__((vector_size(32)));
  [[gnu::always_inline]] static Int greatest_lane(Ints lanes) {
    Int greatest = lanes[0];
    for (int i = 1; i < kLanes; ++i) greatest = lanes[i] > greatest ? lanes[i] : greatest;
    return greatest;
  }
  static constexpr Ints kLane = {0, 1, 2, 3, 4, 5, 6, 7};
  static constexpr Int kSignless = 0x7FFFFFFFFFFFFFFF;
  static constexpr double kRounding = 0x1p-53;

  [[gnu::always_inline]] static Reals load(const double* from) {
    Reals lanes;
    __builtin_memcpy(&lanes, from, sizeof lanes);
    return lanes;
  }
  [[gnu::always_inline]] static Reals load_pair(const double* from, std::size_t stride) {
    Half a, b;
    __builtin_memcpy(&a, from, sizeof a);
    __builtin_memcpy(&b, from + stride, sizeof b);
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
  }
};

}  // namespace
}  // namespace terrace::tri::tin
