// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_rows_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "error_queue.hpp"
#include "lattice.hpp"
#include "point_lists.hpp"
#include "point_removal.hpp"
#include "point_samples.hpp"

namespace terrace::tri::tin::rows {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// With what RowSamples wants before and after.
std::vector<double> padded(std::span<const double> places) {
  std::vector<double> all{-kInfinity};
  all.reserve(places.size() + 1 + kRowPad);
  all.insert(all.end(), places.begin(), places.end());
  all.insert(all.end(), kRowPad, kInfinity);
  return all;
}

double per_unit(std::span<const double> places) {
  const double extent = places.back() - places.front();
  return extent > 0.0 ? static_cast<double>(places.size() - 1) / extent : 0.0;
}

/// > 0: a, b, c turn left; exact.
template <class P>
std::int64_t turn(const P& a, const P& b, const P& c) {
  return std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
}

template <class P>
bool in_circle(const P& a, const P& b, const P& c, const P& p) {
  __extension__ typedef __int128 Wide;
  const std::int64_t ax = a.x - p.x, ay = a.y - p.y;
  const std::int64_t bx = b.x - p.x, by = b.y - p.y;
  const std::int64_t cx = c.x - p.x, cy = c.y - p.y;
  return Wide{bx * cy - by * cx} * (ax * ax + ay * ay) +
             Wide{cx * ay - cy * ax} * (bx * bx + by * by) +
             Wide{ax * by - ay * bx} * (cx * cx + cy * cy) >
         0;
}

}  // namespace

bool is_rectangle(std::span<const Point3> frame) {
  if (frame.size() < 4) return false;
  std::array<double, 2> low{kFarthest, kFarthest}, high{0.0, 0.0};
  for (const Point3& p : frame) {
    if (!(std::abs(p[2]) < points::kLargest)) return false;
    for (std::size_t k = 0; k < 2; ++k) {
      if (!(p[k] >= 0.0 && p[k] < kFarthest && p[k] == std::floor(p[k]))) return false;
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  const double width = high[0] - low[0], height = high[1] - low[1];
  if (!(width > 0.0 && height > 0.0)) return false;
  // Places along the sides, from the south-west corner on.
  const double whole = 2.0 * (width + height);
  const auto along = [&](const Point3& p) {
    if (p[1] == low[1]) return p[0] - low[0];
    if (p[0] == high[0]) return width + (p[1] - low[1]);
    if (p[1] == high[1]) return width + height + (high[0] - p[0]);
    return p[0] == low[0] ? 2.0 * width + height + (high[1] - p[1]) : -1.0;
  };
  unsigned corners = 0, turns = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double here = along(frame[i]), next = along(frame[i + 1 == frame.size() ? 0 : i + 1]);
    if (here < 0.0 || here >= whole || here == next) return false;
    turns += next < here ? 1 : 0;
    corners +=
        here == 0.0 || here == width || here == width + height || here == 2.0 * width + height ? 1
                                                                                               : 0;
  }
  return corners == 4 && turns == 1;
}

RowSurface::RowSurface(const SampleRows& samples, std::span<const Point3> frame,
                       const PointTinOptions& options, RowPath path)
    : options_(options),
      lattice_(*options.lattice),
      tangent_(points::tangent_of(options.min_angle_degrees)),
      x_(padded(samples.x)),
      y_(padded(samples.y)),
      scan_(row_scan(path)),
      tiles_(static_cast<std::int32_t>(samples.x.size()),
             static_cast<std::int32_t>(samples.y.size())) {
  samples_ = {x_.data() + 1,
              y_.data() + 1,
              nullptr,
              samples.x.size() + kRowPad,
              static_cast<std::int32_t>(samples.x.size()),
              static_cast<std::int32_t>(samples.y.size()),
              per_unit(samples.x),
              per_unit(samples.y)};
  copy(samples, frame);
  start(frame);
}

void RowSurface::copy(const SampleRows& samples, std::span<const Point3> frame) {
  constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
  Point3 low = frame[0], high = frame[0];
  for (const Point3& p : frame) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  const std::size_t columns = samples.x.size(), rows = samples.y.size();
  heights_.resize((rows + 1) * samples_.stride);
  for (std::size_t row = 0; row < rows; ++row) {
    const double* const from = samples.z.data() + row * columns;
    double* const to = heights_.data() + row * samples_.stride;
    const bool within = samples.y[row] >= low[1] && samples.y[row] <= high[1];
    for (std::size_t i = 0; i < columns; ++i) {
      to[i] = from[i];
      if (std::isnan(from[i])) continue;
      if (!(std::abs(from[i]) < points::kLargest))
        throw std::invalid_argument("point_tin: z of sample " + std::to_string(row * columns + i) +
                                    " is not finite or too large");
      ++known_;
      // Those outside, be it by a hair, have no influence.
      if (!within || samples.x[i] < low[0] || samples.x[i] > high[0]) to[i] = kMissing;
    }
    std::fill(to + columns, to + samples_.stride, kMissing);
  }
  std::fill(heights_.end() - static_cast<std::ptrdiff_t>(samples_.stride), heights_.end(),
            kMissing);
  samples_.z = heights_.data();
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
    if (std::isnan(heights_[at(place)])) {
      look(t);
      continue;
    }
    const Vertex p{static_cast<std::int32_t>(to_whole(samples_.x[place & 0xFFFF])),
                   static_cast<std::int32_t>(to_whole(samples_.y[place >> 16])),
                   on_lattice(lattice_, heights_[at(place)]), place};
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
    stuck_.emplace_back(at(place), heights_[at(place)]);
    heights_[at(place)] = std::numeric_limits<double>::quiet_NaN();
    look(t);
  }
  for (const auto& [index, height] : stuck_) heights_[index] = height;
}

