// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "store/codec/coding.hpp"

/// Codes a multiset of points in a box of integers, without their order. The box is halved
/// repeatedly across its longest side, and the number of points in the lower half is coded, until a
/// box has one point, whose position is then coded uniformly, or is one cell.
/// Source: O. Devillers, P.-M. Gandoin, Geometric compression for interactive transmission, IEEE
/// Visualization 2000, doi:10.1109/VISUAL.2000.885711 (static tables by number of points here).

namespace terrace::stream::store {

/// Has sizes instead of upper ends, because the coder halves and codes sizes.
struct IntegerBox {
  std::array<std::uint64_t, 3> low{};
  std::array<std::uint64_t, 3> size{1, 1, 1};  ///< low + size is the first value above it
};

/// Codes how many of n points are in the lower half.
template <class Coder>
TERRACE_STORE_INLINE void code_split(Coder& coder, std::uint32_t n, std::uint32_t& below) {
  if (n < context::kSplitDirect) {
    unsigned symbol = below;
    code_symbol(coder, context::kSplit + n - 2, symbol);
    below = symbol;
  } else {
    const unsigned width = static_cast<unsigned>(std::bit_width(n));
    const std::int64_t half = n / 2;
    std::uint64_t number = zigzag(std::int64_t{below} - half);
    code_number(coder, context::kSplitWide + std::min(width - 6, 23u), number);
    const std::uint64_t value = static_cast<std::uint64_t>(half + unzigzag(number));
    below = value > n ? n + 1 : static_cast<std::uint32_t>(value);
  }
}

/// Decodes the points of a cluster. See the top of this file for the coding.
class SplitDecoder {
 public:
  /// Decodes n points in `box` into `at`, by coordinate.
  template <class Coder>
  void decode(Coder& coder, const IntegerBox& box, const std::array<std::uint64_t*, 3>& at,
              std::uint32_t n) {
    at_ = at;
    split(coder, box, 0, n);
  }

 private:
  template <class Coder>
  void split(Coder& coder, IntegerBox box, std::uint32_t first, std::uint32_t n) {
    // The lower half is handled recursively, the upper half by the loop: at most 192 deep.
    while (n > 1) {
      std::size_t axis = box.size[1] > box.size[0] ? 1 : 0;
      if (box.size[2] > box.size[axis]) axis = 2;
      if (box.size[axis] == 1) {
        for (std::size_t a = 0; a < 3; ++a) std::fill_n(at_[a] + first, n, box.low[a]);
        return;
      }
      const std::uint64_t lower = box.size[axis] - box.size[axis] / 2;
      std::uint32_t below = 0;
      code_split(coder, n, below);
      if (below > n) throw Damage("a part of a cluster has more points than the whole");
      IntegerBox half = box;
      half.size[axis] = lower;
      if (below > 0) split(coder, half, first, below);
      box.low[axis] += lower;
      box.size[axis] -= lower;
      first += below;
      n -= below;
    }
    if (n == 1) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::uint64_t value = 0;
        if (box.size[axis] > 1) code_uniform(coder, value, box.size[axis]);
        at_[axis][first] = box.low[axis] + value;
      }
    }
  }

  std::array<std::uint64_t*, 3> at_{};
};

/// A side of a box, as its axis and its size minus 1.
struct BoxSide {
  unsigned axis = 0;
  std::uint64_t extent = 0;
};

/// Points and boxes of SplitEncoder in registers, for clusters in which each coordinate and the
/// number of points fit 16 bits, as in nearly all.
struct NarrowPoints {
  /// The coordinates x, y, z from the highest bits on, then the point's number.
  using Point = std::uint64_t;
  struct Box {
    Point low = 0, extent = 0;  ///< size minus 1
  };
  struct Limit {
    Point field = 0, middle = 0;
  };

