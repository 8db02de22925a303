// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

// Vectors of 64 bytes. This file, scan_masks.hpp and the scans that scan_impl.hpp includes are
// compiled once for each instruction set. They must not share anything between objects, as
// otherwise the linker might keep only the version for newer processors: everything is in anonymous
// namespaces, and no function of another header is called.

namespace terrace::tri::tin {
namespace {

using Reals16 = float __attribute__((vector_size(64)));
using Ints16 = std::int32_t __attribute__((vector_size(64)));
using Reals8 = double __attribute__((vector_size(64)));
using Ints8 = std::int64_t __attribute__((vector_size(64)));

template <class V>
[[gnu::always_inline]] inline V least(V a, V b) {
  return b < a ? b : a;
}
template <class V>
[[gnu::always_inline]] inline V greatest(V a, V b) {
  return b > a ? b : a;
}

/// kLanes is a multiple of 4, and results do not depend on it.
template <class T>
struct Lanes;

#ifdef TERRACE_TRI_NARROW_LANES

/// As below, with vectors of 4 lanes.
template <class T, class Whole, class RealLanes, class WholeLanes>
struct NarrowLanes {
  static constexpr int kLanes = 4;
  using Int = Whole;
  using Reals = RealLanes;
  using Ints = WholeLanes;
  static constexpr Ints kLane = {0, 1, 2, 3};

  [[gnu::always_inline]] static Reals absolute(Reals lanes) {
    return (Reals)((Ints)lanes & static_cast<Int>(~std::uint64_t{0} >> (65 - 8 * sizeof(Int))));
  }
  [[gnu::always_inline]] static Int greatest_lane(Ints lanes) {
    Int largest = lanes[0];
    for (int i = 1; i < kLanes; ++i) largest = lanes[i] > largest ? lanes[i] : largest;
    return largest;
  }
  [[gnu::always_inline]] static Reals load(const T* from) {
    Reals lanes;
    __builtin_memcpy(&lanes, from, sizeof lanes);
    return lanes;
  }
};

using Reals4 = float __attribute__((vector_size(16)));
using Ints4 = std::int32_t __attribute__((vector_size(16)));
using LongReals4 = double __attribute__((vector_size(32)));
using LongInts4 = std::int64_t __attribute__((vector_size(32)));

template <>
struct Lanes<float> : NarrowLanes<float, std::int32_t, Reals4, Ints4> {
  static constexpr float kRounding = 0x1p-24F;
};
template <>
struct Lanes<double> : NarrowLanes<double, std::int64_t, LongReals4, LongInts4> {
  static constexpr double kRounding = 0x1p-53;
};

#else

template <>
struct Lanes<float> {
  static constexpr int kLanes = 16;
  using Int = std::int32_t;
  using Reals = Reals16;
  using Ints = Ints16;
  using Quarter = float __attribute__((vector_size(16)));
  using Half = float __attribute__((vector_size(32)));
  static constexpr Ints kLane = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  static constexpr float kRounding = 0x1p-24F;

  [[gnu::always_inline]] static Reals absolute(Reals lanes) {
    return (Reals)((Ints)lanes & 0x7FFFFFFF);
  }
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
  [[gnu::always_inline]] static Reals load(const float* from) {
    Reals lanes;
    __builtin_memcpy(&lanes, from, sizeof lanes);
    return lanes;
  }
  [[gnu::always_inline]] static Reals load_halves(const float* first, const float* second) {
    Half a, b;
    __builtin_memcpy(&a, first, sizeof a);
    __builtin_memcpy(&b, second, sizeof b);
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  }
  /// Loads a quarter from each of four rows.
  [[gnu::always_inline]] static Reals load_quarters(const float* from, std::size_t stride) {
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
struct Lanes<double> {
  static constexpr int kLanes = 8;
  using Int = std::int64_t;
  using Reals = Reals8;
  using Ints = Ints8;
  using Half = double __attribute__((vector_size(32)));
  static constexpr Ints kLane = {0, 1, 2, 3, 4, 5, 6, 7};
  static constexpr double kRounding = 0x1p-53;

  [[gnu::always_inline]] static Reals absolute(Reals lanes) {
    return (Reals)((Ints)lanes & 0x7FFFFFFFFFFFFFFF);
  }
  [[gnu::always_inline]] static Int greatest_lane(Ints lanes) {
    Int largest = lanes[0];
    for (int i = 1; i < kLanes; ++i) largest = lanes[i] > largest ? lanes[i] : largest;
    return largest;
  }
  [[gnu::always_inline]] static Reals load(const double* from) {
    Reals lanes;
    __builtin_memcpy(&lanes, from, sizeof lanes);
    return lanes;
  }
  [[gnu::always_inline]] static Reals load_halves(const double* first, const double* second) {
    Half a, b;
    __builtin_memcpy(&a, first, sizeof a);
    __builtin_memcpy(&b, second, sizeof b);
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
  }
};

#endif

}  // namespace
}  // namespace terrace::tri::tin
