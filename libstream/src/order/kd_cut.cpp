// SPDX-License-Identifier: Apache-2.0
#include "order/kd_cut.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>

namespace terrace::stream {
namespace {

/// Parts of a box in which coordinates are counted to find one of a given rank.
constexpr std::size_t kRankBins = 1024;

template <class Coordinate>
struct RankedPlace {
  Coordinate value;
  std::uint64_t number;

  // Without branches, which would be coin tosses.
  friend bool operator<(const RankedPlace& a, const RankedPlace& b) {
    return (a.value < b.value) | ((a.value == b.value) & (a.number < b.number));
  }
};

template <class Coordinate>
struct Extent {
  using Limits = std::numeric_limits<Coordinate>;
  static constexpr Coordinate kMost = Limits::has_infinity ? Limits::infinity() : Limits::max();
  static constexpr Coordinate kLeast = Limits::has_infinity ? -Limits::infinity() : Limits::min();

  std::array<Coordinate, 3> min{kMost, kMost, kMost}, max{kLeast, kLeast, kLeast};

  explicit Extent(std::span<const Numbered<Coordinate>> points) {
    for (const Numbered<Coordinate>& point : points) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Coordinate value = point.place[axis];
        min[axis] = value < min[axis] ? value : min[axis];
        max[axis] = value > max[axis] ? value : max[axis];
      }
    }
  }
  [[nodiscard]] double width(std::size_t axis) const {
    return static_cast<double>(max[axis]) - static_cast<double>(min[axis]);
  }
};

/// The part of [low, ...] in which a value lies; not a number, which infinities make: the last.
std::size_t rank_bin(double value, double low, double bins_per_unit) {
  const double bin = (value - low) * bins_per_unit;
  return bin < kRankBins ? static_cast<std::size_t>(bin) : kRankBins - 1;
}

/// The place that `first` others come before along the axis. Only those that share its part of the
/// extent are sorted.
template <class Coordinate>
RankedPlace<Coordinate> place_of_rank(std::span<const Numbered<Coordinate>> points,
                                      std::size_t first, std::size_t axis,
                                      const Extent<Coordinate>& extent) {
  const auto low = static_cast<double>(extent.min[axis]);
  const double width = extent.width(axis), bins_per_unit = width > 0 ? kRankBins / width : 0;
  const auto bin_of = [&](const Numbered<Coordinate>& point) {
    return rank_bin(static_cast<double>(point.place[axis]), low, bins_per_unit);
  };
  std::array<std::uint32_t, kRankBins> counts{};
  for (const auto& point : points) ++counts[bin_of(point)];
  std::size_t bin = 0;
  for (; first >= counts[bin]; ++bin) first -= counts[bin];
  std::vector<RankedPlace<Coordinate>> places;
  places.reserve(counts[bin]);
  for (const auto& point : points) {
    if (bin_of(point) == bin) places.push_back({point.place[axis], point.number});
  }
  const auto found = places.begin() + static_cast<std::ptrdiff_t>(first);
  std::nth_element(places.begin(), found, places.end());
  return *found;
}

/// By words: parts that are stored one by one would be waited for when they are loaded as a whole.
template <class Value>
void exchange(Value& a, Value& b) {
  using Words = std::array<std::uint64_t, sizeof(Value) / sizeof(std::uint64_t)>;
  static_assert(sizeof(Words) == sizeof(Value));
  Words of_a, of_b;
  std::memcpy(&of_a, &a, sizeof a);
  std::memcpy(&of_b, &b, sizeof b);
  std::memcpy(&a, &of_b, sizeof a);
  std::memcpy(&b, &of_a, sizeof b);
}

/// Puts the `first` points that come first along the widest axis before the others, which begin at
/// the plane returned. Requires first < points.size(), unless there are no points.
template <class Coordinate>
KdPlane divide(std::span<Numbered<Coordinate>> points, std::size_t first,
               const std::array<double, 3>& lengths) {
  if (points.empty()) return {};
  const Extent<Coordinate> extent(points);
  std::size_t axis = 0;
  double most = -1;
  for (std::size_t a = 0; a < 3; ++a) {
    const double width = extent.width(a) * lengths[a];
    if (width > most) {
      most = width;
      axis = a;
    }
  }
  const RankedPlace<Coordinate> middle = place_of_rank<Coordinate>(points, first, axis, extent);
  std::size_t before = 0;
  for (Numbered<Coordinate>& point : points) {
    // Exchanged always: a branch would be a coin toss.
    const bool is_before = RankedPlace<Coordinate>{point.place[axis], point.number} < middle;
    exchange(point, points[before]);
    before += is_before ? 1 : 0;
  }
  return {axis, static_cast<double>(middle.value)};
}

template <class Coordinate>
void cut(std::span<Numbered<Coordinate>> points, std::size_t pieces,
         const std::array<double, 3>& lengths, std::vector<std::size_t>& begins,
         std::size_t begin) {
  if (pieces < 2) {
    begins.push_back(begin);
    return;
  }
  const std::size_t left = pieces / 2;
  const std::size_t first = points.size() * left / pieces;
  divide(points, first, lengths);
  cut(points.first(first), left, lengths, begins, begin);
  cut(points.subspan(first), pieces - left, lengths, begins, begin + first);
}

void plant(std::span<NumberedPoint> points, std::size_t node, const std::array<double, 3>& lengths,
           std::vector<KdPlane>& planes) {
  if (node >= planes.size() || points.empty()) return;
  const std::size_t first = points.size() / 2;
  planes[node] = divide(points, first, lengths);
  plant(points.first(first), 2 * node + 1, lengths, planes);
  plant(points.subspan(first), 2 * node + 2, lengths, planes);
}

}  // namespace

template <class Coordinate>
std::vector<std::size_t> cut_in_pieces(std::span<Numbered<Coordinate>> points, std::size_t pieces,
                                       const std::array<double, 3>& lengths) {
  assert(pieces >= 1);
  std::vector<std::size_t> begins;
  begins.reserve(pieces + 1);
  cut(points, pieces, lengths, begins, 0);
  begins.push_back(points.size());
  return begins;
}
template std::vector<std::size_t> cut_in_pieces(std::span<NumberedPoint>, std::size_t,
                                                const std::array<double, 3>&);
template std::vector<std::size_t> cut_in_pieces(std::span<NumberedIntegers>, std::size_t,
                                                const std::array<double, 3>&);

std::vector<KdPlane> kd_planes(std::span<NumberedPoint> points, unsigned depth,
                               const std::array<double, 3>& lengths) {
  std::vector<KdPlane> planes((std::size_t{1} << depth) - 1);
  plant(points, 0, lengths, planes);
  return planes;
}

}  // namespace terrace::stream
