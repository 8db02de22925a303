// SPDX-License-Identifier: Apache-2.0
#include "order/kd_cut.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>

#include <terrace/base/box.hpp>

namespace terrace::stream {
namespace {

/// Bins in which coordinates are counted to find the one of a given rank.
constexpr std::size_t kRankBins = 1024;

template <class Coordinate>
double width(const base::Box<3, Coordinate>& box, std::size_t axis) {
  return static_cast<double>(box.max[axis]) - static_cast<double>(box.min[axis]);
}

/// Divides an axis into bins, in ascending order.
template <class Coordinate>
class RankBins {
 public:
  RankBins(const base::Box<3, Coordinate>& box, std::size_t axis) : low_(box.min[axis]) {
    if (width(box, axis) > 0) bins_per_unit_ = kRankBins / width(box, axis);
  }

  /// Returns the bin of a value: the last one for a NaN, which results from infinities.
  [[nodiscard]] std::size_t of(Coordinate value) const {
    const double bin = (value - low_) * bins_per_unit_;
    return bin < kRankBins ? static_cast<std::size_t>(bin) : kRankBins - 1;
  }

 private:
  double low_, bins_per_unit_ = 0;
};

template <>
class RankBins<std::int32_t> {
 public:
  RankBins(const base::Box<3, std::int32_t>& box, std::size_t axis)
      : low_(static_cast<std::uint32_t>(box.min[axis])),
        bins_per_unit_((std::uint64_t{kRankBins} << 32) /
                       (static_cast<std::uint64_t>(width(box, axis)) + 1)) {}

  [[nodiscard]] std::size_t of(std::int32_t value) const {
    return (static_cast<std::uint32_t>(value) - low_) * bins_per_unit_ >> 32;
  }

 private:
  std::uint32_t low_;
  std::uint64_t bins_per_unit_;  ///< times 2^32
};

/// Exchanges values by words. Loading a value as a whole would stall on members that were just
/// stored one by one.
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

/// Compares by the coordinate, then by number.
template <class Point>
bool comes_before(const Point& a, const Point& b, std::size_t axis) {
  return a.place[axis] != b.place[axis] ? a.place[axis] < b.place[axis] : a.number < b.number;
}

/// Moves the points for which `is_before` holds before the others; returns their number.
template <class Point, class IsBefore>
std::size_t partition(std::span<Point> points, const IsBefore& is_before) {
  std::size_t before = 0;
  for (Point& point : points) {
    // Always exchanged, because a branch would be unpredictable.
    const bool first = is_before(point, before);
    exchange(point, points[before]);
    before += first ? 1 : 0;
  }
  return before;
}

/// Moves the `first` lowest points along the widest axis before the others, and returns the plane
/// at which the others begin. Requires first < points.size(), unless there are no points.
template <class Coordinate>
KdPlane divide(std::span<Numbered<Coordinate>> points, std::size_t first,
               const std::array<double, 3>& lengths) {
  using Point = Numbered<Coordinate>;
  if (points.empty()) return {};
  base::Box<3, Coordinate> box;
  for (const Point& point : points) box.include(point.place);
  std::size_t axis = 0;
  double longest = -1;
  for (std::size_t a = 0; a < 3; ++a) {
    const double length = width(box, a) * lengths[a];
    if (length > longest) {
      longest = length;
      axis = a;
    }
  }
  const RankBins<Coordinate> bins(box, axis);
  std::array<std::uint32_t, kRankBins> counts{};
  for (const Point& point : points) ++counts[bins.of(point.place[axis])];
  std::size_t middle = 0, begin = 0;
  for (; begin + counts[middle] <= first; ++middle) begin += counts[middle];
  // Only the points in bin `middle` are compared with one another.
  const auto order = [axis](const Point& a, const Point& b) { return comes_before(a, b, axis); };
  const auto select = [&](std::span<Point> in_middle) {
    const auto middle_point = in_middle.begin() + static_cast<std::ptrdiff_t>(first - begin);
    std::nth_element(in_middle.begin(), middle_point, in_middle.end(), order);
    return *middle_point;
  };
  if constexpr (std::is_same_v<Coordinate, double>) {
    // The order on both sides matters when a window is thinned, so it must depend only on the
    // ranks.
    std::vector<Point> in_middle;
    in_middle.reserve(counts[middle]);
    for (const Point& point : points) {
      if (bins.of(point.place[axis]) == middle) in_middle.push_back(point);
    }
    const Point at_plane = select(in_middle);
    partition(points, [&](const Point& point, std::size_t) { return order(point, at_plane); });
    return {axis, at_plane.place[axis]};
  } else {
    // Saves a pass: first moves all points up to the bin before the others, then those in the bin
    // to the end of these.
    std::vector<std::size_t> in_middle(counts[middle] + 1);
    std::size_t count = 0;
    std::size_t end = partition(points, [&](const Point& point, std::size_t at) {
      const std::size_t bin = bins.of(point.place[axis]);
      in_middle[count] = at;
      count += bin == middle ? 1 : 0;
      return bin <= middle;
    });
    while (count > 0) exchange(points[in_middle[--count]], points[--end]);
    return {axis, static_cast<double>(select(points.subspan(begin, counts[middle])).place[axis])};
  }
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

void build_planes(std::span<NumberedPoint> points, std::size_t node,
                  const std::array<double, 3>& lengths, std::vector<KdPlane>& planes) {
  if (node >= planes.size() || points.empty()) return;
  const std::size_t first = points.size() / 2;
  planes[node] = divide(points, first, lengths);
  build_planes(points.first(first), 2 * node + 1, lengths, planes);
  build_planes(points.subspan(first), 2 * node + 2, lengths, planes);
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
  build_planes(points, 0, lengths, planes);
  return planes;
}

}  // namespace terrace::stream
