// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/delaunay2.hpp"

#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>

#include "check_input.hpp"
#include "delaunay2/access.hpp"
#include "delaunay2/insert.hpp"
#include "delaunay2/operations.hpp"

namespace terrace::tri {
namespace {

using planar::kNone;

/// Returns the coordinates of a grid's lines. Throws if they would be rounded or out of range.
template <class Kernel, class Coord>
std::vector<Coord> grid_lines(Coord begin, Coord step, std::uint32_t count, const char* axis) {
  std::vector<Coord> lines(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    bool exact = false;
    if constexpr (std::is_same_v<Coord, double>) {
      const double offset = i * step;
      lines[i] = begin + offset;
      // x + y is exact if and only if both can be recovered from it.
      exact = Kernel::valid({lines[i], lines[i]}) && offset / step == i &&
              lines[i] - begin == offset && lines[i] - offset == begin &&
              std::fma(static_cast<double>(i), step, -offset) == 0;
    } else {
      const std::int64_t value = begin + std::int64_t{step} * i;
      exact = value >= 0 && value < Kernel::kLimit;
      if (exact) lines[i] = static_cast<Coord>(value);
    }
    if (!exact)
      throw std::invalid_argument("grid: " + std::string(axis) + " of line " + std::to_string(i) +
                                  " is out of range or not exact; use build()");
  }
  return lines;
}

}  // namespace

template <class Coord, class Metric>
Delaunay2<Coord, Metric>::Delaunay2(const Metric& metric) : impl_(std::make_unique<Impl>(metric)) {}
template <class Coord, class Metric>
Delaunay2<Coord, Metric>::~Delaunay2() = default;
template <class Coord, class Metric>
Delaunay2<Coord, Metric>::Delaunay2(Delaunay2&&) noexcept = default;
template <class Coord, class Metric>
Delaunay2<Coord, Metric>& Delaunay2<Coord, Metric>::operator=(Delaunay2&&) noexcept = default;

template <class Coord, class Metric>
std::vector<VertexId> Delaunay2<Coord, Metric>::build(std::span<const Point> points) {
  assert(vertex_count() == 0);
  check_count(0, points.size());
  check_points<typename Impl::Kernel>(points);
  [[maybe_unused]] const auto scope = impl_->scope();
  return planar::build(impl_->mesh, points);
}

template <class Coord, class Metric>
VertexId Delaunay2<Coord, Metric>::build_grid(Coord x0, Coord y0, Coord step, std::uint32_t columns,
                                              std::uint32_t rows) requires GridMetric<Metric> {
  using Kernel = typename Impl::Kernel;
  assert(vertex_count() == 0);
  if (!(step > 0)) throw std::invalid_argument("grid: step must be positive");
  if (rows > 0 && columns > kMaxVertices / rows) check_count(0, std::size_t{columns} * rows);
  const std::vector<Coord> xs = grid_lines<Kernel>(x0, step, columns, "x");
  const std::vector<Coord> ys = grid_lines<Kernel>(y0, step, rows, "y");
  // Clang 14 also instantiates members whose constraints are not met.
  if constexpr (GridMetric<Metric>) {
    return VertexId{planar::build_grid<Kernel>(impl_->mesh, xs, ys)};
  } else {
    return kNoVertex;
  }
}

template <class Coord, class Metric>
auto Delaunay2<Coord, Metric>::insert(const Point& point, VertexId hint) -> Insertion {
  assert(hint == kNoVertex || alive(hint));
  check_count(impl_->mesh.vertex_count, 1);
  check_points<typename Impl::Kernel>(std::span<const Point>(&point, 1));
  [[maybe_unused]] const auto scope = impl_->scope();
  const planar::Inserted inserted = planar::insert_point(impl_->mesh, point, slot(hint));
  return {VertexId{inserted.vertex}, inserted.created};
}

template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::insert(std::span<const Point> points, std::span<Insertion> results,
                                      VertexId hint) {
  assert(hint == kNoVertex || alive(hint));
  assert(results.empty() || results.size() == points.size());
  check_count(impl_->mesh.vertex_count, points.size());
  check_points<typename Impl::Kernel>(points);
  [[maybe_unused]] const auto scope = impl_->scope();
  planar::insert_points(impl_->mesh, points, slot(hint),
                        [&](std::size_t i, const planar::Inserted& inserted) {
                          if (!results.empty())
                            results[i] = {VertexId{inserted.vertex}, inserted.created};
                        });
}

template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::remove(VertexId vertex) {
  assert(alive(vertex));
  [[maybe_unused]] const auto scope = impl_->scope();
  planar::remove_vertex(impl_->mesh, slot(vertex));
}

template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::remove(std::span<const VertexId> vertices) {
  impl_->to_remove.clear();
  for (const VertexId vertex : vertices) {
    assert(alive(vertex));
    impl_->to_remove.push_back(slot(vertex));
  }
  [[maybe_unused]] const auto scope = impl_->scope();
  planar::remove_set(impl_->mesh, std::span<const std::uint32_t>(impl_->to_remove));
}

template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::clear() {
  impl_->mesh.clear();
}

template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::restart() {
  impl_->mesh.restart();
}

template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::reserve(std::size_t vertices) {
  check_count(0, vertices);
  impl_->mesh.point.reserve(vertices + 1);
  impl_->mesh.incident.reserve(vertices + 1);
  impl_->mesh.triangle.reserve(2 * vertices);
}

template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::set_check_stop(base::StopCheck check_stop) {
  impl_->mesh.ticks = base::StopTicks(std::move(check_stop));
}

template <class Coord, class Metric>
const Metric& Delaunay2<Coord, Metric>::metric() const {
  return impl_->metric;
}

template <class Coord, class Metric>
std::size_t Delaunay2<Coord, Metric>::vertex_count() const {
  return impl_->mesh.vertex_count;
}

template <class Coord, class Metric>
std::size_t Delaunay2<Coord, Metric>::triangle_count() const {
  const auto& mesh = impl_->mesh;
  if (mesh.flat) return 0;
  // There are 2 n - 2 triangles, of which one per hull edge is a ghost.
  return 2 * std::size_t{mesh.vertex_count} - 2 - planar::degree(mesh, planar::kGhost);
}

template <class Coord, class Metric>
auto Delaunay2<Coord, Metric>::point(VertexId vertex) const -> Point {
  assert(alive(vertex));
  return impl_->mesh.point[slot(vertex)];
}

template <class Coord, class Metric>
std::array<VertexId, 3> Delaunay2<Coord, Metric>::vertices(TriangleId triangle) const {
  assert(alive(triangle));
  const auto& [a, b, c] = impl_->mesh.triangle[slot(triangle)].corner;
  return {VertexId{a}, VertexId{b}, VertexId{c}};
}

template <class Coord, class Metric>
std::array<TriangleId, 3> Delaunay2<Coord, Metric>::neighbours(TriangleId triangle) const {
  assert(alive(triangle));
  std::array<TriangleId, 3> result;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t t = planar::triangle_of(impl_->mesh.triangle[slot(triangle)].mate[i]);
    result[i] = impl_->mesh.triangle_alive(t) ? TriangleId{t} : kNoTriangle;
  }
  return result;
}

