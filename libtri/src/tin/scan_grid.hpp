// SPDX-License-Identifier: Apache-2.0
#pragma once

// The rules in scan_lanes.hpp apply here.
#include "scan_triangle.hpp"

namespace terrace::tri::tin {
namespace {

/// A triangle over samples of every kStep-th column and row of the lattice, which number the box.
/// Corners are in columns and rows of the lattice.
template <class T, int kStep>
struct GridFace {
  using Real = T;
  using K = Lanes<T>;
  using Reals = typename K::Reals;
  using Ints = typename K::Ints;
  using Int = typename K::Int;
  static constexpr int kWidestBlock = K::kLanes;

  const GridSamples<T>& samples;
  const GridCorner<T>&a, &b, &c;
  std::int32_t first_column, last_column, first_row, last_row;
  bool empty;
  bool clipped;              ///< the box does not cover the whole triangle
  T gradient_x, gradient_y;  ///< gradient of the plane
  T slack;

  [[gnu::always_inline]] GridFace(const GridSamples<T>& all, const GridCorner<T>& p,
                                  const GridCorner<T>& q, const GridCorner<T>& r, T bound)
      : samples(all), a(p), b(q), c(r) {
    const std::int64_t bx = b.x - a.x, by = b.y - a.y;
    const std::int64_t cx = c.x - a.x, cy = c.y - a.y;
    const std::int64_t area = bx * cy - by * cx;
    const std::int32_t left = least(a.x, least(b.x, c.x));
    const std::int32_t right = greatest(a.x, greatest(b.x, c.x));
    const std::int32_t top = least(a.y, least(b.y, c.y));
    const std::int32_t bottom = greatest(a.y, greatest(b.y, c.y));
    first_column = greatest((left + kStep - 1) / kStep, samples.first_x);
    last_column = least(right / kStep, samples.last_x);
    first_row = greatest((top + kStep - 1) / kStep, samples.first_y);
    last_row = least(bottom / kStep, samples.last_y);
    clipped = last_column != right / kStep || last_row != bottom / kStep;
    // Twice the area is 1, or the box is 2 x 2, so there are only corners.
    empty = area <= 1 || (right - left <= 1 && bottom - top <= 1) || first_column > last_column ||
            first_row > last_row;
    if (empty) return;
    const double inverse = 1.0 / static_cast<double>(area);
    const double bz = static_cast<double>(b.z) - static_cast<double>(a.z);
    const double cz = static_cast<double>(c.z) - static_cast<double>(a.z);
    const double slope_x = (bz * static_cast<double>(cy) - cz * static_cast<double>(by)) * inverse;
    const double slope_y = (cz * static_cast<double>(bx) - bz * static_cast<double>(cx)) * inverse;
    gradient_x = static_cast<T>(slope_x);
    gradient_y = static_cast<T>(slope_y);
    // Rounding errors come from the gradients, 2 products and 3 sums. In double the gradients are
    // rounded several times, in proportion to the terms of their sums, which are bounded by
    // |difference of heights| * extent / area.
    const double width = right - left, height = bottom - top;
    const double rise = __builtin_fabs(slope_x) * width + __builtin_fabs(slope_y) * height;
    double rounded = K::kRounding * (6.5 * rise + 4.0 * static_cast<double>(bound));
    if (std::is_same_v<T, double>)
      rounded +=
          0x1p-50 * (__builtin_fabs(bz) + __builtin_fabs(cz)) * (2.0 * width * height * inverse);
    slack = static_cast<T>(rounded);
  }

  /// NaN, a sample without data, is beyond every limit.
  template <class Sides>
  [[gnu::always_inline]] static bool any_beyond(Reals error, Reals limit, const Sides& sides) {
    return exceeding(error, limit, sides.inside()) != 0;
  }

  /// The mask of samples in the triangle, as a function.
  template <class Inside>
  struct Sides {
    const Inside& inside;
  };

