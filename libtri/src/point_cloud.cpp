// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/point_cloud.hpp"

#include <cassert>
#include <cmath>
#include <cstdint>

#include <terrace/base/portable_math.hpp>
#include <terrace/base/random.hpp>

#include "check_input.hpp"
#include "free_slots.hpp"

namespace terrace::tri {
namespace {

struct Finite {
  static bool valid(const Point3& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
  }
};

}  // namespace

struct PointCloud::Impl {
  std::vector<Point> points;   // by slot
  std::vector<bool> is_alive;  // by slot
  FreeSlots free;
  std::size_t count = 0;
  bool journal = false;
  // Since the last call of take_changes(): the slots touched, their former contents, and by slot
  // whether it is among them.
  std::vector<std::uint32_t> touched;
  std::vector<Point> former_points;  // points of `touched`, where was_alive
  std::vector<bool> was_alive, is_recorded;

  void touch(std::uint32_t slot) {
    if (!journal) return;
    if (is_recorded.size() < is_alive.size()) is_recorded.resize(is_alive.size());
    if (is_recorded[slot]) return;
    is_recorded[slot] = true;
    touched.push_back(slot);
    former_points.push_back(points[slot]);
    was_alive.push_back(is_alive[slot]);
  }
  VertexId add(const Point& point) {
    std::uint32_t slot = 0;
    if (free.empty()) {
      slot = static_cast<std::uint32_t>(points.size());
      points.push_back({});
      is_alive.push_back(false);
    } else {
      slot = free.take();
    }
    touch(slot);
    points[slot] = point;
    is_alive[slot] = true;
    ++count;
    return VertexId{slot};
  }
};

void PointCloud::Changes::clear() {
  removed_vertices.clear();
  removed_points.clear();
  added_vertices.clear();
}

PointCloud::PointCloud() : impl_(std::make_unique<Impl>()) {}
PointCloud::~PointCloud() = default;
PointCloud::PointCloud(PointCloud&&) noexcept = default;
PointCloud& PointCloud::operator=(PointCloud&&) noexcept = default;

std::vector<VertexId> PointCloud::build(std::span<const Point> points) {
  std::vector<Insertion> results(points.size());
  insert(points, results);
  std::vector<VertexId> vertices;
  vertices.reserve(points.size());
  for (const Insertion& result : results) vertices.push_back(result.vertex);
  return vertices;
}

void PointCloud::insert(std::span<const Point> points, std::span<Insertion> results, VertexId) {
  assert(results.empty() || results.size() == points.size());
  check_points<Finite>(points);
  check_count(impl_->count, points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const VertexId vertex = impl_->add(points[i]);
    if (!results.empty()) results[i] = {vertex, true};
  }
}

void PointCloud::remove(std::span<const VertexId> vertices) {
  for (const VertexId vertex : vertices) {
    assert(alive(vertex));
    impl_->touch(slot(vertex));
    impl_->is_alive[slot(vertex)] = false;
    impl_->free.put(slot(vertex));
  }
  impl_->count -= vertices.size();
}

void PointCloud::reserve(std::size_t vertices) {
  impl_->points.reserve(vertices);
  impl_->is_alive.reserve(vertices);
}

std::size_t PointCloud::vertex_count() const { return impl_->count; }
Point3 PointCloud::point(VertexId vertex) const { return impl_->points[slot(vertex)]; }
std::uint32_t PointCloud::vertex_slots() const {
  return static_cast<std::uint32_t>(impl_->points.size());
}
bool PointCloud::alive(VertexId vertex) const {
  return slot(vertex) < impl_->is_alive.size() && impl_->is_alive[slot(vertex)];
}

std::uint64_t PointCloud::hash() const {
  std::uint64_t sum = base::mix64(impl_->count);
  for (const VertexId vertex : all_vertices()) {
    std::uint64_t one = 0;
    for (const double c : point(vertex))
      one = base::mix64(one ^ base::bit_cast<std::uint64_t>(c + 0.0));
    sum += one;
  }
  return sum;
}

std::size_t PointCloud::memory_bytes() const {
  return impl_->points.capacity() * sizeof(Point) + impl_->is_alive.capacity() / 8 +
         impl_->free.bytes() + impl_->touched.capacity() * sizeof(std::uint32_t) +
         impl_->former_points.capacity() * sizeof(Point) +
         (impl_->was_alive.capacity() + impl_->is_recorded.capacity()) / 8;
}

void PointCloud::start_journal() {
  Changes dropped;
  take_changes(dropped);
  impl_->journal = true;
}

void PointCloud::take_changes(Changes& changes) {
  changes.clear();
  for (std::size_t i = 0; i < impl_->touched.size(); ++i) {
    const std::uint32_t slot = impl_->touched[i];
    impl_->is_recorded[slot] = false;
    const bool is_alive = impl_->is_alive[slot];
    if (impl_->was_alive[i] && is_alive && impl_->former_points[i] == impl_->points[slot]) continue;
    if (impl_->was_alive[i]) {
      changes.removed_vertices.push_back(VertexId{slot});
      changes.removed_points.push_back(impl_->former_points[i]);
    }
    if (is_alive) changes.added_vertices.push_back(VertexId{slot});
  }
  impl_->touched.clear();
  impl_->former_points.clear();
  impl_->was_alive.clear();
}

}  // namespace terrace::tri
