// SPDX-License-Identifier: Apache-2.0
#include "samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <terrace/base/simd.hpp>

#include "tin/lattice.hpp"
#include "tin/lattice_surface.hpp"

namespace terrace::tri::tin::rows {
namespace {

RowCorner corner(const PlacedSamples::Vertex& vertex) {
  return {static_cast<double>(vertex.x), static_cast<double>(vertex.y), vertex.z};
}

}  // namespace

PlacedSamples::PlacedSamples(PaddedSamples padded, const PointTinOptions& options,
                             base::SimdPath set)
    : bound_(options.max_error),
      lattice_(*options.lattice),
      ground_(1, 1, static_cast<std::int64_t>(kFarthest), tangent_of(options.min_angle_degrees)),
      padded_(std::move(padded)),
      samples_(padded_.view()),
      scan_(scans(set).rows[samples_.upright ? 1 : 0]) {}

float PlacedSamples::least_error() const {
  return static_cast<float>(std::clamp(bound_, 1e-30, 1e30));
}

void PlacedSamples::judge(Triangle& triangle, const Vertex& a, const Vertex& b,
                          const Vertex& c) const {
  const WorstSample<double> worst = scan_.worst(samples_, corner(a), corner(b), corner(c), bound_);
  triangle.error = worst.error > 0.0 ? rounded_up(worst.error) : 0.0F;
  triangle.place = worst.place;
}

bool PlacedSamples::open(std::uint32_t place) const { return !std::isnan(padded_.z[at(place)]); }

PlacedSamples::Vertex PlacedSamples::take(std::uint32_t place) const {
  const Sample own = sample(place);
  return {static_cast<std::int32_t>(to_whole(own.x)), static_cast<std::int32_t>(to_whole(own.y)),
          on_lattice(lattice_, own.z), place};
}

void PlacedSamples::give_up(std::uint32_t place) {
  given_up_.emplace_back(at(place), padded_.z[at(place)]);
  padded_.z[at(place)] = std::numeric_limits<double>::quiet_NaN();
}

void PlacedSamples::restore() {
  for (const auto& [index, height] : given_up_) padded_.z[index] = height;
  given_up_.clear();
}

bool PlacedSamples::within(const Vertex& a, const Vertex& b, const Vertex& c) const {
  return scan_.within(samples_, corner(a), corner(b), corner(c), bound_) != 0;
}

bool PlacedSamples::fits(const Vertex& a, const Vertex& b, const Vertex& c,
                         const Sample& removed) const {
  return within_at(a, b, c, removed, bound_) && within(a, b, c);
}

void PlacedSamples::narrow(const Vertex& v, const Vertex& b, const Vertex& c,
                           Interval& rises) const {
  scan_.narrow(samples_, corner(v), corner(b), corner(c), bound_, rises);
}

bool PlacedSamples::raise(Vertex& v, const Interval& rises) const {
  // If no height satisfies all samples the vertex stays, because a compromise would break the
  // bound.
  if (!(rises.low < rises.high && std::isfinite(rises.high - rises.low))) return false;
  v.z = on_lattice(lattice_, v.z + (rises.low / 2 + rises.high / 2));
  return true;
}

void PlacedSamples::publish(const Vertex& vertex, PointTin& tin) const {
  tin.vertices.push_back({static_cast<double>(vertex.x), static_cast<double>(vertex.y), vertex.z});
  tin.sample.push_back(vertex.sample == kNone
                           ? kNoSample
                           : (vertex.sample >> 16) * static_cast<std::uint32_t>(samples_.columns) +
                                 (vertex.sample & 0xFFFF));
}

void PlacedSamples::measure(const std::vector<Vertex>& vertices, const Triangles& triangles,
                            PointTin& tin) const {
  std::vector<double> errors(padded_.z.size(), -1.0);
  for (const Triangle& t : triangles)
    if (t.live())
      scan_.measure(samples_, corner(vertices[t.corner[0]]), corner(vertices[t.corner[1]]),
                    corner(vertices[t.corner[2]]), errors.data());
  TinErrors& all = tin.errors;
  double squares = 0;
  const auto columns = static_cast<std::size_t>(samples_.columns);
  for (std::size_t row = 0; row < static_cast<std::size_t>(samples_.rows); ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const double error = errors[row * samples_.stride + column];
      if (!(error >= 0.0)) continue;
      ++all.covered;
      squares += error * error;
      if (error > bound_) ++tin.stuck;
      if (error > all.largest) {
        all.largest = error;
        all.largest_at = static_cast<std::uint32_t>(row * columns + column);
      }
    }
  }
  all.uncovered = padded_.known - all.covered;
  if (all.covered > 0) all.rms = std::sqrt(squares / static_cast<double>(all.covered));
}

RowCorner PlacedSamples::sample(std::uint32_t place) const {
  const std::size_t i = at(place);
  if (samples_.upright) return {samples_.x[place & 0xFFFF], samples_.y[place >> 16], samples_.z[i]};
  return {samples_.x[i], samples_.y[i], samples_.z[i]};
}

}  // namespace terrace::tri::tin::rows