  static bool fit(const std::array<std::uint64_t, 3>& size, std::uint32_t n) {
    return n <= kField && *std::max_element(size.begin(), size.end()) <= kField + 1;
  }
  static Point point(std::uint64_t x, std::uint64_t y, std::uint64_t z, std::uint32_t number) {
    return x << 48 | y << 32 | z << 16 | number;
  }
  static std::uint32_t number(Point point) { return static_cast<std::uint32_t>(point & kField); }
  static Box box(const std::array<std::uint64_t, 3>& size) {
    return {0, point(size[0] - 1, size[1] - 1, size[2] - 1, 0)};
  }
  // Without branches, which would be unpredictable.
  TERRACE_STORE_INLINE static BoxSide longest(const Box& box) {
    // The first of equal sides wins.
    const auto rank = [&](unsigned axis) {
      return static_cast<std::int64_t>(field(box.extent, axis) << 2 | (2 - axis));
    };
    const std::int64_t longest_rank = larger(larger(rank(0), rank(1)), rank(2));
    return {2 - static_cast<unsigned>(longest_rank & 3),
            static_cast<std::uint64_t>(longest_rank) >> 2};
  }
  TERRACE_STORE_INLINE static Limit limit(const Box& box, const BoxSide& side) {
    const Point mask = kField << shift(side.axis);
    return {mask, (box.low & mask) + ((side.extent / 2 + 1) << shift(side.axis))};
  }
  TERRACE_STORE_INLINE static bool is_below(Point point, const Limit& limit) {
    return (point & limit.field) < limit.middle;
  }
  TERRACE_STORE_INLINE static Box half(const Box& box, const BoxSide& side, bool upper) {
    const Point lower = side.extent / 2;  // its size minus 1
    const Point extent = lower - (Point{upper} & ~side.extent);
    return {box.low + ((lower + 1) * Point{upper} << shift(side.axis)),
            box.extent - ((side.extent - extent) << shift(side.axis))};
  }
  TERRACE_STORE_INLINE static void exchange(Point& a, Point& b, bool whether) {
    const Point difference = (a ^ b) & (0 - Point{whether});
    a ^= difference;
    b ^= difference;
  }
  template <class Coder>
  TERRACE_STORE_INLINE static void code_in_box(Coder& coder, const Box& box, Point point) {
    const Point offset = point - box.low;
    RawBits bits;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const RawBits coded = uniform_bits(field(offset, axis), field(box.extent, axis) + 1);
      bits = {bits.value << coded.bits | coded.value, bits.bits + coded.bits};
    }
    coder.raw(bits.value, bits.bits);
  }

 private:
  static constexpr Point kField = 0xffff;

  TERRACE_STORE_INLINE static std::int64_t larger(std::int64_t a, std::int64_t b) {
    const std::int64_t difference = a - b;
    return a - (difference & difference >> 63);
  }
  TERRACE_STORE_INLINE static unsigned shift(unsigned axis) { return 48 - 16 * axis; }
  TERRACE_STORE_INLINE static Point field(Point point, unsigned axis) {
    return point >> shift(axis) & kField;
  }
};

/// Points and boxes of SplitEncoder in separate words, for all other clusters.
struct WidePoints {
  struct Point {
    std::array<std::uint64_t, 3> at;
    std::uint32_t number;
    bool operator<(const Point& other) const { return number < other.number; }
  };
  struct Box {
    std::array<std::uint64_t, 3> low{}, extent{};
  };
  struct Limit {
    unsigned axis = 0;
    std::uint64_t middle = 0;
  };

  static Point point(std::uint64_t x, std::uint64_t y, std::uint64_t z, std::uint32_t number) {
    return {{x, y, z}, number};
  }
  static std::uint32_t number(const Point& point) { return point.number; }
  static Box box(const std::array<std::uint64_t, 3>& size) {
    return {{}, {size[0] - 1, size[1] - 1, size[2] - 1}};
  }
  static BoxSide longest(const Box& box) {
    unsigned axis = box.extent[1] > box.extent[0] ? 1 : 0;
    if (box.extent[2] > box.extent[axis]) axis = 2;
    return {axis, box.extent[axis]};
  }
  static Limit limit(const Box& box, const BoxSide& side) {
    return {side.axis, box.low[side.axis] + side.extent / 2 + 1};
  }
  static bool is_below(const Point& point, const Limit& limit) {
    return point.at[limit.axis] < limit.middle;
  }
  static Box half(Box box, const BoxSide& side, bool upper) {
    if (upper) box.low[side.axis] += side.extent / 2 + 1;
    box.extent[side.axis] = upper ? (side.extent - 1) / 2 : side.extent / 2;
    return box;
  }
  static void exchange(Point& a, Point& b, bool whether) {
    if (whether) std::swap(a, b);
  }
  template <class Coder>
  static void code_in_box(Coder& coder, const Box& box, const Point& point) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const RawBits coded = uniform_bits(point.at[axis] - box.low[axis], box.extent[axis] + 1);
      coder.raw(coded.value, coded.bits);
    }
  }
};

