// SPDX-License-Identifier: Apache-2.0
#include "greedy.hpp"

#include <algorithm>
#include <cmath>

#include "lists.hpp"
#include "tin/lattice.hpp"

namespace terrace::tri::tin::points {
Vertex vertex_of(const Sample& sample, std::uint32_t index,
                 const std::optional<TinLattice>& lattice) {
  if (!lattice) return {sample.x, sample.y, sample.z, index};
  return {to_whole(sample.x), to_whole(sample.y), on_lattice(*lattice, sample.z), index};
}

void Greedy::enqueue(std::uint32_t triangle, double worst) {
  Triangle& t = mesh_.triangles[triangle];
  t.error = 0;
  if (!(worst > bound_)) return;
  t.error = rounded_up(worst);
  const std::size_t part = t.place / together_;
  if (part > part_) {
    later_[part].push_back(triangle);
  } else {
    queue_.push(t.error, triangle);
  }
}

void Greedy::rescan(std::uint32_t triangle) {
  Triangle& t = mesh_.triangles[triangle];
  double worst = 0;
  t.place = kNone;
  for (std::uint32_t i = mesh_.heads[triangle]; i != kNone; i = (*mesh_.samples)[i].next) {
    const Sample& sample = (*mesh_.samples)[i];
    if (stuck(sample)) continue;
    const double error = std::abs(height_in(mesh_, t, sample.x, sample.y) - sample.z);
    if (error > worst) {
      worst = error;
      t.place = i;
    }
  }
  enqueue(triangle, worst);
}

void Greedy::start(std::span<const std::uint32_t> triangles, std::size_t together) {
  queue_ = ErrorBuckets(kLeastError);
  together_ = std::max<std::size_t>(together, 1);
  part_ = 0;
  later_.assign(mesh_.samples->size() / together_ + 1, {});
  for (const std::uint32_t t : triangles) later_[mesh_.triangles[t].place / together_].push_back(t);
}

std::uint32_t Greedy::next_triangle() {
  for (;;) {
    const std::uint32_t t = queue_.pop(mesh_.triangles);
    if (t != kNone) return t;
    while (part_ < later_.size() && later_[part_].empty()) ++part_;
    if (part_ == later_.size()) return kNone;
    for (const std::uint32_t waiting : later_[part_])
      if (mesh_.triangles[waiting].error > 0) queue_.push(mesh_.triangles[waiting].error, waiting);
    later_[part_] = {};
  }
}

void Greedy::run(std::size_t max_vertices, std::size_t max_triangles) {
  while (mesh_.vertices.size() < max_vertices && mesh_.triangles.size() <= max_triangles) {
    const std::uint32_t t = next_triangle();
    if (t == kNone) return;
    const std::uint32_t sample = mesh_.triangles[t].place;
    if (insert(sample, t)) continue;
    (*mesh_.samples)[sample].id |= kStuck;
    rescan(t);
  }
}

void Greedy::sweep(std::uint32_t step) {
  const Pool<Sample>& samples = *mesh_.samples;
  std::uint32_t at = 0;
  while (!mesh_.triangles[at].live()) ++at;
  for (std::uint64_t i = 0; i < samples.size(); i += step) {
    const auto index = static_cast<std::uint32_t>(i);
    const Sample& sample = samples[index];
    if (sample.next == kIsVertex) continue;
    const Spot found = mesh_.locate({sample.x, sample.y}, at);
    if (found.triangle == kNone) continue;
    at = found.triangle;
    const double height = height_in(mesh_, mesh_.triangles[at], sample.x, sample.y);
    if (!(std::abs(height - sample.z) > bound_)) continue;
    const Vertex vertex = vertex_of(sample, index, lattice_);
    const Spot spot = spot_for(vertex, at);
    if (spot.triangle == kNone) continue;
    put(vertex, spot);
    if (!lattice_) (*mesh_.samples)[index].next = kIsVertex;
    at = cavity_.created().front();
  }
  while (mesh_.heads.size() < mesh_.triangles.size()) mesh_.heads.push_back(kNone);
}

Spot Greedy::spot_for(const Vertex& vertex, std::uint32_t near) const {
  const Spot spot = mesh_.locate({vertex.x, vertex.y}, near);
  if (spot.triangle == kNone || spot.zeros == 2) return {};
  return fixed_border_ && is_open(spot) ? Spot{} : spot;
}

bool Greedy::is_open(const Spot& spot) const {
  return spot.zeros == 1 && mesh_.triangles[spot.triangle].next[spot.edge] == kNone;
}

void Greedy::put(const Vertex& vertex, const Spot& spot) {
  const Place2 p{vertex.x, vertex.y};
  const bool open = is_open(spot);
  const std::uint32_t border = mesh_.triangles[spot.triangle].corner[after(spot.edge)];
  cavity_.dig(mesh_.triangles, spot.triangle, [&](const Triangle& t) {
    const Place2 a = mesh_.place(t.corner[0]);
    const Place2 b = mesh_.place(t.corner[1]);
    const Place2 c = mesh_.place(t.corner[2]);
    if (delaunay_) return mesh_.in_circle(a, b, c, p) > 0;
    return mesh_.orientation(a, b, p) >= 0 && mesh_.orientation(b, c, p) >= 0 &&
           mesh_.orientation(c, a, p) >= 0;
  });
  mesh_.vertices.push_back(vertex);
  cavity_.fill(mesh_.triangles, mesh_.vertices.size() - 1,
               [&](std::uint32_t a, std::uint32_t) { return open && a == border; });
}

bool Greedy::insert(std::uint32_t index, std::uint32_t triangle) {
  const Vertex vertex = vertex_of((*mesh_.samples)[index], index, lattice_);
  const Spot spot = spot_for(vertex, triangle);
  if (spot.triangle == kNone) return false;
  const bool open = is_open(spot);
  // Rounding may have assigned the sample to another list.
  if (!lattice_ && spot.triangle != triangle) move(index, triangle, spot.triangle);
  put(vertex, spot);
  const std::vector<std::uint32_t>& created = cavity_.created();
  const std::size_t old = created.size() - (open ? 1 : 2);
  const auto old_end = created.begin() + static_cast<std::ptrdiff_t>(old);
  const bool reached = std::find(created.begin(), old_end, triangle) != old_end;
  deal_samples(vertex, old, open, lattice_ ? kNone : index);
  if (!lattice_) {
    (*mesh_.samples)[index].next = kIsVertex;
    if (!reached) rescan(triangle);
    return true;
  }
  // If its triangle still existed, the sample would be tried again, but its place is taken.
  return reached;
}

void Greedy::move(std::uint32_t index, std::uint32_t from, std::uint32_t to) {
  Pool<Sample>& samples = *mesh_.samples;
  std::uint32_t* link = &mesh_.heads[from];
  while (*link != index) link = &samples[*link].next;
  *link = samples[index].next;
  samples[index].next = mesh_.heads[to];
  mesh_.heads[to] = index;
}

void Greedy::deal_samples(const Vertex& vertex, std::size_t old, bool open, std::uint32_t apart) {
  const std::vector<std::uint32_t>& created = cavity_.created();
  fan_.start(vertex, open);
  for (const std::uint32_t t : created) fan_.add_ray(mesh_.vertices[mesh_.triangles[t].corner[1]]);
  if (open) fan_.add_ray(mesh_.vertices[mesh_.triangles[created.back()].corner[2]]);
  fan_.finish();
  for (std::size_t i = 0; i < old; ++i)
    fan_.deal(mesh_.samples->data(), mesh_.heads[created[i]], apart);
  fan_.close();
  while (mesh_.heads.size() < mesh_.triangles.size()) mesh_.heads.push_back(kNone);
  for (std::size_t i = 0; i < created.size(); ++i) {
    const Fan::Sector& sector = fan_.sectors()[i];
    mesh_.heads[created[i]] = sector.head;
    mesh_.triangles[created[i]].place = sector.worst;
    enqueue(created[i], sector.error);
  }
}

}  // namespace terrace::tri::tin::points
