// SPDX-License-Identifier: Apache-2.0
#include "samples.hpp"

#include <algorithm>
#include <cmath>

#include "tin/ground.hpp"
#include "tin/options.hpp"

namespace terrace::tri::tin::points {

PointSamples::PointSamples(Pool<Sample>& all, double bound, const PointTinOptions& options,
                           bool border_fixed, bool integers, const Triangles& triangles)
    : all_(all),
      bound_(bound),
      tangent_(tangent_of(options.min_angle_degrees)),
      lattice_(options.lattice),
      border_fixed_(border_fixed),
      integers_(integers) {
  heads_.reserve(triangles.size() + 2 * std::size_t{all.size()});
  add_lists(triangles);
}

void PointSamples::add_lists(const Triangles& triangles) {
  while (heads_.size() < triangles.size()) heads_.push_back(kNone);
}

void PointSamples::set_error(Triangle& triangle, std::uint32_t worst, double error) const {
  triangle.place = worst;
  triangle.error = error > bound_ ? rounded_up(error) : 0;
}

void PointSamples::set_error(PointMesh& mesh, std::uint32_t t) const {
  Triangle& triangle = mesh.triangles[t];
  double largest = 0;
  std::uint32_t worst = kNone;
  for (std::uint32_t i = heads_[t]; i != kNone; i = all_[i].next) {
    const Sample& sample = all_[i];
    if (stuck(sample)) continue;
    const double error = std::abs(height_in(mesh, triangle, sample.x, sample.y) - sample.z);
    if (error > largest) {
      largest = error;
      worst = i;
    }
  }
  set_error(triangle, worst, largest);
}

void PointSamples::split(PointMesh& mesh, std::span<const std::uint32_t> created,
                         std::uint32_t place, std::uint32_t t, const Spot& spot) {
  // Rounding may have assigned the sample to another list.
  if (!lattice_ && spot.triangle != t) move(place, t, spot.triangle);
  const auto corner = [&](std::uint32_t number, unsigned i) -> const Vertex& {
    return mesh.vertex(mesh.triangles[number], i);
  };
  fan_.start(corner(created.front(), 0), spot.border);
  for (const std::uint32_t number : created) fan_.add_ray(corner(number, 1));
  if (spot.border) fan_.add_ray(corner(created.back(), 2));
  fan_.finish();
  const std::size_t removed = created.size() - (spot.border ? 1 : 2);
  for (const std::uint32_t number : created.first(removed))
    fan_.assign_samples(all_.data(), heads_[number], lattice_ ? kNone : place);
  fan_.end_lists();
  add_lists(mesh.triangles);
  for (std::size_t i = 0; i < created.size(); ++i) {
    const Fan::Sector& sector = fan_.sectors()[i];
    heads_[created[i]] = sector.head;
    set_error(mesh.triangles[created[i]], sector.worst, sector.error);
  }
  if (!lattice_) all_[place].next = kIsVertex;
}

void PointSamples::move(std::uint32_t index, std::uint32_t from, std::uint32_t to) {
  std::uint32_t* link = &heads_[from];
  while (*link != index) link = &all_[*link].next;
  *link = all_[index].next;
  all_[index].next = heads_[to];
  heads_[to] = index;
}

Vertex PointSamples::take(std::uint32_t place) const {
  const Sample& sample = all_[place];
  if (!lattice_) return {sample.x, sample.y, sample.z, place};
  return {round_half_up(sample.x), round_half_up(sample.y), tin::on_lattice(*lattice_, sample.z),
          place};
}

void PointSamples::narrow(std::uint32_t t, const Vertex& v, const Vertex& b, const Vertex& c,
                          Interval& rises) const {
  // Samples where the vertex has a smaller weight are ignored.
  constexpr double kMinWeight = 1e-9;
  for (std::uint32_t i = heads_[t]; i != kNone; i = all_[i].next) {
    const Sample& sample = all_[i];
    const auto part = [&](const Vertex& p, const Vertex& q) {
      const double area = (p.x - sample.x) * (q.y - sample.y) - (p.y - sample.y) * (q.x - sample.x);
      return area > 0 ? area : 0;
    };
    const double at_v = part(b, c);
    const double at_b = part(c, v);
    const double at_c = part(v, b);
    const double sum = at_v + at_b + at_c;
    if (!(at_v > kMinWeight * sum)) continue;
    // Heights are relative to the vertex's current one.
    const double interpolated = (at_b * (b.z - v.z) + at_c * (c.z - v.z)) / sum;
    const double target = sample.z - v.z - interpolated;
    rises.low = std::max(rises.low, (target - bound_) * sum / at_v);
    rises.high = std::min(rises.high, (target + bound_) * sum / at_v);
  }
}

bool PointSamples::raise(Vertex& v, const Interval& rises) const {
  // If no height satisfies all samples the vertex stays, because a compromise would break the
  // bound.
  if (!(rises.low < rises.high && rises.high - rises.low < HUGE_VAL)) return false;
  v.z += rises.low / 2 + rises.high / 2;
  if (lattice_) v.z = tin::on_lattice(*lattice_, v.z);
  return true;
}

bool PointSamples::within(const PointMesh& mesh, std::uint32_t t, const Vertex&, const Vertex&,
                          const Vertex&) const {
  const Triangle& triangle = mesh.triangles[t];
  for (std::uint32_t i = heads_[t]; i != kNone; i = all_[i].next)
    if (!(std::abs(height_in(mesh, triangle, all_[i].x, all_[i].y) - all_[i].z) <= bound_))
      return false;
  return true;
}

}  // namespace terrace::tri::tin::points
