// SPDX-License-Identifier: Apache-2.0
#include "hilbert.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <type_traits>
#include <vector>

#include <terrace/base/hilbert.hpp>

#include "../curve_sort.hpp"

namespace terrace::tri::planar {
namespace {

/// Maps points of a set to cells of its bounding square.
template <class Coord>
class Cells {
 public:
  using Point = std::array<Coord, 2>;

  Cells(std::span<const Point> points, std::span<const std::uint32_t> order) : points_(points) {
    Point high = points[order[0]];
    low_ = high;
    for (const std::uint32_t i : order) {
      for (std::size_t k = 0; k < 2; ++k) {
        low_[k] = std::min(low_[k], points[i][k]);
        high[k] = std::max(high[k], points[i][k]);
      }
    }
    if constexpr (std::is_integral_v<Coord>) {
      const Coord extent = std::max(high[0] - low_[0], high[1] - low_[1]);
      // The extent uses the key's first bit, so that no set is left in one cell.
      while (extent >> down_ > 0xFFFF) ++down_;
      while (extent > 0 && extent << up_ < 0x8000) ++up_;
      single_ = extent == 0;
    } else {
      // Halves: the extent of finite doubles may overflow.
      extent_ = std::max(high[0] / 2 - low_[0] / 2, high[1] / 2 - low_[1] / 2);
      single_ = !(extent_ > 0);
    }
  }

  /// All points are equal (or nearly so).
  [[nodiscard]] bool single() const { return single_; }
  [[nodiscard]] std::uint32_t key(std::uint32_t number) const {
    const Point& p = points_[number];
    return static_cast<std::uint32_t>(
        base::hilbert_index<16>(cell(p[0], low_[0]), cell(p[1], low_[1])));
  }

 private:
  [[nodiscard]] std::uint32_t cell(Coord c, Coord low) const {
    if constexpr (std::is_integral_v<Coord>) {
      return static_cast<std::uint32_t>(c - low) >> down_ << up_;
    } else {
      const double part = (c / 2 - low / 2) / extent_ * 65536;
      return part < 65535 ? static_cast<std::uint32_t>(part) : 65535;
    }
  }

  std::span<const Point> points_;
  Point low_;
  Coord extent_ = 0;
  unsigned down_ = 0;
  unsigned up_ = 0;
  bool single_ = false;
};

}  // namespace

template <class Coord>
Pool<std::uint32_t> hilbert_order(std::span<const std::array<Coord, 2>> points) {
  Pool<std::uint32_t> order;
  order.resize(static_cast<std::uint32_t>(points.size()));
  const std::span<std::uint32_t> all = span_of(order);
  std::iota(all.begin(), all.end(), 0u);
  if (all.empty()) return order;
  sort_along_curve<32>(
      all, [&](std::span<const std::uint32_t> range) { return Cells<Coord>(points, range); });
  return order;
}

#ifdef TERRACE_TRI_CORE
template Pool<std::uint32_t> hilbert_order(std::span<const std::array<std::int32_t, 2>>);
#else
template Pool<std::uint32_t> hilbert_order(std::span<const std::array<double, 2>>);
#endif

}  // namespace terrace::tri::planar
