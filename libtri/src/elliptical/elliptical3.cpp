// SPDX-License-Identifier: Apache-2.0
#include <cassert>
#include <stdexcept>
#include <string>

#include "delaunay3/build.hpp"
#include "delaunay3/insert.hpp"
#include "delaunay3/query.hpp"
#include "delaunay3/remove.hpp"
#include "delaunay3/take_changes.hpp"
#include "elliptical/access3.hpp"
#include "terrace/tri/elliptical.hpp"

namespace terrace::tri {
namespace {

using spatial::EllipticalKernel;
using spatial::kMaxVertices;
using Scope = EllipticalKernel::Scope;

void check_points(std::span<const EllipticalDelaunay3::Point> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (EllipticalKernel::valid(points[i])) continue;
    throw std::invalid_argument("point " + std::to_string(i) + ": coordinates " +
                                std::to_string(points[i][0]) + ", " + std::to_string(points[i][1]) +
                                ", " + std::to_string(points[i][2]) +
                                " are not finite; leave such points out");
  }
}

void check_count(std::size_t present, std::size_t added) {
  if (added <= kMaxVertices - present) return;
  throw std::length_error("a triangulation holds at most 2^29 - 2 vertices; " +
                          std::to_string(present) + " are there and " + std::to_string(added) +
                          " were to be added");
}

}  // namespace

EllipticalDelaunay3::EllipticalDelaunay3(const LinearMap3& map) {
  check_metric(map, "the map of an elliptical triangulation");
  impl_ = std::make_unique<Impl>(map);
}
EllipticalDelaunay3::~EllipticalDelaunay3() = default;
EllipticalDelaunay3::EllipticalDelaunay3(EllipticalDelaunay3&&) noexcept = default;
EllipticalDelaunay3& EllipticalDelaunay3::operator=(EllipticalDelaunay3&&) noexcept = default;

const LinearMap3& EllipticalDelaunay3::map() const { return impl_->map; }

std::vector<VertexId> EllipticalDelaunay3::build(std::span<const Point> points, unsigned threads) {
  assert(vertex_count() == 0);
  check_count(0, points.size());
  check_points(points);
  const Scope scope(impl_->metric);
  return spatial::build(impl_->mesh, points, threads);
}

auto EllipticalDelaunay3::insert(const Point& point, VertexId hint) -> Insertion {
  assert(hint == kNoVertex || alive(hint));
  check_count(impl_->mesh.vertex_count, 1);
  check_points(std::span(&point, 1));
  const Scope scope(impl_->metric);
  const spatial::Inserted inserted = spatial::insert_point(impl_->mesh, point, slot(hint));
  return {VertexId{inserted.vertex}, inserted.created};
}

void EllipticalDelaunay3::insert(std::span<const Point> points, std::span<Insertion> results,
                                 VertexId hint) {
  assert(hint == kNoVertex || alive(hint));
  assert(results.empty() || results.size() == points.size());
  check_count(impl_->mesh.vertex_count, points.size());
  check_points(points);
  const Scope scope(impl_->metric);
  spatial::insert_points(impl_->mesh, points, slot(hint),
                         [&](std::size_t i, const spatial::Inserted& inserted) {
                           if (!results.empty())
                             results[i] = {VertexId{inserted.vertex}, inserted.created};
                         });
}

void EllipticalDelaunay3::remove(VertexId vertex) {
  assert(alive(vertex));
  const std::uint32_t one = slot(vertex);
  const Scope scope(impl_->metric);
  spatial::remove_set(impl_->mesh, std::span(&one, 1));
}

void EllipticalDelaunay3::remove(std::span<const VertexId> vertices) {
  impl_->set.clear();
  for (const VertexId vertex : vertices) {
    assert(alive(vertex));
    impl_->set.push_back(slot(vertex));
  }
  const Scope scope(impl_->metric);
  spatial::remove_set(impl_->mesh, std::span<const std::uint32_t>(impl_->set));
}

void EllipticalDelaunay3::clear() { impl_->mesh.clear(); }