  template <int kWidth>
  struct Blocks {
    static constexpr int kHeight = K::kLanes / kWidth;
    const GridFace& face;
    /// Edge functions, which are not negative for samples to the left of a side or on it.
    Ints edge[3], step[3];
    Reals rise_x;
    const T* row;

    [[gnu::always_inline]] static Ints lane_x() { return K::kLane & (kWidth - 1); }
    [[gnu::always_inline]] static Ints lane_y() { return K::kLane / kWidth; }

    [[gnu::always_inline]] explicit Blocks(const GridFace& of) : face(of) {
      set(0, face.a, face.b);
      set(1, face.b, face.c);
      set(2, face.c, face.a);
      const Reals x = static_cast<T>(kStep * face.first_column - face.a.x) +
                      __builtin_convertvector(kStep * lane_x(), Reals);
      rise_x = face.gradient_x * x;
      row = face.samples.heights + static_cast<std::size_t>(face.first_row) * face.samples.stride +
            face.first_column;
    }
    [[gnu::always_inline]] void set(int i, const GridCorner<T>& p, const GridCorner<T>& q) {
      const Int along_x = p.y - q.y, along_y = q.x - p.x;
      const Int start =
          along_x * (kStep * face.first_column - p.x) + along_y * (kStep * face.first_row - p.y);
      edge[i] = start + along_x * kStep * lane_x() + along_y * kStep * lane_y();
      step[i] = along_y * kStep * kHeight - Ints{};
    }

    template <class Visit>
    [[gnu::always_inline]] bool visit(std::int32_t y, const Visit& visitor) {
      Reals z;
      if constexpr (kHeight == 1) {
        z = K::load(row);
      } else if constexpr (kHeight == 2) {
        z = K::load_halves(row, row + face.samples.stride);
      } else {
        z = K::load_quarters(row, face.samples.stride);
      }
      const Reals down =
          static_cast<T>(kStep * y - face.a.y) + __builtin_convertvector(kStep * lane_y(), Reals);
      const Reals above_plane = (z - face.a.z) - (rise_x + face.gradient_y * down);
      const auto inside = [&]() __attribute__((always_inline)) {
        const auto between = not_negative(edge[0] | edge[1] | edge[2]);
        if (!face.clipped) return between;
        return mask_and(
            between, mask_and(at_most(lane_x(), Int{face.last_column - face.first_column} - Ints{}),
                              at_most(lane_y(), Int{face.last_row - y} - Ints{})));
      };
      if (!visitor(above_plane, Sides<decltype(inside)>{inside}, face.first_column, y, kWidth))
        return false;
      for (int i = 0; i < 3; ++i) edge[i] += step[i];
      row += face.samples.stride * kHeight;
      return true;
    }
  };

  /// Rows with exactly the columns that are in the triangle. Quotients differ from integers by at
  /// least half their unit, far more than rounding.
  struct Rows {
    const GridFace& face;
    double from[3], step[3], sign[3], scale[3];
    std::int32_t first, last, y;
    const T* row;
    T rise_y;

    [[gnu::always_inline]] explicit Rows(const GridFace& of) : face(of) {
      set(0, face.a, face.b);
      set(1, face.b, face.c);
      set(2, face.c, face.a);
    }
    [[gnu::always_inline]] void set(int i, const GridCorner<T>& p, const GridCorner<T>& q) {
      const double along_x = p.y - q.y, along_y = q.x - p.x;
      const double size = __builtin_fabs(along_x), unit = kStep * size;
      sign[i] = along_x;
      // left: sample >= ceil(n / unit), right: sample <= floor(n / unit)
      const double towards = along_x > 0 ? -along_y : along_y;
      const double half = along_x > 0 ? unit - 0.5 : 0.5;
      step[i] = kStep * towards;
      from[i] = towards * (kStep * face.first_row - p.y) + p.x * size + half;
      scale[i] = along_x == 0 ? 0.0 : 1.0 / unit;
    }

