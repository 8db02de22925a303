// SPDX-License-Identifier: Apache-2.0
#include "hilbert.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <type_traits>
#include <vector>

#include <terrace/base/hilbert.hpp>

#include "../curve_sort.hpp"

namespace terrace::tri::spatial {
namespace {

constexpr unsigned kBits = 10;  ///< of a key, per axis

/// Maps points of a set to cells of its bounding cube. The points fill the cube, so that the middle
/// of the curve is a plane that halves uniformly spread points.
template <class Coord>
class Cells {
 public:
  using Point = std::array<Coord, 3>;

  Cells(std::span<const Point> points, std::span<const std::uint32_t> order) : points_(points) {
    Point high = points[order[0]];
    low_ = high;
    for (const std::uint32_t i : order) {
      for (std::size_t k = 0; k < 3; ++k) {
        low_[k] = std::min(low_[k], points[i][k]);
        high[k] = std::max(high[k], points[i][k]);
      }
    }
    if constexpr (std::is_integral_v<Coord>) {
      extent_ = std::max({high[0] - low_[0], high[1] - low_[1], high[2] - low_[2]});
      scale_ = (std::uint64_t{1} << (32 + kBits)) / (static_cast<std::uint64_t>(extent_) + 1);
      single_ = extent_ == 0;
    } else {
      // Uses halves: the extent of finite doubles may overflow.
      extent_ = std::max(
          {high[0] / 2 - low_[0] / 2, high[1] / 2 - low_[1] / 2, high[2] / 2 - low_[2] / 2});
      single_ = !(extent_ > 0);
    }
  }

  /// All points are equal (or nearly so).
  [[nodiscard]] bool single() const { return single_; }
  [[nodiscard]] std::uint32_t key(std::uint32_t number) const {
    const Point& p = points_[number];
    return static_cast<std::uint32_t>(
        base::hilbert_index<kBits>(cell(p[0], low_[0]), cell(p[1], low_[1]), cell(p[2], low_[2])));
  }

 private:
  [[nodiscard]] std::uint32_t cell(Coord c, Coord low) const {
    if constexpr (std::is_integral_v<Coord>) {
      return static_cast<std::uint32_t>(static_cast<std::uint64_t>(c - low) * scale_ >> 32);
    } else {
      constexpr double kCells = 1 << kBits;
      const double part = (c / 2 - low / 2) / extent_ * kCells;
      return static_cast<std::uint32_t>(std::min(part, kCells - 1));
    }
  }

  std::span<const Point> points_;
  Point low_;
  Coord extent_ = 0;
  std::uint64_t scale_ = 0;  ///< cells of 2^-32 per unit, for integers
  bool single_ = false;
};

}  // namespace

template <class Coord>
Pool<std::uint32_t> hilbert_order(std::span<const std::array<Coord, 3>> points, unsigned threads) {
  Pool<std::uint32_t> order;
  order.resize(static_cast<std::uint32_t>(points.size()));
  const std::span<std::uint32_t> all = span_of(order);
  std::iota(all.begin(), all.end(), 0u);
  if (all.empty()) return order;
  sort_along_curve<3 * kBits>(
      all, [&](std::span<const std::uint32_t> range) { return Cells<Coord>(points, range); },
      threads);
  return order;
}

#ifdef TERRACE_TRI_CORE
template Pool<std::uint32_t> hilbert_order(std::span<const std::array<std::int32_t, 3>>, unsigned);
#else
template Pool<std::uint32_t> hilbert_order(std::span<const std::array<double, 3>>, unsigned);
#endif

}  // namespace terrace::tri::spatial