void EllipticalDelaunay3::reserve(std::size_t vertices) {
  check_count(0, vertices);
  impl_->mesh.vertex.reserve(vertices + 1);
  impl_->mesh.tetrahedron.reserve(7 * vertices);
  impl_->mesh.mark.reserve(7 * vertices);
}

std::size_t EllipticalDelaunay3::vertex_count() const { return impl_->mesh.vertex_count; }

std::size_t EllipticalDelaunay3::tetrahedron_count() const { return impl_->mesh.finite_count; }

auto EllipticalDelaunay3::point(VertexId vertex) const -> Point {
  assert(alive(vertex));
  return impl_->mesh.vertex[slot(vertex)].point;
}

std::array<VertexId, 4> EllipticalDelaunay3::vertices(TetrahedronId tetrahedron) const {
  assert(alive(tetrahedron));
  return spatial::vertex_ids(impl_->mesh.tetrahedron[slot(tetrahedron)].corner);
}

std::array<TetrahedronId, 4> EllipticalDelaunay3::neighbours(TetrahedronId tetrahedron) const {
  assert(alive(tetrahedron));
  std::array<TetrahedronId, 4> result;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto t = spatial::tetrahedron_of(impl_->mesh.tetrahedron[slot(tetrahedron)].mate[i]);
    result[i] = impl_->mesh.tetrahedron_alive(t) ? TetrahedronId{t} : kNoTetrahedron;
  }
  return result;
}

TetrahedronId EllipticalDelaunay3::tetrahedron_at(VertexId vertex) const {
  assert(alive(vertex));
  const auto& mesh = impl_->mesh;
  return mesh.flat ? kNoTetrahedron
                   : TetrahedronId{mesh.finite_side(mesh.vertex[slot(vertex)].incident)};
}

void EllipticalDelaunay3::adjacent(VertexId vertex, std::vector<VertexId>& result) const {
  assert(alive(vertex));
  spatial::adjacent(impl_->mesh, slot(vertex), result);
}

void EllipticalDelaunay3::tetrahedra_at(VertexId vertex, std::vector<TetrahedronId>& result) const {
  assert(alive(vertex));
  spatial::tetrahedra_at(impl_->mesh, slot(vertex), result);
}

std::uint32_t EllipticalDelaunay3::vertex_slots() const { return impl_->mesh.vertex.size(); }
std::uint32_t EllipticalDelaunay3::tetrahedron_slots() const {
  return impl_->mesh.tetrahedron.size();
}
bool EllipticalDelaunay3::alive(VertexId vertex) const {
  return impl_->mesh.vertex_alive(slot(vertex));
}
bool EllipticalDelaunay3::alive(TetrahedronId tetrahedron) const {
  return impl_->mesh.tetrahedron_alive(slot(tetrahedron));
}

Location3 EllipticalDelaunay3::locate(const Point& point, VertexId hint) const {
  assert(hint == kNoVertex || alive(hint));
  check_points(std::span(&point, 1));
  const Scope scope(impl_->metric);
  return spatial::locate(impl_->mesh, point, slot(hint));
}

VertexId EllipticalDelaunay3::nearest(const Point& point, VertexId hint) const {
  assert(hint == kNoVertex || alive(hint));
  check_points(std::span(&point, 1));
  const Scope scope(impl_->metric);
  return VertexId{spatial::nearest(impl_->mesh, point, slot(hint))};
}

std::uint64_t EllipticalDelaunay3::hash() const { return spatial::hash(impl_->mesh); }

std::size_t EllipticalDelaunay3::memory_bytes() const {
  return impl_->mesh.bytes() + impl_->set.capacity() * sizeof(std::uint32_t);
}

void EllipticalDelaunay3::start_journal() { impl_->mesh.journal.start(); }
void EllipticalDelaunay3::stop_journal() { impl_->mesh.journal.stop(); }
void EllipticalDelaunay3::take_changes(Changes& changes) {
  assert(impl_->mesh.journal.on());
  spatial::take_changes<double>(impl_->mesh, changes);
}

}  // namespace terrace::tri
