// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/delaunay3.hpp"

#include <cassert>

#include <terrace/base/stop_check.hpp>

#include "check_input.hpp"
#include "delaunay3/access.hpp"
#include "delaunay3/insert.hpp"
#include "delaunay3/operations.hpp"

namespace terrace::tri {

template <class Coord, class Metric>
Delaunay3<Coord, Metric>::Delaunay3(const Metric& metric) : impl_(std::make_unique<Impl>(metric)) {}
template <class Coord, class Metric>
Delaunay3<Coord, Metric>::~Delaunay3() = default;
template <class Coord, class Metric>
Delaunay3<Coord, Metric>::Delaunay3(Delaunay3&&) noexcept = default;
template <class Coord, class Metric>
Delaunay3<Coord, Metric>& Delaunay3<Coord, Metric>::operator=(Delaunay3&&) noexcept = default;

template <class Coord, class Metric>
std::vector<VertexId> Delaunay3<Coord, Metric>::build(std::span<const Point> points,
                                                      unsigned threads) {
  assert(vertex_count() == 0);
  check_count(0, points.size());
  check_points<typename Impl::Kernel>(points);
  [[maybe_unused]] const auto scope = impl_->scope();
  return spatial::build(impl_->mesh, points, threads);
}

template <class Coord, class Metric>
auto Delaunay3<Coord, Metric>::insert(const Point& point, VertexId hint) -> Insertion {
  assert(hint == kNoVertex || alive(hint));
  check_count(impl_->mesh.vertex_count, 1);
  check_points<typename Impl::Kernel>(std::span<const Point>(&point, 1));
  [[maybe_unused]] const auto scope = impl_->scope();
  const spatial::Inserted inserted = spatial::insert_point(impl_->mesh, point, slot(hint));
  return {VertexId{inserted.vertex}, inserted.created};
}

template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::insert(std::span<const Point> points, std::span<Insertion> results,
                                      VertexId hint) {
  assert(hint == kNoVertex || alive(hint));
  assert(results.empty() || results.size() == points.size());
  check_count(impl_->mesh.vertex_count, points.size());
  check_points<typename Impl::Kernel>(points);
  [[maybe_unused]] const auto scope = impl_->scope();
  spatial::insert_points(impl_->mesh, points, slot(hint),
                         [&](std::size_t i, const spatial::Inserted& inserted) {
                           if (!results.empty())
                             results[i] = {VertexId{inserted.vertex}, inserted.created};
                         });
}

template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::remove(VertexId vertex) {
  assert(alive(vertex));
  const std::uint32_t one = slot(vertex);
  [[maybe_unused]] const auto scope = impl_->scope();
  spatial::remove_set(impl_->mesh, std::span(&one, 1));
}

template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::remove(std::span<const VertexId> vertices) {
  impl_->to_remove.clear();
  for (const VertexId vertex : vertices) {
    assert(alive(vertex));
    impl_->to_remove.push_back(slot(vertex));
  }
  [[maybe_unused]] const auto scope = impl_->scope();
  spatial::remove_set(impl_->mesh, std::span<const std::uint32_t>(impl_->to_remove));
}

template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::clear() {
  impl_->mesh.clear();
}

template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::reserve(std::size_t vertices) {
  check_count(0, vertices);
  impl_->mesh.vertex.reserve(vertices + 1);
  impl_->mesh.tetrahedron.reserve(7 * vertices);
  impl_->mesh.mark.reserve(7 * vertices);
}

template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::set_check_stop(base::StopCheck check_stop) {
  impl_->mesh.ticks = base::StopTicks(std::move(check_stop));
}

template <class Coord, class Metric>
const Metric& Delaunay3<Coord, Metric>::metric() const {
  return impl_->metric;
}

template <class Coord, class Metric>
std::size_t Delaunay3<Coord, Metric>::vertex_count() const {
  return impl_->mesh.vertex_count;
}

template <class Coord, class Metric>
std::size_t Delaunay3<Coord, Metric>::tetrahedron_count() const {
  return impl_->mesh.finite_count;
}

template <class Coord, class Metric>
auto Delaunay3<Coord, Metric>::point(VertexId vertex) const -> Point {
  assert(alive(vertex));
  return impl_->mesh.vertex[slot(vertex)].point;
}

template <class Coord, class Metric>
std::array<VertexId, 4> Delaunay3<Coord, Metric>::vertices(TetrahedronId tetrahedron) const {
  assert(alive(tetrahedron));
  const auto& [a, b, c, d] = impl_->mesh.tetrahedron[slot(tetrahedron)].corner;
  return {VertexId{a}, VertexId{b}, VertexId{c}, VertexId{d}};
}

template <class Coord, class Metric>
std::array<TetrahedronId, 4> Delaunay3<Coord, Metric>::neighbours(TetrahedronId tetrahedron) const {
  assert(alive(tetrahedron));
  std::array<TetrahedronId, 4> result;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto t = spatial::tetrahedron_of(impl_->mesh.tetrahedron[slot(tetrahedron)].mate[i]);
    result[i] = impl_->mesh.tetrahedron_alive(t) ? TetrahedronId{t} : kNoTetrahedron;
  }
  return result;
}