template <class Coord, class Metric>
TriangleId Delaunay2<Coord, Metric>::triangle_at(VertexId vertex) const {
  assert(alive(vertex));
  const auto& mesh = impl_->mesh;
  return mesh.flat ? kNoTriangle : TriangleId{mesh.finite_side(mesh.incident[slot(vertex)])};
}

template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::adjacent(VertexId vertex, std::vector<VertexId>& result) const {
  assert(alive(vertex));
  planar::adjacent(impl_->mesh, slot(vertex), result);
}

template <class Coord, class Metric>
std::uint32_t Delaunay2<Coord, Metric>::vertex_slots() const {
  return impl_->mesh.point.size();
}
template <class Coord, class Metric>
std::uint32_t Delaunay2<Coord, Metric>::triangle_slots() const {
  return impl_->mesh.triangle.size();
}
template <class Coord, class Metric>
bool Delaunay2<Coord, Metric>::alive(VertexId vertex) const {
  return impl_->mesh.vertex_alive(slot(vertex));
}
template <class Coord, class Metric>
bool Delaunay2<Coord, Metric>::alive(TriangleId triangle) const {
  return impl_->mesh.triangle_alive(slot(triangle));
}

template <class Coord, class Metric>
Location Delaunay2<Coord, Metric>::locate(const Point& point, VertexId hint) const {
  assert(hint == kNoVertex || alive(hint));
  check_points<typename Impl::Kernel>(std::span<const Point>(&point, 1));
  [[maybe_unused]] const auto scope = impl_->scope();
  return planar::locate(impl_->mesh, point, slot(hint));
}

template <class Coord, class Metric>
VertexId Delaunay2<Coord, Metric>::nearest(const Point& point, VertexId hint) const
    requires(!std::is_same_v<Metric, Windowed>) {
  assert(hint == kNoVertex || alive(hint));
  check_points<typename Impl::Kernel>(std::span<const Point>(&point, 1));
  [[maybe_unused]] const auto scope = impl_->scope();
  if constexpr (!std::is_same_v<Metric, Windowed>) {  // as in build_grid()
    return VertexId{planar::nearest(impl_->mesh, point, slot(hint))};
  } else {
    return kNoVertex;
  }
}

template <class Coord, class Metric>
std::uint64_t Delaunay2<Coord, Metric>::hash() const {
  return planar::hash(impl_->mesh);
}

template <class Coord, class Metric>
std::size_t Delaunay2<Coord, Metric>::memory_bytes() const {
  return impl_->mesh.bytes() + impl_->to_remove.capacity() * sizeof(std::uint32_t);
}

template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::start_journal() {
  impl_->mesh.journal.start();
}
template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::stop_journal() {
  impl_->mesh.journal.stop();
}
template <class Coord, class Metric>
void Delaunay2<Coord, Metric>::take_changes(Changes& changes) {
  auto& mesh = impl_->mesh;
  assert(mesh.journal.on());
  changes.clear();
  mesh.journal.take(
      [&](std::uint32_t v) { return mesh.vertex_alive(v) ? &mesh.point[v] : nullptr; },
      [&](std::uint32_t t) { return mesh.triangle_alive(t) ? &mesh.triangle[t].corner : nullptr; },
      [](const auto& corner) { return planar::is_finite(corner); }, changes,
      changes.removed_triangles, changes.added_triangles);
}

#ifdef TERRACE_TRI_CORE
template class Delaunay2<std::int32_t>;
template class Delaunay2<std::int32_t, Windowed>;
#else
template class Delaunay2<double>;
template class Delaunay2<double, EllipticalMetric2>;
#endif

}  // namespace terrace::tri