/// Encodes the points of a cluster. Its memory is reused for the next one.
class SplitEncoder {
 public:
  /// Encodes n points in a box of these sizes, whose low side is 0; at(axis, i) is a coordinate of
  /// point i. Fills `order` with the numbers of the points in the order of coding; points at one
  /// place are in ascending order.
  template <class Coder, class At>
  void encode(Coder& coder, const std::array<std::uint64_t, 3>& size, At&& at, std::uint32_t n,
              std::uint32_t* order) {
    if (NarrowPoints::fit(size, n)) {
      Run<Coder, NarrowPoints>{coder, order}.encode(size, at, n, narrow_);
    } else {
      Run<Coder, WidePoints>{coder, order}.encode(size, at, n, wide_);
    }
  }

 private:
  template <class Coder, class Points>
  struct Run {
    using Point = typename Points::Point;
    using Box = typename Points::Box;

    Coder& coder;
    std::uint32_t* order;  ///< where to put the numbers of the next points

    template <class At>
    void encode(const std::array<std::uint64_t, 3>& size, At&& at, std::uint32_t n,
                std::vector<Point>& points) {
      points.resize(2 * std::size_t{n});
      for (std::uint32_t i = 0; i < n; ++i) {
        points[i] = Points::point(at(0, i), at(1, i), at(2, i), i);
      }
      split(Points::box(size), points.data(), points.data() + n, n);
    }

    /// Codes n points. `room` must have room for as many.
    void split(Box box, Point* points, Point* room, std::uint32_t n) {
      // The lower half is handled recursively, the upper half by the loop: at most 192 deep.
      while (n > 3) {
        const BoxSide side = Points::longest(box);
        if (side.extent == 0) return finish(points, n);
        std::uint32_t below = partition(points, room, n, Points::limit(box, side));
        code_split(coder, n, below);
        n -= below;
        if (below > 0) split(Points::half(box, side, false), points, room + n, below);
        box = Points::half(box, side, true);
        points += below;
        std::swap(points, room);
      }
      switch (n) {
        case 1:
          return code_in_box(box, points[0]);
        case 2:
          return split_two(box, points[0], points[1]);
        case 3:
          return split_three(box, points);
        default:
          return;
      }
    }

    // Most boxes have two or three points. Special cases for them save branches, half of which
    // would be mispredicted.
    void split_two(Box box, Point a, Point b) {
      for (;;) {
        const BoxSide side = Points::longest(box);
        if (side.extent == 0) return finish(std::array<Point, 2>{a, b}.data(), 2);
        const typename Points::Limit limit = Points::limit(box, side);
        const bool first = Points::is_below(a, limit), second = Points::is_below(b, limit);
        coder.symbol(context::kSplit, 0u + first + second);
        if (first != second) {
          Points::exchange(a, b, second);
          code_in_box(Points::half(box, side, false), a);
          return code_in_box(Points::half(box, side, true), b);
        }
        box = Points::half(box, side, !first);
      }
    }

    void split_three(Box box, Point* points) {
      std::array<Point, 3> room;
      for (;;) {
        const BoxSide side = Points::longest(box);
        if (side.extent == 0) return finish(points, 3);
        const std::uint32_t below = partition(points, room.data(), 3, Points::limit(box, side));
        coder.symbol(context::kSplit + 1, below);
        if (below == 1) {
          code_in_box(Points::half(box, side, false), points[0]);
          return split_two(Points::half(box, side, true), room[0], room[1]);
        }
        if (below == 2) {
          split_two(Points::half(box, side, false), points[0], points[1]);
          return code_in_box(Points::half(box, side, true), room[0]);
        }
        if (below == 0) std::copy(room.begin(), room.end(), points);
        box = Points::half(box, side, below == 0);
      }
    }

    void code_in_box(const Box& box, const Point& point) {
      Points::code_in_box(coder, box, point);
      *order++ = Points::number(point);
    }

    /// Ends a box whose points are all at one place.
    void finish(Point* points, std::uint32_t n) {
      std::sort(points, points + n);
      for (std::uint32_t i = 0; i < n; ++i) *order++ = Points::number(points[i]);
    }

    /// Keeps the points below the limit, moves the others to `above` and returns how many are
    /// below. Writes every point to both, because a branch would be unpredictable. Does not read
    /// anything it wrote, which would stall.
    static std::uint32_t partition(Point* points, Point* above, std::uint32_t n,
                                   const typename Points::Limit& limit) {
      std::uint32_t below = 0;
      for (std::uint32_t i = 0; i < n; ++i) {
        const Point point = points[i];
        points[below] = point;
        above[i - below] = point;
        below += Points::is_below(point, limit) ? 1 : 0;
      }
      return below;
    }
  };

  // The points, followed by room for as many.
  std::vector<NarrowPoints::Point> narrow_;
  std::vector<WidePoints::Point> wide_;
};

}  // namespace terrace::stream::store
