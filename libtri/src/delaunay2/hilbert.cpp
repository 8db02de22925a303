// SPDX-License-Identifier: GPL-3.0-or-later
#include "hilbert.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <type_traits>
#include <vector>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "int_kernel.hpp"

namespace terrace::tri::planar {
namespace {

struct Entry {
  std::uint32_t key;
  std::uint32_t number;
};

/// Runs of equal keys up to this length stay as they are.
constexpr std::size_t kLeaf = 16;
/// Below this, counters would cost more than points.
constexpr std::uint32_t kFew = 3000;

/// One step down the curve: by orientation of the present square (4) and quadrant (4; x above y),
/// the quadrant's place on the curve, and the orientation of the square there.
struct Step {
  std::uint8_t place;
  std::uint8_t orientation;
};

/// The curve enters each square at one corner and leaves at a neighbouring one. Orientation bit 0:
/// x and y are swapped; bit 1: both are mirrored.
constexpr Step single_step(unsigned orientation, unsigned x, unsigned y) {
  if ((orientation & 2) != 0) {
    x ^= 1;
    y ^= 1;
  }
  if ((orientation & 1) != 0) std::swap(x, y);
  // The basic square: (0,0) transposed, (0,1), (1,1), (1,0) transposed and mirrored.
  const unsigned place = x == 0 ? y : 3 - y;
  const unsigned turn = place == 0 ? 1u : place == 3 ? 3u : 0u;
  return {static_cast<std::uint8_t>(place), static_cast<std::uint8_t>(orientation ^ turn)};
}

/// Four steps at once: 4 bits of x, 4 bits of y.
struct FourSteps {
  std::uint8_t places;
  std::uint8_t orientation;
};
constexpr std::array<FourSteps, 4 * 256> make_table() {
  std::array<FourSteps, 4 * 256> table{};
  for (unsigned start = 0; start < 4; ++start) {
    for (unsigned xy = 0; xy < 256; ++xy) {
      unsigned orientation = start;
      unsigned places = 0;
      for (unsigned bit = 4; bit-- > 0;) {
        const Step step = single_step(orientation, xy >> (4 + bit) & 1, xy >> bit & 1);
        places = places << 2 | step.place;
        orientation = step.orientation;
      }
      table[start * 256 + xy] = {static_cast<std::uint8_t>(places),
                                 static_cast<std::uint8_t>(orientation)};
    }
  }
  return table;
}
constexpr auto kTable = make_table();

/// Place of a cell of a 2^16 x 2^16 raster on the curve.
std::uint32_t hilbert_key(std::uint32_t x, std::uint32_t y) {
  std::uint32_t key = 0;
  std::uint32_t orientation = 0;
  for (unsigned shift = 12;; shift -= 4) {
    const FourSteps& step = kTable[orientation * 256 + (x >> shift & 15) * 16 + (y >> shift & 15)];
    key = key << 8 | step.places;
    orientation = step.orientation;
    if (shift == 0) return key;
  }
}

/// Maps points of a set to cells of its bounding square.
template <class Kernel>
class Cells {
 public:
  using Point = typename Kernel::Point;
  using Coord = typename Kernel::Coord;

  template <class Numbers>
  Cells(std::span<const Point> points, const Numbers& numbers) {
    Point high = points[numbers(0)];
    low_ = high;
    for (std::size_t i = 1; i < numbers.size; ++i) {
      const Point& p = points[numbers(i)];
      for (std::size_t k = 0; k < 2; ++k) {
        low_[k] = std::min(low_[k], p[k]);
        high[k] = std::max(high[k], p[k]);
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

  /// All points are equal (or as good as).
  [[nodiscard]] bool single() const { return single_; }
  [[nodiscard]] std::uint32_t key(const Point& p) const {
    return hilbert_key(cell(p[0], low_[0]), cell(p[1], low_[1]));
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

  Point low_;
  Coord extent_ = 0;
  unsigned down_ = 0;
  unsigned up_ = 0;
  bool single_ = false;
};

/// Stable, least significant digit first: `passes` passes of kBits bits.
template <unsigned kBits, unsigned kPasses>
void radix_sort(Pool<Entry>& entries) {
  constexpr std::size_t kDigits = std::size_t{1} << kBits;
  std::array<std::array<std::uint32_t, kDigits>, kPasses> start{};
  for (const Entry& entry : span_of(entries))
    for (unsigned pass = 0; pass < kPasses; ++pass)
      ++start[pass][entry.key >> (kBits * pass) & (kDigits - 1)];
  for (auto& counters : start)
    std::exclusive_scan(counters.begin(), counters.end(), counters.begin(), 0u);
  Pool<Entry> other;
  other.resize(entries.size());
  for (unsigned pass = 0; pass < kPasses; ++pass) {
    for (const Entry& entry : span_of(entries))
      other[start[pass][entry.key >> (kBits * pass) & (kDigits - 1)]++] = entry;
    std::swap(entries, other);
  }
}

/// Sorts order[begin, end). Each level tells 16 more bits apart, so it is never deep.
template <class Kernel>
void sort_range(std::span<const typename Kernel::Point> points, std::span<std::uint32_t> order) {
  struct Numbers {
    std::span<std::uint32_t> order;
    std::size_t size;
    std::uint32_t operator()(std::size_t i) const { return order[i]; }
  };
  const Cells<Kernel> cells(points, Numbers{order, order.size()});
  if (cells.single()) return;
  const auto count = static_cast<std::uint32_t>(order.size());
  Pool<Entry> entries;
  entries.resize(count);
  // Few points are told apart by the curve's coarse cells, and if not, in the runs below.
  const bool few = count < kFew;
  const unsigned shift = few ? 16 : 0;
  for (std::uint32_t i = 0; i < count; ++i)
    entries[i] = {cells.key(points[order[i]]) >> shift, order[i]};
  if (few) {
    radix_sort<8, 2>(entries);
  } else {
    radix_sort<11, 3>(entries);
  }
  // Entries are gone before the runs are sorted, so that memory does not add up.
  std::vector<std::span<std::uint32_t>> long_runs;
  std::uint32_t begin = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    order[i] = entries[i].number;
    if (i + 1 == count || entries[i + 1].key != entries[i].key) {
      if (i + 1 - begin > kLeaf) long_runs.push_back(order.subspan(begin, i + 1 - begin));
      begin = i + 1;
    }
  }
  entries.release();
  for (const std::span<std::uint32_t> run : long_runs) sort_range<Kernel>(points, run);
}

}  // namespace

template <class Kernel>
Pool<std::uint32_t> hilbert_order(std::span<const typename Kernel::Point> points) {
  Pool<std::uint32_t> order;
  order.resize(static_cast<std::uint32_t>(points.size()));
  const std::span<std::uint32_t> all = span_of(order);
  std::iota(all.begin(), all.end(), 0u);
  if (!all.empty()) sort_range<Kernel>(points, all);
  return order;
}

template Pool<std::uint32_t> hilbert_order<IntKernel>(std::span<const IntKernel::Point>);
template Pool<std::uint32_t> hilbert_order<DoubleKernel>(std::span<const DoubleKernel::Point>);
template Pool<std::uint32_t> hilbert_order<EllipticalKernel>(
    std::span<const EllipticalKernel::Point>);

}  // namespace terrace::tri::planar
