// SPDX-License-Identifier: Apache-2.0
#include "order/kd_cut.hpp"

#include <algorithm>
#include <cassert>

namespace terrace::stream {
namespace {

std::size_t widest_axis(std::span<const NumberedPoint> points,
                        const std::array<double, 3>& lengths) {
  Box3 box;
  for (const NumberedPoint& point : points) box.include(point.place);
  std::size_t widest = 0;
  double most = -1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double width = (box.max[axis] - box.min[axis]) * lengths[axis];
    if (width > most) {
      most = width;
      widest = axis;
    }
  }
  return widest;
}

/// Puts the `first` points that come first along the widest axis before the others.
std::size_t divide(std::span<NumberedPoint> points, std::size_t first,
                   const std::array<double, 3>& lengths) {
  const std::size_t axis = widest_axis(points, lengths);
  std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(first),
                   points.end(), [axis](const NumberedPoint& a, const NumberedPoint& b) {
                     if (a.place[axis] != b.place[axis]) return a.place[axis] < b.place[axis];
                     return a.number < b.number;
                   });
  return axis;
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
  const std::size_t axis = divide(points, first, lengths);
  planes[node] = {axis, points[first].place[axis]};
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
