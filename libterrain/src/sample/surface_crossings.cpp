// SPDX-License-Identifier: Apache-2.0
#include "sample/surface_crossings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <terrace/tri/predicates.hpp>

#include "surface/ground_slope.hpp"

namespace terrace::terrain {
namespace {

/// A line is followed in pieces of this share of a window's size, because boxes around slanting
/// pieces cover more than the pieces.
constexpr double kCrossingPiece = 0.5;
/// Share of the line within which two crossings are the same; rounding may separate them.
constexpr double kSame = 1e-12;

Point2 point_between(const Point2& a, const Point2& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
}

/// Returns the part of the line in the box, or slightly more; begin > end if there is none.
std::array<double, 2> part_within(const StoredBox& box, const Point2& from, const Point2& to) {
  double begin = 0, end = 1;
  for (std::size_t k = 0; k < 2; ++k) {
    const double way = to[k] - from[k];
    if (way == 0) {
      if (from[k] < box.min[k] || from[k] > box.max[k]) return {1, 0};
      continue;
    }
    const double first = (box.min[k] - from[k]) / way, second = (box.max[k] - from[k]) / way;
    begin = std::max(begin, std::min(first, second) - kSame);
    end = std::min(end, std::max(first, second) + kSame);
  }
  return {begin, end};
}

}  // namespace

SurfaceCrossings::SurfaceCrossings(std::shared_ptr<SampledCloud> sampled,
                                   const SamplerOptions& options, std::uint64_t memory_bytes)
    : sampled_(std::move(sampled)), window_(sampled_->cloud, memory_bytes / 2) {
  if (options.max_edge) too_long_ = longer_than(sampled_->store, *options.max_edge);
}

void SurfaceCrossings::operator()(const Point2& from, const Point2& to,
                                  const std::function<void(const Crossing&)>& visit) {
  const StoredBox all = flat(sampled_->store.bounds());
  if (from == to) return;
  const auto [first, last] = part_within(all, from, to);
  double latest = -1;
  for (double begin = first; begin <= last;) {
    const WindowTree& tree = sampled_->windows;
    const StoredBox& box = tree.box(tree.window_of(point_between(from, to, begin)));
    double end = 1;
    for (std::size_t k = 0; k < 2; ++k) {
      const double size = box.max[k] - box.min[k], way = std::abs(to[k] - from[k]);
      if (size > 0 && way > 0) end = std::min(end, begin + kCrossingPiece * size / way);
    }
    // Large enough to make progress.
    end = std::max(end, begin + 1e-9);
    collect(from, to, begin, std::min(end, last), end >= last);
    for (const Crossing& one : found_) {
      if (one.t - latest <= kSame && latest >= 0) continue;
      visit(one);
      latest = one.t;
    }
    if (end >= last) break;
    begin = end;
  }
}

void SurfaceCrossings::collect(const Point2& from, const Point2& to, double begin, double end,
                               bool is_last) {
  // Includes crossings that rounding may move into this piece.
  const Point2 a = point_between(from, to, std::max(0.0, begin - 1e-9));
  const Point2 b = point_between(from, to, std::min(1.0, end + 1e-9));
  window_.load(base::box_of(std::array{a, b}));
  found_.clear();
  const auto& triangulation = window_.triangulation();
  const double dx = to[0] - from[0], dy = to[1] - from[1], square = dx * dx + dy * dy;
  const auto off = [&](const Point2& p) { return dx * (p[1] - from[1]) - dy * (p[0] - from[0]); };
  const auto add = [&](const Point2& p, double height) {
    const double t = (dx * (p[0] - from[0]) + dy * (p[1] - from[1])) / square;
    if (t > 0 && t < 1 && t >= begin && (t < end || is_last)) found_.push_back({t, p, height});
  };
  for (const tri::TriangleId triangle : triangulation.all_triangles()) {
    if (!window_.is_certain(triangle)) continue;
    const auto corner = window_.corners_with_heights(triangle);
    std::array<int, 3> side{};
    for (std::size_t i = 0; i < 3; ++i) side[i] = tri::orientation(from, to, corner[i].place);
    if (side[0] == side[1] && side[1] == side[2]) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      std::size_t p = i, q = (i + 1) % 3;
      if (side[p] == 0) add(corner[p].place, corner[p].height);
      if (side[p] * side[q] >= 0) continue;
      if (corner[q].place < corner[p].place) std::swap(p, q);
      const SurfaceCorner &c = corner[p], &d = corner[q];
      const double left = std::abs(off(c.place)), right = std::abs(off(d.place));
      const double share = left + right > 0 ? left / (left + right) : 0.5;
      const bool is_surface = !too_long_ || !too_long_(c.place, d.place);
      add(point_between(c.place, d.place, share), is_surface
                                                      ? c.height + share * (d.height - c.height)
                                                      : std::numeric_limits<double>::quiet_NaN());
    }
  }
  std::sort(found_.begin(), found_.end(), [](const Crossing& p, const Crossing& q) {
    return p.t != q.t ? p.t < q.t : p.place < q.place;
  });
}

}  // namespace terrace::terrain
