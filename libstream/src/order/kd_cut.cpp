// SPDX-License-Identifier: Apache-2.0
#include "order/kd_cut.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace terrace::stream {
namespace {

/// Parts of a box in which coordinates are counted to find one of a given rank.
constexpr std::size_t kRankBins = 1024;

struct RankedPlace {
  double value;
  std::uint64_t number;

  friend bool operator<(const RankedPlace& a, const RankedPlace& b) {
    return a.value != b.value ? a.value < b.value : a.number < b.number;
  }
};

/// The part of [low, ...] in which a value lies; not a number, which infinities make: the last.
std::size_t rank_bin(double value, double low, double bins_per_unit) {
  const double bin = (value - low) * bins_per_unit;
  return bin < kRankBins ? static_cast<std::size_t>(bin) : kRankBins - 1;
}

/// The place that `first` others come before along the axis. Only those that share its part of the
/// extent are sorted.
RankedPlace place_of_rank(std::span<const NumberedPoint> points, std::size_t first,
                          std::size_t axis, double low, double high) {
  const double bins_per_unit = high > low ? kRankBins / (high - low) : 0;
  std::array<std::uint32_t, kRankBins> counts{};
  for (const NumberedPoint& p : points) ++counts[rank_bin(p.place[axis], low, bins_per_unit)];
  std::size_t bin = 0;
  for (; first >= counts[bin]; ++bin) first -= counts[bin];
  std::vector<RankedPlace> places;
  places.reserve(counts[bin]);
  for (const NumberedPoint& p : points) {
    if (rank_bin(p.place[axis], low, bins_per_unit) == bin) {
      places.push_back({p.place[axis], p.number});
    }
  }
  const auto found = places.begin() + static_cast<std::ptrdiff_t>(first);
  std::nth_element(places.begin(), found, places.end());
  return *found;
}

/// Puts the `first` points that come first along the widest axis before the others, which begin at
/// the plane returned. Requires first < points.size(), unless there are no points.
KdPlane divide(std::span<NumberedPoint> points, std::size_t first,
               const std::array<double, 3>& lengths) {
  if (points.empty()) return {};
  Box3 box;
  for (const NumberedPoint& point : points) box.include(point.place);
  std::size_t axis = 0;
  double most = -1;
  for (std::size_t a = 0; a < 3; ++a) {
    const double width = (box.max[a] - box.min[a]) * lengths[a];
    if (width > most) {
      most = width;
      axis = a;
    }
  }
  const RankedPlace middle = place_of_rank(points, first, axis, box.min[axis], box.max[axis]);
  std::size_t before = 0;
  for (NumberedPoint& point : points) {
    // Exchanged always: a branch would be a coin toss.
    const bool is_before = RankedPlace{point.place[axis], point.number} < middle;
    std::swap(point, points[before]);
    before += is_before ? 1 : 0;
  }
  return {axis, middle.value};
}

void cut(std::span<NumberedPoint> points, std::size_t pieces, const std::array<double, 3>& lengths,
         std::vector<std::size_t>& begins, std::size_t begin) {
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

std::vector<std::size_t> cut_in_pieces(std::span<NumberedPoint> points, std::size_t pieces,
                                       const std::array<double, 3>& lengths) {
  assert(pieces >= 1);
  std::vector<std::size_t> begins;
  begins.reserve(pieces + 1);
  cut(points, pieces, lengths, begins, 0);
  begins.push_back(points.size());
  return begins;
}

std::vector<KdPlane> kd_planes(std::span<NumberedPoint> points, unsigned depth,
                               const std::array<double, 3>& lengths) {
  std::vector<KdPlane> planes((std::size_t{1} << depth) - 1);
  plant(points, 0, lengths, planes);
  return planes;
}

}  // namespace terrace::stream
