// SPDX-License-Identifier: Apache-2.0
#include "hilbert.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <type_traits>
#include <vector>

#include "../curve_sort.hpp"

namespace terrace::tri::spatial {
namespace {

constexpr unsigned kBits = 10;  ///< of a key, per axis

/// One step down the curve: the octant's position on it, and the state of the cube there. A state
/// is the corner where the curve enters and the axis along which it leaves (C. Hamilton, A.
/// Rau-Chaplin, "Compact Hilbert indices", doi:10.1016/j.ipl.2007.08.034): 8 * axis + corner.
struct Step {
  std::uint8_t place;
  std::uint8_t state;
};

constexpr unsigned rotated_left(unsigned bits, unsigned by) {
  by %= 3;
  return (bits << by | bits >> (3 - by)) & 7;
}
constexpr unsigned rotated_right(unsigned bits, unsigned by) {
  return rotated_left(bits, 3 - by % 3);
}
constexpr unsigned gray(unsigned i) { return i ^ i >> 1; }
constexpr unsigned trailing_ones(unsigned i) { return static_cast<unsigned>(std::countr_one(i)); }

constexpr Step single_step(unsigned state, unsigned octant) {
  const unsigned corner = state % 8;
  const unsigned axis = state / 8;
  const unsigned code = rotated_right(octant ^ corner, axis + 1);
  unsigned place = 0;
  while (gray(place) != code) ++place;
  const unsigned entry = place == 0 ? 0 : gray((place - 1) / 2 * 2);
  const unsigned along = place == 0       ? 0
                         : place % 2 == 0 ? trailing_ones(place - 1) % 3
                                          : trailing_ones(place) % 3;
  const unsigned next_corner = corner ^ rotated_left(entry, axis + 1);
  const unsigned next_axis = (axis + along + 1) % 3;
  return {static_cast<std::uint8_t>(place), static_cast<std::uint8_t>(8 * next_axis + next_corner)};
}

constexpr std::array<Step, 24 * 8> make_table() {
  std::array<Step, 24 * 8> table{};
  for (unsigned state = 0; state < 24; ++state)
    for (unsigned octant = 0; octant < 8; ++octant)
      table[state * 8 + octant] = single_step(state, octant);
  return table;
}
constexpr auto kTable = make_table();

/// Position on the curve of a cell of a cube with 2^10 cells along each edge.
std::uint32_t hilbert_key(const std::array<std::uint32_t, 3>& cell) {
  std::uint32_t key = 0;
  std::uint32_t state = 0;
  for (unsigned bit = kBits; bit-- > 0;) {
    const std::uint32_t octant =
        (cell[0] >> bit & 1) << 2 | (cell[1] >> bit & 1) << 1 | (cell[2] >> bit & 1);
    const Step& step = kTable[state * 8 + octant];
    key = key << 3 | step.place;
    state = step.state;
  }
  return key;
}

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
    return hilbert_key({cell(p[0], low_[0]), cell(p[1], low_[1]), cell(p[2], low_[2])});
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
