// SPDX-License-Identifier: Apache-2.0
#pragma once

// Included once for each instruction set, after what masks of lanes are there: functions
// not_negative(), at_most(), more(), both(), either(), chosen(), kept(), beyond(), equal(),
// bits_of(). What is here must not be shared
// between objects, so nothing has a name outside its object, and no function of another header is
// called.
#include "scan_plane.hpp"

namespace terrace::tri::tin {
namespace {

/// Blocks of kWidth columns, for boxes that are no wider. Calls visit(errors, inside, x, y) with
/// the errors of the block at (x, y) until that returns false.
template <int kWidth, class T, int kStep, class Visit>
[[gnu::always_inline]] inline void scan_blocks(const GridSamples<T>& samples,
                                               const Plane<T, kStep>& plane, const GridCorner<T>& a,
                                               const GridCorner<T>& b, const GridCorner<T>& c,
                                               const Visit& visit) {
  using K = Kernel<T>;
  using Reals = typename K::Reals;
  using Ints = typename K::Ints;
  using Int = typename K::Int;
  constexpr int kHeight = K::kLanes / kWidth;
  const Ints lane_x = K::kLane & (kWidth - 1);
  const Ints lane_y = K::kLane / kWidth;
  const Sides<T, kStep> sides(plane, a, b, c);
  Ints edge[3], step[3];
  for (int i = 0; i < 3; ++i) {
    edge[i] = sides.start[i] + sides.along_x[i] * lane_x + sides.along_y[i] * lane_y;
    step[i] = sides.along_y[i] * kHeight - Ints{};
  }
  const T base = a.z;
  const Reals x =
      static_cast<T>(kStep * plane.min_x - a.x) + __builtin_convertvector(kStep * lane_x, Reals);
  const Reals rise_x = plane.gradient_x * x;
  const Reals rows = __builtin_convertvector(kStep * lane_y, Reals);
  const T* row =
      samples.heights + static_cast<std::size_t>(plane.min_y) * samples.stride + plane.min_x;
  for (std::int32_t y = plane.min_y; y <= plane.max_y; y += kHeight) {
    Reals z;
    if constexpr (kHeight == 1) {
      z = K::load(row);
    } else if constexpr (kHeight == 2) {
      z = K::load_pair(row, samples.stride);
    } else {
      z = K::load_four(row, samples.stride);
    }
    const Reals down = static_cast<T>(kStep * y - a.y) + rows;
    const Reals difference = (z - base) - (rise_x + plane.gradient_y * down);
    const Reals error = (Reals)((Ints)difference & K::kSignless);
    auto inside = not_negative(edge[0] | edge[1] | edge[2]);
    if (plane.clipped)
      inside = both(inside, both(at_most(lane_x, Int{plane.max_x - plane.min_x} - Ints{}),
                                 at_most(lane_y, Int{plane.max_y - y} - Ints{})));
    if (!visit(error, inside, plane.min_x, y, kWidth)) return;
    for (int i = 0; i < 3; ++i) edge[i] += step[i];
    row += samples.stride * kHeight;
  }
}

template <class T, int kStep, class Visit>
[[gnu::always_inline]] inline void scan_rows(const GridSamples<T>& samples,
                                             const Plane<T, kStep>& plane, const GridCorner<T>& a,
                                             const GridCorner<T>& b, const GridCorner<T>& c,
                                             const Visit& visit) {
  using K = Kernel<T>;
  using Reals = typename K::Reals;
  using Ints = typename K::Ints;
  using Int = typename K::Int;
  const Ints lane = K::kLane;
  const Spans<T, kStep> spans(plane, a, b, c);
  const Reals columns = __builtin_convertvector(kStep * lane, Reals);
  const T base = a.z;
  for (std::int32_t y = plane.min_y; y <= plane.max_y; ++y) {
    std::int32_t left = plane.min_x, right = plane.max_x;
    spans.row(y - plane.min_y, left, right);
    const T* row = samples.heights + static_cast<std::size_t>(y) * samples.stride;
    const T rise_y = plane.gradient_y * static_cast<T>(kStep * y - a.y);
    for (std::int32_t x = left; x <= right; x += K::kLanes) {
      const Reals z = K::load(row + x);
      const Reals across = static_cast<T>(kStep * x - a.x) + columns;
      const Reals difference = (z - base) - (plane.gradient_x * across + rise_y);
      const Reals error = (Reals)((Ints)difference & K::kSignless);
      const auto inside = at_most(lane, Int{right - x} - Ints{});
      if (!visit(error, inside, x, y, K::kLanes)) return;
    }
  }
}

template <class T, int kStep, class Visit>
[[gnu::always_inline]] inline void scan_triangle(const GridSamples<T>& samples,
                                                 const Plane<T, kStep>& plane,
                                                 const GridCorner<T>& a, const GridCorner<T>& b,
                                                 const GridCorner<T>& c, const Visit& visit) {
  const std::int32_t width = plane.max_x - plane.min_x + 1;
  constexpr int kLanes = Kernel<T>::kLanes;
  if (width <= 4) {
    scan_blocks<4>(samples, plane, a, b, c, visit);
  } else if (width <= 8) {
    scan_blocks<8>(samples, plane, a, b, c, visit);
  } else if (width <= kLanes) {
    scan_blocks<kLanes>(samples, plane, a, b, c, visit);
  } else {
    scan_rows(samples, plane, a, b, c, visit);
  }
}

/// Errors are compared as the integers with their bits: NaN is greater than all others, and nothing
/// branches on errors before the end, as whether one is a new maximum cannot be foretold.
///
/// Corners are never the worst: their errors are at most `slack`, which is at most `limit`.
template <class T, int kStep>
GridWorst<T> worst_in(const GridSamples<T>& samples, const GridCorner<T>& a, const GridCorner<T>& b,
                      const GridCorner<T>& c, T bound) {
  using K = Kernel<T>;
  using Reals = typename K::Reals;
  using Ints = typename K::Ints;
  using Int = typename K::Int;
  const Plane<T, kStep> plane(samples, a, b, c, bound);
  if (plane.empty) return {0, 0};
  T limit = bound - plane.slack;
  if constexpr (K::kLanes == 16) {
    if (!(plane.slack <= bound * 0x1p-8F)) return {T{kUnsure}, 0};
  } else {
    limit = greatest(limit, plane.slack);
  }
  Ints most = (Ints)(limit - Reals{});
  Ints block = {};  // that it was found in
  auto grown = more(most, most);
  int width = 1;
  scan_triangle(
      samples, plane, a, b, c,
      [&](Reals error, auto inside, std::int32_t x, std::int32_t y, int columns)
          __attribute__((always_inline)) {
            const Ints own = (Ints)kept(error, inside);
            const auto grew = more(own, most);
            most = chosen(grew, own, most);
            const auto place = static_cast<std::uint32_t>(y) << 16 | static_cast<std::uint32_t>(x);
            block = chosen(grew, static_cast<Int>(place) - Ints{}, block);
            grown = either(grown, grew);
            width = columns;
            return true;
          });
  if (bits_of(grown) == 0) return {0, 0};
  const Int greatest_bits = K::greatest_lane(most);
  T error;
  __builtin_memcpy(&error, &greatest_bits, sizeof error);
  if (!(error < static_cast<T>(__builtin_inf()))) return {static_cast<T>(__builtin_inf()), 0};
  std::uint32_t first = 0xFFFFFFFF;
  for (unsigned lanes = equal(most, greatest_bits - Ints{}); lanes != 0; lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
    const auto corner = static_cast<std::uint32_t>(block[lane]);
    const auto x = (corner & 0xFFFF) + static_cast<std::uint32_t>(lane & (width - 1));
    const auto y = (corner >> 16) + static_cast<std::uint32_t>(lane / width);
    first = least(first, y * kStep << 16 | x * kStep);
  }
  return {error, first};
}

template <class T>
int within_in(const GridSamples<T>& samples, const GridCorner<T>& a, const GridCorner<T>& b,
              const GridCorner<T>& c, T bound) {
  using K = Kernel<T>;
  using Reals = typename K::Reals;
  const Plane<T, 1> plane(samples, a, b, c, bound);
  if (plane.empty) return 1;
  T allowed = bound - plane.slack;
  if constexpr (K::kLanes == 16) {
    if (!(plane.slack <= bound * 0x1p-8F)) return kUnsure;
  } else {
    allowed = greatest(allowed, plane.slack);
  }
  bool within = true;
  scan_triangle(
      samples, plane, a, b, c,
      [&](Reals error, auto inside, std::int32_t, std::int32_t, int)
          __attribute__((always_inline)) {
            within = beyond(error, allowed - Reals{}, inside) == 0;
            return within;
          });
  return within ? 1 : 0;
}

}  // namespace
}  // namespace terrace::tri::tin