template <class Coord, class Metric>
TetrahedronId Delaunay3<Coord, Metric>::tetrahedron_at(VertexId vertex) const {
  assert(alive(vertex));
  const auto& mesh = impl_->mesh;
  return mesh.flat ? kNoTetrahedron
                   : TetrahedronId{mesh.finite_side(mesh.vertex[slot(vertex)].incident)};
}

template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::adjacent(VertexId vertex, std::vector<VertexId>& result) const {
  assert(alive(vertex));
  spatial::adjacent(impl_->mesh, slot(vertex), result);
}

template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::tetrahedra_at(VertexId vertex,
                                             std::vector<TetrahedronId>& result) const {
  assert(alive(vertex));
  spatial::tetrahedra_at(impl_->mesh, slot(vertex), result);
}

template <class Coord, class Metric>
std::uint32_t Delaunay3<Coord, Metric>::vertex_slots() const {
  return impl_->mesh.vertex.size();
}
template <class Coord, class Metric>
std::uint32_t Delaunay3<Coord, Metric>::tetrahedron_slots() const {
  return impl_->mesh.tetrahedron.size();
}
template <class Coord, class Metric>
bool Delaunay3<Coord, Metric>::alive(VertexId vertex) const {
  return impl_->mesh.vertex_alive(slot(vertex));
}
template <class Coord, class Metric>
bool Delaunay3<Coord, Metric>::alive(TetrahedronId tetrahedron) const {
  return impl_->mesh.tetrahedron_alive(slot(tetrahedron));
}

template <class Coord, class Metric>
Location3 Delaunay3<Coord, Metric>::locate(const Point& point, VertexId hint) const {
  assert(hint == kNoVertex || alive(hint));
  check_points<typename Impl::Kernel>(std::span<const Point>(&point, 1));
  [[maybe_unused]] const auto scope = impl_->scope();
  return spatial::locate(impl_->mesh, point, slot(hint));
}

template <class Coord, class Metric>
VertexId Delaunay3<Coord, Metric>::nearest(const Point& point, VertexId hint) const {
  assert(hint == kNoVertex || alive(hint));
  check_points<typename Impl::Kernel>(std::span<const Point>(&point, 1));
  [[maybe_unused]] const auto scope = impl_->scope();
  return VertexId{spatial::nearest(impl_->mesh, point, slot(hint))};
}

template <class Coord, class Metric>
std::uint64_t Delaunay3<Coord, Metric>::hash() const {
  return spatial::hash(impl_->mesh);
}

template <class Coord, class Metric>
std::size_t Delaunay3<Coord, Metric>::memory_bytes() const {
  return impl_->mesh.bytes() + impl_->to_remove.capacity() * sizeof(std::uint32_t);
}

template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::start_journal() {
  impl_->mesh.journal.start();
}
template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::stop_journal() {
  impl_->mesh.journal.stop();
}
template <class Coord, class Metric>
void Delaunay3<Coord, Metric>::take_changes(Changes& changes) {
  auto& mesh = impl_->mesh;
  assert(mesh.journal.on());
  changes.clear();
  mesh.journal.take(
      [&](std::uint32_t v) { return mesh.vertex_alive(v) ? &mesh.vertex[v].point : nullptr; },
      [&](std::uint32_t t) {
        return mesh.tetrahedron_alive(t) ? &mesh.tetrahedron[t].corner : nullptr;
      },
      [](const auto& corner) { return spatial::is_finite(corner); }, changes,
      changes.removed_tetrahedra, changes.added_tetrahedra);
}

#ifdef TERRACE_TRI_CORE
template class Delaunay3<std::int32_t>;
#else
template class Delaunay3<double>;
template class Delaunay3<double, EllipticalMetric3>;
#endif

}  // namespace terrace::tri
