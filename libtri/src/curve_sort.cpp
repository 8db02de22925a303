// SPDX-License-Identifier: Apache-2.0
#include "curve_sort.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <type_traits>

#include <terrace/base/hilbert.hpp>

namespace terrace::tri {
namespace {

/// Maps points of a set to cells of its bounding square or cube.
template <class Point>
class Cells {
 public:
  using Coord = typename Point::value_type;
  static constexpr std::size_t kAxes = std::tuple_size_v<Point>;
  static constexpr unsigned kBits = kAxes == 2 ? 16 : 10;  ///< bits of a key, per axis

  Cells(std::span<const Point> points, std::span<const std::uint32_t> order) : points_(points) {
    Point high = points[order[0]];
    low_ = high;
    for (const std::uint32_t i : order) {
      for (std::size_t k = 0; k < kAxes; ++k) {
        low_[k] = std::min(low_[k], points[i][k]);
        high[k] = std::max(high[k], points[i][k]);
      }
    }
    for (std::size_t k = 0; k < kAxes; ++k) {
      if constexpr (std::is_integral_v<Coord>) {
        extent_ = std::max(extent_, high[k] - low_[k]);
      } else {
        // Halves: the extent of finite doubles may overflow.
        extent_ = std::max(extent_, high[k] / 2 - low_[k] / 2);
      }
    }
    if constexpr (std::is_integral_v<Coord> && kAxes == 2) {
      // The extent uses the key's first bit, so that no set is left in one cell.
      while (extent_ >> down_ >= kCells) ++down_;
      while (extent_ > 0 && extent_ << up_ < kCells / 2) ++up_;
    } else if constexpr (std::is_integral_v<Coord>) {
      // The points fill the cube, so that the middle of the curve is a plane that halves uniformly
      // spread points.
      scale_ = (std::uint64_t{1} << (32 + kBits)) / (static_cast<std::uint64_t>(extent_) + 1);
    }
  }

  /// All points are equal (or nearly so).
  [[nodiscard]] bool single() const { return !(extent_ > 0); }
  [[nodiscard]] std::uint32_t key(std::uint32_t number) const {
    const Point& p = points_[number];
    if constexpr (kAxes == 2) {
      return static_cast<std::uint32_t>(
          base::hilbert_index<kBits>(cell(p[0], low_[0]), cell(p[1], low_[1])));
    } else {
      return static_cast<std::uint32_t>(base::hilbert_index<kBits>(
          cell(p[0], low_[0]), cell(p[1], low_[1]), cell(p[2], low_[2])));
    }
  }

 private:
  static constexpr int kCells = 1 << kBits;
  [[nodiscard]] std::uint32_t cell(Coord c, Coord low) const {
    if constexpr (std::is_integral_v<Coord> && kAxes == 2) {
      return static_cast<std::uint32_t>(c - low) >> down_ << up_;
    } else if constexpr (std::is_integral_v<Coord>) {
      return static_cast<std::uint32_t>(static_cast<std::uint64_t>(c - low) * scale_ >> 32);
    } else {
      const double part = (c / 2 - low / 2) / extent_ * kCells;
      return static_cast<std::uint32_t>(std::min(part, kCells - 1.0));
    }
  }

  std::span<const Point> points_;
  Point low_;
  Coord extent_ = 0;
  unsigned down_ = 0, up_ = 0;  ///< shifts, for integers in the plane
  std::uint64_t scale_ = 0;     ///< cells of 2^-32 per unit, for integers in space
};

}  // namespace

template <class Point>
Pool<std::uint32_t> hilbert_order(std::span<const Point> points, unsigned threads) {
  Pool<std::uint32_t> order;
  order.resize(static_cast<std::uint32_t>(points.size()));
  const std::span<std::uint32_t> all = span_of(order);
  std::iota(all.begin(), all.end(), 0u);
  if (all.empty()) return order;
  sort_along_curve<Cells<Point>::kAxes * Cells<Point>::kBits>(
      all, [&](std::span<const std::uint32_t> range) { return Cells<Point>(points, range); },
      threads);
  return order;
}

template Pool<std::uint32_t> hilbert_order(std::span<const std::array<std::int32_t, 2>>, unsigned);
template Pool<std::uint32_t> hilbert_order(std::span<const std::array<std::int32_t, 3>>, unsigned);
template Pool<std::uint32_t> hilbert_order(std::span<const std::array<double, 2>>, unsigned);
template Pool<std::uint32_t> hilbert_order(std::span<const std::array<double, 3>>, unsigned);

}  // namespace terrace::tri