bool RowSurface::wide(const Vertex& a, const Vertex& b, const Vertex& c) const {
  const auto square = [](const Vertex& p, const Vertex& q) {
    const std::int64_t x = q.x - p.x, y = q.y - p.y;
    return x * x + y * y;
  };
  const std::int64_t ab = square(a, b), bc = square(b, c), ca = square(c, a);
  // The scalar product at the smallest angle, which is opposite to the shortest side.
  const std::int64_t twice = ab + bc + ca - 2 * std::min({ab, bc, ca});
  return 2.0 * static_cast<double>(turn(a, b, c)) >= tangent_ * static_cast<double>(twice);
}

bool RowSurface::fits(const Vertex& a, const Vertex& b, const Vertex& c) const {
  return scan_.within(samples_, corner(a), corner(b), corner(c), options_.max_error);
}

bool RowSurface::keeps(const Vertex& a, const Vertex& b, const Vertex& c,
                       const RowCorner& sample) const {
  const auto area = [&](const Vertex& p, const Vertex& q) {
    return (p.x - sample.x) * (q.y - sample.y) - (p.y - sample.y) * (q.x - sample.x);
  };
  const double at_a = area(b, c), at_b = area(c, a), at_c = area(a, b);
  if (!(at_a >= 0.0 && at_b >= 0.0 && at_c >= 0.0)) return true;
  const double sum = at_a * (a.z - sample.z) + at_b * (b.z - sample.z) + at_c * (c.z - sample.z);
  return std::abs(sum) <= options_.max_error * (at_a + at_b + at_c);
}

std::size_t RowSurface::remove() {
  std::vector<std::uint32_t> triangle_of = triangle_of_vertices(triangles_, vertices_.size());
  Star star;
  PolygonFill fill;
  Vertex ring[kMaxRing];
  RowCorner own{};  // the removed vertex's sample
  const auto left = [&](std::size_t i, std::size_t m, std::size_t j) {
    return turn(ring[i], ring[m], ring[j]) > 0;
  };
  const auto inside = [&](std::size_t i, std::size_t m, std::size_t j, std::size_t p) {
    return in_circle(ring[i], ring[m], ring[j], ring[p]);
  };
  const auto within = [&](std::size_t i, std::size_t m, std::size_t j) {
    return keeps(ring[i], ring[m], ring[j], own) && fits(ring[i], ring[m], ring[j]);
  };
  const auto good = [&](std::size_t i, std::size_t m, std::size_t j) {
    return turn(ring[i], ring[m], ring[j]) > 0 && wide(ring[i], ring[m], ring[j]) &&
           within(i, m, j);
  };
  AnyFill any(good, fill);
  std::size_t count = 0;
  for (std::uint32_t v = fixed_; v < vertices_.size(); ++v) {
    if (triangle_of[v] == kNone || !star.gather(triangles_, v, triangle_of[v])) continue;
    const std::size_t size = star.size();
    const std::uint32_t sample = vertices_[v].sample;
    own = {samples_.x[sample & 0xFFFF], samples_.y[sample >> 16], heights_[at(sample)]};
    for (std::size_t i = 0; i < size; ++i) ring[i] = vertices_[star.ring(i)];
    if (!(fill_delaunay(size, left, inside, fill) && star.all_of(fill, within)) &&
        !(size > 3 && any.find(size)))
      continue;
    star.replace(triangles_, fill, triangle_of, v);
    ++count;
  }
  return count;
}

void RowSurface::measure(PointTin& tin) const {
  std::vector<double> errors(heights_.size(), -1.0);
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
  all.uncovered = known_ - all.covered;
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
