// SPDX-License-Identifier: Apache-2.0
#include <cassert>
#include <stdexcept>
#include <string>

#include "delaunay2/build.hpp"
#include "delaunay2/insert.hpp"
#include "delaunay2/query.hpp"
#include "delaunay2/remove.hpp"
#include "delaunay2/take_changes.hpp"
#include "elliptical/access.hpp"
#include "terrace/tri/elliptical.hpp"

namespace terrace::tri {
namespace {

using planar::EllipticalKernel;
using planar::kMaxVertices;
using Scope = EllipticalKernel::Scope;

void check_points(std::span<const EllipticalDelaunay2::Point> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (EllipticalKernel::valid(points[i])) continue;
    throw std::invalid_argument("point " + std::to_string(i) + ": coordinates " +
                                std::to_string(points[i][0]) + ", " + std::to_string(points[i][1]) +
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

EllipticalDelaunay2::EllipticalDelaunay2(const LinearMap2& map) {
  check_metric(map, "the map of an elliptical triangulation");
  impl_ = std::make_unique<Impl>(map);
}
EllipticalDelaunay2::~EllipticalDelaunay2() = default;
EllipticalDelaunay2::EllipticalDelaunay2(EllipticalDelaunay2&&) noexcept = default;
EllipticalDelaunay2& EllipticalDelaunay2::operator=(EllipticalDelaunay2&&) noexcept = default;

const LinearMap2& EllipticalDelaunay2::map() const { return impl_->map; }

std::vector<VertexId> EllipticalDelaunay2::build(std::span<const Point> points) {
  assert(vertex_count() == 0);
  check_count(0, points.size());
  check_points(points);
  const Scope scope(impl_->metric);
  return planar::build(impl_->mesh, points);
}

auto EllipticalDelaunay2::insert(const Point& point, VertexId hint) -> Insertion {
  assert(hint == kNoVertex || alive(hint));
  check_count(impl_->mesh.vertex_count, 1);
  check_points(std::span(&point, 1));
  const Scope scope(impl_->metric);
  const planar::Inserted inserted = planar::insert_point(impl_->mesh, point, slot(hint));
  return {VertexId{inserted.vertex}, inserted.created};
}

void EllipticalDelaunay2::insert(std::span<const Point> points, std::span<Insertion> results,
                                 VertexId hint) {
  assert(hint == kNoVertex || alive(hint));
  assert(results.empty() || results.size() == points.size());
  check_count(impl_->mesh.vertex_count, points.size());
  check_points(points);
  const Scope scope(impl_->metric);
  planar::insert_points(impl_->mesh, points, slot(hint),
                        [&](std::size_t i, const planar::Inserted& inserted) {
                          if (!results.empty())
                            results[i] = {VertexId{inserted.vertex}, inserted.created};
                        });
}

void EllipticalDelaunay2::remove(VertexId vertex) {
  assert(alive(vertex));
  const Scope scope(impl_->metric);
  planar::remove_vertex(impl_->mesh, slot(vertex));
}

void EllipticalDelaunay2::remove(std::span<const VertexId> vertices) {
  impl_->set.clear();
  for (const VertexId vertex : vertices) {
    assert(alive(vertex));
    impl_->set.push_back(slot(vertex));
  }
  const Scope scope(impl_->metric);
  planar::remove_set(impl_->mesh, std::span<const std::uint32_t>(impl_->set));
}

void EllipticalDelaunay2::clear() { impl_->mesh.clear(); }

void EllipticalDelaunay2::reserve(std::size_t vertices) {
  check_count(0, vertices);
  impl_->mesh.point.reserve(vertices + 1);
  impl_->mesh.incident.reserve(vertices + 1);
  impl_->mesh.triangle.reserve(2 * vertices);
}

std::size_t EllipticalDelaunay2::vertex_count() const { return impl_->mesh.vertex_count; }

std::size_t EllipticalDelaunay2::triangle_count() const {
  const auto& mesh = impl_->mesh;
  if (mesh.flat) return 0;
  // Of 2 n - 2 triangles, as many are ghosts as there are hull edges.
  return 2 * std::size_t{mesh.vertex_count} - 2 - planar::degree(mesh, planar::kGhost);
}

auto EllipticalDelaunay2::point(VertexId vertex) const -> Point {
  assert(alive(vertex));
  return impl_->mesh.point[slot(vertex)];
}

std::array<VertexId, 3> EllipticalDelaunay2::vertices(TriangleId triangle) const {
  assert(alive(triangle));
  const auto& [a, b, c] = impl_->mesh.triangle[slot(triangle)].corner;
  return {VertexId{a}, VertexId{b}, VertexId{c}};
}

std::array<TriangleId, 3> EllipticalDelaunay2::neighbours(TriangleId triangle) const {
  assert(alive(triangle));
  std::array<TriangleId, 3> result;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t t = planar::triangle_of(impl_->mesh.triangle[slot(triangle)].mate[i]);
    result[i] = impl_->mesh.triangle_alive(t) ? TriangleId{t} : kNoTriangle;
  }
  return result;
}

TriangleId EllipticalDelaunay2::triangle_at(VertexId vertex) const {
  assert(alive(vertex));
  const auto& mesh = impl_->mesh;
  return mesh.flat ? kNoTriangle : TriangleId{mesh.finite_side(mesh.incident[slot(vertex)])};
}

void EllipticalDelaunay2::adjacent(VertexId vertex, std::vector<VertexId>& result) const {
  assert(alive(vertex));
  planar::adjacent(impl_->mesh, slot(vertex), result);
}

std::uint32_t EllipticalDelaunay2::vertex_slots() const { return impl_->mesh.point.size(); }
std::uint32_t EllipticalDelaunay2::triangle_slots() const { return impl_->mesh.triangle.size(); }
bool EllipticalDelaunay2::alive(VertexId vertex) const {
  return impl_->mesh.vertex_alive(slot(vertex));
}
bool EllipticalDelaunay2::alive(TriangleId triangle) const {
  return impl_->mesh.triangle_alive(slot(triangle));
}

Location EllipticalDelaunay2::locate(const Point& point, VertexId hint) const {
  assert(hint == kNoVertex || alive(hint));
  check_points(std::span(&point, 1));
  const Scope scope(impl_->metric);
  return planar::locate(impl_->mesh, point, slot(hint));
}

VertexId EllipticalDelaunay2::nearest(const Point& point, VertexId hint) const {
  assert(hint == kNoVertex || alive(hint));
  check_points(std::span(&point, 1));
  const Scope scope(impl_->metric);
  return VertexId{planar::nearest(impl_->mesh, point, slot(hint))};
}

std::uint64_t EllipticalDelaunay2::hash() const { return planar::hash(impl_->mesh); }

std::size_t EllipticalDelaunay2::memory_bytes() const {
  return impl_->mesh.bytes() + impl_->set.capacity() * sizeof(std::uint32_t);
}

void EllipticalDelaunay2::start_journal() { impl_->mesh.journal.start(); }
void EllipticalDelaunay2::stop_journal() { impl_->mesh.journal.stop(); }
void EllipticalDelaunay2::take_changes(Changes& changes) {
  assert(impl_->mesh.journal.on());
  planar::take_changes<double>(impl_->mesh, changes);
}

}  // namespace terrace::tri
