// SPDX-License-Identifier: Apache-2.0
#include "surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "ground.hpp"
#include "tin/error_queue.hpp"
#include "tin/lattice.hpp"
#include "tin/point/lists.hpp"
#include "tin/point/removal.hpp"

namespace terrace::tri::tin::rows {
RowSurface::RowSurface(PaddedSamples padded, std::span<const Point3> frame,
                       const PointTinOptions& options, RowPath path)
    : options_(options),
      lattice_(*options.lattice),
      tangent_(points::tangent_of(options.min_angle_degrees)),
      padded_(std::move(padded)),
      samples_(padded_.view()),
      scan_(row_scan(path)),
      tiles_(samples_.columns, samples_.rows) {
  start(frame);
}

RowCorner RowSurface::sample(std::uint32_t place) const {
  const std::size_t i = at(place);
  if (samples_.upright) return {samples_.x[place & 0xFFFF], samples_.y[place >> 16], samples_.z[i]};
  return {samples_.x[i], samples_.y[i], samples_.z[i]};
}

void RowSurface::start(std::span<const Point3> frame) {
  Point3 low = frame[0], high = frame[0];
  for (const Point3& p : frame) {
    vertices_.push_back(
        {static_cast<std::int32_t>(p[0]), static_cast<std::int32_t>(p[1]), p[2], kNone});
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  fixed_ = static_cast<std::uint32_t>(vertices_.size());
  std::array<std::uint32_t, 4> corner{};
  std::size_t corners = 0;
  const auto is_corner = [&](const Point3& p) {
    return (p[0] == low[0] || p[0] == high[0]) && (p[1] == low[1] || p[1] == high[1]);
  };
  for (std::uint32_t i = 0; i < fixed_; ++i)
    if (is_corner(frame[i])) corner[corners++] = i;
  triangles_ = {{{corner[0], corner[1], corner[2]}, {kNone, 1, kNone}, 0, 0.0F},
                {{corner[0], corner[2], corner[3]}, {kNone, kNone, 0}, 0, 0.0F}};
  std::uint32_t near = 0;
  for (std::uint32_t i = 0; i < fixed_; ++i) {
    if (is_corner(frame[i])) continue;
    insert(i, locate(vertices_[i], near).triangle);
    near = cavity_.created().front();
  }
}

RowSurface::Spot RowSurface::locate(const Vertex& p, std::uint32_t t) const {
  unsigned zeros = 0;
  bool border = false;
  for (unsigned side = 0; side < 3;) {
    const Triangle& triangle = triangles_[t];
    const std::int64_t turned =
        turn(vertex(triangle, after(side)), vertex(triangle, before(side)), p);
    if (turned < 0) {
      t = triangle.next[side];
      if (t == kNone) return {kNone, false, false};
      side = zeros = 0;
      border = false;
      continue;
    }
    if (turned == 0) {
      ++zeros;
      border |= triangle.next[side] == kNone;
    }
    ++side;
  }
  return {t, zeros == 2, border};
}

void RowSurface::insert(std::uint32_t number, std::uint32_t triangle) {
  const Vertex p = vertices_[number];
  cavity_.dig(triangles_, triangle, [&](const Triangle& t) {
    return in_circle(vertex(t, 0), vertex(t, 1), vertex(t, 2), p);
  });
  cavity_.fill(triangles_, number, [&](std::uint32_t a, std::uint32_t b) {
    return turn(vertices_[a], vertices_[b], p) == 0;
  });
}

void RowSurface::judge(Triangle& triangle) const {
  const RowWorst worst =
      scan_.worst(samples_, corner(vertex(triangle, 0)), corner(vertex(triangle, 1)),
                  corner(vertex(triangle, 2)), options_.max_error);
  triangle.error = worst.error > 0.0 ? points::rounded_up(worst.error) : 0.0F;
  triangle.place = worst.place;
}

void RowSurface::refine() {
  constexpr double kLeastError = 1e-30;
  ErrorBuckets queue(static_cast<float>(std::clamp(options_.max_error, kLeastError, 1e30)));
  const auto look = [&](std::uint32_t t) {
    judge(triangles_[t]);
    if (triangles_[t].error > 0) queue.push(triangles_[t].error, t);
  };
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) look(t);
  for (;;) {
    const std::uint32_t t = queue.pop(triangles_, tiles_.count(), [&](const Triangle& triangle) {
      return tiles_.of(static_cast<std::int32_t>(triangle.place & 0xFFFF),
                       static_cast<std::int32_t>(triangle.place >> 16));
    });
    if (t == kNone) break;
    const std::uint32_t place = triangles_[t].place;
    // Next to a side it is a sample of two triangles, and the other has given it up.
    const RowCorner own = sample(place);
    if (std::isnan(own.z)) {
      look(t);
      continue;
    }
    const Vertex p{static_cast<std::int32_t>(to_whole(own.x)),
                   static_cast<std::int32_t>(to_whole(own.y)), on_lattice(lattice_, own.z), place};
    const Spot spot = locate(p, t);
    bool reached = false;
    if (spot.triangle != kNone && !spot.taken && !spot.border) {
      vertices_.push_back(p);
      insert(static_cast<std::uint32_t>(vertices_.size() - 1), spot.triangle);
      for (const std::uint32_t created : cavity_.created()) {
        reached |= created == t;
        look(created);
      }
    }
    if (reached) continue;
    // It would be tried again, but its place is taken.
    stuck_.emplace_back(at(place), own.z);
    padded_.z[at(place)] = std::numeric_limits<double>::quiet_NaN();
    look(t);
  }
  for (const auto& [index, height] : stuck_) padded_.z[index] = height;
}

void RowSurface::measure(PointTin& tin) const {
  std::vector<double> errors(padded_.z.size(), -1.0);
  for (const Triangle& t : triangles_)
    if (t.live())
      scan_.measure(samples_, corner(vertex(t, 0)), corner(vertex(t, 1)), corner(vertex(t, 2)),
                    errors.data());
  TinErrors& all = tin.errors;
  double squares = 0;
  const auto columns = static_cast<std::size_t>(samples_.columns);
  for (std::size_t row = 0; row < static_cast<std::size_t>(samples_.rows); ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const double error = errors[row * samples_.stride + column];
      if (!(error >= 0.0)) continue;
      ++all.covered;
      squares += error * error;
      if (error > options_.max_error) ++tin.stuck;
      if (error > all.largest) {
        all.largest = error;
        all.largest_at = static_cast<std::uint32_t>(row * columns + column);
      }
    }
  }
  all.uncovered = padded_.known - all.covered;
  if (all.covered > 0) all.rms = std::sqrt(squares / static_cast<double>(all.covered));
}

PointTin RowSurface::result() {
  PointTin tin;
  measure(tin);
  std::vector<std::uint32_t> number = triangle_of_vertices(triangles_, vertices_.size());
  for (std::size_t v = 0; v < vertices_.size(); ++v) {
    if (number[v] == kNone) continue;
    number[v] = static_cast<std::uint32_t>(tin.vertices.size());
    const Vertex& p = vertices_[v];
    tin.vertices.push_back({static_cast<double>(p.x), static_cast<double>(p.y), p.z});
    tin.sample.push_back(p.sample == kNone
                             ? kNoSample
                             : (p.sample >> 16) * static_cast<std::uint32_t>(samples_.columns) +
                                   (p.sample & 0xFFFF));
  }
  for (const Triangle& t : triangles_)
    if (t.live())
      tin.triangles.push_back({number[t.corner[0]], number[t.corner[1]], number[t.corner[2]]});
  tin.inserted = vertices_.size() - fixed_;
  tin.removed = vertices_.size() - tin.vertices.size();
  return tin;
}

}  // namespace terrace::tri::tin::rows