    [[gnu::always_inline]] void start(std::int32_t at) {
      y = at;
      first = face.first_column, last = face.last_column;
      const double down = y - face.first_row;
      for (int i = 0; i < 3; ++i) {
        if (sign[i] == 0) continue;
        constexpr double kFar = 131072.0;
        const double column = (from[i] + step[i] * down) * scale[i];
        const double near = column < -kFar ? -kFar : column > kFar ? kFar : column;
        const std::int32_t x = static_cast<std::int32_t>(near + kFar) - 131072;
        if (sign[i] > 0) {
          first = greatest(first, x);
        } else {
          last = least(last, x);
        }
      }
      row = face.samples.heights + static_cast<std::size_t>(y) * face.samples.stride;
      rise_y = face.gradient_y * static_cast<T>(kStep * y - face.a.y);
    }

    template <class Visit>
    [[gnu::always_inline]] bool visit(std::int32_t x, const Visit& visitor) const {
      const Reals dx =
          static_cast<T>(kStep * x - face.a.x) + __builtin_convertvector(kStep * K::kLane, Reals);
      const Reals above_plane = (K::load(row + x) - face.a.z) - (face.gradient_x * dx + rise_y);
      const auto inside = [&]() __attribute__((always_inline)) {
        return at_most(K::kLane, Int{last - x} - Ints{});
      };
      return visitor(above_plane, Sides<decltype(inside)>{inside}, x, y, K::kLanes);
    }
  };
};

/// Errors are compared as the integers with their bits, so that NaN is greater than all others. No
/// branch depends on errors before the end, because new maxima cannot be predicted.
///
/// Corners are never the worst, as their errors are at most `slack`, which is at most `limit`.
template <class T, int kStep>
WorstSample<T> worst_of_grid(const GridSamples<T>& samples, const GridCorner<T>& a,
                             const GridCorner<T>& b, const GridCorner<T>& c, T bound) {
  using K = Lanes<T>;
  using Reals = typename K::Reals;
  using Ints = typename K::Ints;
  using Int = typename K::Int;
  const GridFace<T, kStep> face(samples, a, b, c, bound);
  if (face.empty) return {0, 0};
  const T limit = greatest_allowed(bound, face.slack);
  if (limit == kUnsure) return {T{kUnsure}, 0};
  Ints largest = (Ints)(limit - Reals{});
  Ints block = {};  // the block of each lane's worst sample
  auto has_grown = more(largest, largest);
  int width = 1;
  scan_triangle(
      face, [&](Reals above_plane, const auto& sides, std::int32_t x, std::int32_t y,
                int columns) __attribute__((always_inline)) {
        const Ints error = (Ints)zero_unless(K::absolute(above_plane), sides.inside());
        const auto grows = more(error, largest);
        largest = blend(grows, error, largest);
        const auto place = static_cast<std::uint32_t>(y) << 16 | static_cast<std::uint32_t>(x);
        block = blend(grows, static_cast<Int>(place) - Ints{}, block);
        has_grown = mask_or(has_grown, grows);
        width = columns;
        return true;
      });
  if (bits_of(has_grown) == 0) return {0, 0};
  const Int greatest_bits = K::greatest_lane(largest);
  T error;
  __builtin_memcpy(&error, &greatest_bits, sizeof error);
  if (!(error < static_cast<T>(__builtin_inf()))) return {static_cast<T>(__builtin_inf()), 0};
  std::uint32_t first = 0xFFFFFFFF;
  for (unsigned lanes = equal(largest, greatest_bits - Ints{}); lanes != 0; lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
    const auto corner = static_cast<std::uint32_t>(block[lane]);
    const auto x = (corner & 0xFFFF) + static_cast<std::uint32_t>(lane & (width - 1));
    const auto y = (corner >> 16) + static_cast<std::uint32_t>(lane / width);
    first = least(first, y * kStep << 16 | x * kStep);
  }
  return {error, first};
}

template <class T>
constexpr GridScan<T> grid_scan() {
  return {worst_of_grid<T, 1>, worst_of_grid<T, kGridCoarse>,
          within_in<GridFace<T, 1>, GridSamples<T>, GridCorner<T>>};
}

}  // namespace
}  // namespace terrace::tri::tin
