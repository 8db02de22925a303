// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_greedy.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "lattice.hpp"

namespace terrace::tri::tin {
namespace {

/// 4 buckets per octave: the exponent and the first 2 bits of the fraction.
std::size_t bucket_of(float error) { return std::bit_cast<std::uint32_t>(error) >> 21; }

}  // namespace

Vertex vertex_of(const Sample& sample, std::uint32_t index,
                 const std::optional<TinLattice>& lattice) {
  if (!lattice) return {sample.x, sample.y, sample.z, index, kNone};
  return {to_whole(sample.x), to_whole(sample.y), on_lattice(*lattice, sample.z), index, kNone};
}

void ErrorQueue::push(const Pool<Triangle>& triangles, std::uint32_t triangle) {
  const std::size_t b = bucket_of(triangles[triangle].error);
  std::vector<std::uint32_t>& bucket = buckets_[b];
  // Before memory grows for entries that mean nothing any more, these go.
  if (bucket.size() == bucket.capacity() && bucket.size() >= 1024)
    std::erase_if(bucket, [&](std::uint32_t t) { return bucket_of(triangles[t].error) != b; });
  bucket.push_back(triangle);
  top_ = std::max(top_, b);
}

std::uint32_t ErrorQueue::pop(const Pool<Triangle>& triangles) {
  for (;; --top_) {
    std::vector<std::uint32_t>& bucket = buckets_[top_];
    while (!bucket.empty()) {
      const std::uint32_t t = bucket.back();
      bucket.pop_back();
      if (triangles[t].error > 0 && bucket_of(triangles[t].error) == top_) return t;
    }
    if (top_ == 0) return kNone;
  }
}

void Greedy::enqueue(std::uint32_t triangle, double worst) {
  Triangle& t = mesh_.triangles[triangle];
  t.error = 0;
  if (!(worst > bound_)) return;
  // Not 0, which means that nothing is left to do.
  t.error = std::max(static_cast<float>(std::min(worst, 3e38)), 1e-45f);
  queue_.push(mesh_.triangles, triangle);
}

void Greedy::rescan(std::uint32_t triangle) {
  Triangle& t = mesh_.triangles[triangle];
  double worst = 0;
  t.worst = kNone;
  for (std::uint32_t i = t.head; i != kNone; i = (*mesh_.samples)[i].next) {
    const Sample& sample = (*mesh_.samples)[i];
    if (stuck(sample)) continue;
    const double error = std::abs(height_in(mesh_, t, sample.x, sample.y) - sample.z);
    if (error > worst) {
      worst = error;
      t.worst = i;
    }
  }
  enqueue(triangle, worst);
}

void Greedy::measure_all() {
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) rescan(t);
}

void Greedy::run(std::size_t max_vertices, std::size_t max_triangles) {
  while (mesh_.vertices.size() < max_vertices && mesh_.triangles.size() <= max_triangles) {
    const std::uint32_t t = queue_.pop(mesh_.triangles);
    if (t == kNone) return;
    const std::uint32_t sample = mesh_.triangles[t].worst;
    if (insert(sample, t)) continue;
    (*mesh_.samples)[sample].id |= kStuck;
    rescan(t);
  }
}

bool Greedy::insert(std::uint32_t index, std::uint32_t triangle) {
  Pool<Sample>& samples = *mesh_.samples;
  const Vertex vertex = vertex_of(samples[index], index, lattice_);
  const Place2 p{vertex.x, vertex.y};
  const Spot spot = mesh_.locate(p, triangle);
  if (spot.triangle == kNone || spot.zeros == 2) return false;
  const bool on_border =
      spot.zeros == 1 && mesh_.triangles[spot.triangle].neighbour[spot.edge] == kNone;
  if (on_border && fixed_border_) return false;
  collect_cavity(p, spot);
  // Without a lattice a vertex's sample is in no list.
  if (!lattice_ && std::find(cavity_.begin(), cavity_.end(), triangle) == cavity_.end())
    return false;
  mesh_.vertices.push_back(vertex);
  fan_.start(vertex, on_border);
  for (const Rim& rim : rim_) fan_.add_ray(mesh_.vertices[rim.from]);
  if (on_border) fan_.add_ray(mesh_.vertices[rim_.back().to]);
  fan_.finish();
  const std::uint32_t apart = lattice_ ? kNone : index;
  for (const std::uint32_t t : cavity_) fan_.deal(samples.data(), mesh_.triangles[t].head, apart);
  fan_.close();
  if (!lattice_) samples[index].next = kIsVertex;
  const bool reached = std::find(cavity_.begin(), cavity_.end(), triangle) != cavity_.end();
  replace_cavity(mesh_.vertices.size() - 1);
  // Its triangle is still there: it would be tried again, but its place is taken.
  return reached;
}

// The triangles whose circle contains p are a tree about the first one; depth first, their edges
// come counter-clockwise.
void Greedy::collect_cavity(const Place2& p, const Spot& spot) {
  cavity_.assign(1, spot.triangle);
  rim_.clear();
  stack_.clear();
  const auto look_beyond = [&](std::uint32_t t, unsigned i) {
    stack_.push_back({mesh_.triangles[t].neighbour[i], t << 2 | i});
  };
  // At a border edge through p the rim has its ends there.
  const bool open = spot.zeros == 1 && mesh_.triangles[spot.triangle].neighbour[spot.edge] == kNone;
  const unsigned first = open ? spot.edge : 2;
  if (!open) look_beyond(spot.triangle, first);
  look_beyond(spot.triangle, previous3(first));
  look_beyond(spot.triangle, next3(first));
  while (!stack_.empty()) {
    const auto [beyond, edge] = stack_.back();
    stack_.pop_back();
    const std::uint32_t t = edge >> 2;
    const unsigned i = edge & 3;
    if (beyond != kNone) {
      const auto& corner = mesh_.triangles[beyond].vertex;
      if (Kernel::in_circle(mesh_.place(corner[0]), mesh_.place(corner[1]), mesh_.place(corner[2]),
                            p) > 0) {
        cavity_.push_back(beyond);
        const unsigned back = mesh_.side_to(beyond, t);
        look_beyond(beyond, previous3(back));
        look_beyond(beyond, next3(back));
        continue;
      }
    }
    const Triangle& inside = mesh_.triangles[t];
    rim_.push_back({inside.vertex[next3(i)], inside.vertex[previous3(i)], beyond,
                    beyond == kNone ? 0 : mesh_.side_to(beyond, t)});
  }
}

void Greedy::replace_cavity(std::uint32_t vertex) {
  const std::size_t count = rim_.size();
  made_ = cavity_;
  while (made_.size() < count) {
    made_.push_back(mesh_.triangles.size());
    mesh_.triangles.push_back({});
  }
  const bool open = count < cavity_.size() + 2;
  for (std::size_t i = 0; i < count; ++i) {
    const Rim& rim = rim_[i];
    const std::uint32_t before = i == 0 ? (open ? kNone : made_[count - 1]) : made_[i - 1];
    const std::uint32_t after = i + 1 == count ? (open ? kNone : made_[0]) : made_[i + 1];
    const Fan::Sector& sector = fan_.sectors()[i];
    mesh_.triangles[made_[i]] = {
        {vertex, rim.from, rim.to}, {rim.outside, after, before}, sector.head, sector.worst, 0};
    if (rim.outside != kNone) mesh_.triangles[rim.outside].neighbour[rim.back] = made_[i];
  }
  for (std::size_t i = 0; i < count; ++i) enqueue(made_[i], fan_.sectors()[i].error);
}

}  // namespace terrace::tri::tin
