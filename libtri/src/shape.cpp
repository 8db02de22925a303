// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/shape.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>

#include "delaunay3/access.hpp"
#include "shape/criterion.hpp"
#include "shape/extract_surface.hpp"
#include "shape/lids.hpp"
#include "shape/nearby.hpp"
#include "shape/peel.hpp"
#include "shape/poles.hpp"
#include "shape/state.hpp"

namespace terrace::tri {
template <class Triangulation>
struct BasicShape3<Triangulation>::Impl {
  ShapeOptions options;
  shape::State state;

  template <class Work>
  void with_criterion(const Triangulation& triangulation, const Work& work) const {
    [[maybe_unused]] const auto scope = Delaunay3Access::scope(triangulation);
    if (options.criterion == ShapeCriterion::gabriel) {
      work(shape::Gabriel{});
    } else {
      work(shape::EdgeLength{options.edge_factor});
    }
  }
};

template <class Triangulation>
BasicShape3<Triangulation>::BasicShape3(const ShapeOptions& options)
    : impl_(std::make_unique<Impl>()) {
  if (!(std::isfinite(options.edge_factor) && options.edge_factor > 0.0))
    throw std::invalid_argument("the factor for edge lengths is " +
                                std::to_string(options.edge_factor) +
                                ", but must be positive and finite; 0.5 is usual");
  impl_->options = options;
}
template <class Triangulation>
BasicShape3<Triangulation>::~BasicShape3() = default;
template <class Triangulation>
BasicShape3<Triangulation>::BasicShape3(BasicShape3&&) noexcept = default;
template <class Triangulation>
BasicShape3<Triangulation>& BasicShape3<Triangulation>::operator=(BasicShape3&&) noexcept = default;

template <class Triangulation>
void BasicShape3<Triangulation>::restore(const Triangulation& triangulation, unsigned threads,
                                         const base::StopCheck& check_stop) {
  const auto& mesh = Delaunay3Access::mesh(triangulation);
  shape::State& state = impl_->state;
  if (impl_->options.rule == ShapeRule::poles) {
    [[maybe_unused]] const auto scope = Delaunay3Access::scope(triangulation);
    return shape::restore_by_poles(mesh, state, threads, check_stop);
  }
  state.ticks = base::StopTicks(check_stop);
  const bool keep_vertices = impl_->options.keep_vertices;
  impl_->with_criterion(triangulation, [&](const auto& criterion) {
    if (impl_->options.rule == ShapeRule::flood) {
      shape::flood(mesh, state, criterion);
      if (keep_vertices) shape::rescue(mesh, state);
    } else {
      shape::peel_as_published(mesh, state, criterion, keep_vertices);
    }
  });
  state.ticks = {};
}

template <class Triangulation>
void BasicShape3<Triangulation>::update(const Triangulation& triangulation,
                                        const typename Triangulation::Changes& changes) {
  if (impl_->options.rule != ShapeRule::flood) return restore(triangulation);
  const auto& mesh = Delaunay3Access::mesh(triangulation);
  impl_->with_criterion(triangulation, [&](const auto& criterion) {
    shape::update_flood(mesh, impl_->state, criterion, changes);
    if (impl_->options.keep_vertices) shape::rescue(mesh, impl_->state);
  });
}

template <class Triangulation>
void BasicShape3<Triangulation>::update_nearby(const Triangulation& triangulation,
                                               const typename Triangulation::Changes& changes) {
  const auto& mesh = Delaunay3Access::mesh(triangulation);
  if (impl_->options.rule != ShapeRule::poles) return update(triangulation, changes);
  if (!shape::worth_updating(mesh, impl_->state, changes)) return restore(triangulation);
  [[maybe_unused]] const auto scope = Delaunay3Access::scope(triangulation);
  shape::update_nearby(mesh, impl_->state, changes);
}

template <class Triangulation>
bool BasicShape3<Triangulation>::kept(TetrahedronId tetrahedron) const {
  const auto& of = impl_->state.of;
  return slot(tetrahedron) < of.size() && shape::is_kept(of[slot(tetrahedron)]);
}

template <class Triangulation>
std::size_t BasicShape3<Triangulation>::kept_count() const {
  return impl_->state.kept_count + impl_->state.rescued.size();
}

template <class Triangulation>
std::size_t BasicShape3<Triangulation>::rescued_count() const {
  return impl_->state.rescued.size();
}

template <class Triangulation>
std::vector<VertexId> BasicShape3<Triangulation>::lost_vertices() const {
  std::vector<VertexId> result;
  for (const std::uint32_t v : impl_->state.lost) result.push_back(VertexId{v});
  return result;
}

template <class Triangulation>
std::vector<TetrahedronId> BasicShape3<Triangulation>::kept_tetrahedra() const {
  std::vector<TetrahedronId> result;
  result.reserve(kept_count());
  for (std::uint32_t t = 0; t < impl_->state.of.size(); ++t)
    if (shape::is_kept(impl_->state.of[t])) result.push_back(TetrahedronId{t});
  return result;
}

template <class Triangulation>
ShapeSurface BasicShape3<Triangulation>::surface(const Triangulation& triangulation) const {
  return shape::surface_of(Delaunay3Access::mesh(triangulation), impl_->state);
}

template <class Triangulation>
ShapeSurface BasicShape3<Triangulation>::surface_without_lids(
    const Triangulation& triangulation) const {
  ShapeSurface result = surface(triangulation);
  const auto& mesh = Delaunay3Access::mesh(triangulation);
  [[maybe_unused]] const auto scope = Delaunay3Access::scope(triangulation);
  shape::remove_lids(mesh, result);
  return result;
}

template <class Triangulation>
ShapeParts BasicShape3<Triangulation>::parts(const Triangulation& triangulation,
                                             const ShapeSurface& surface) const {
  return shape::parts_apart(Delaunay3Access::mesh(triangulation), impl_->state, surface);
}

template <class Triangulation>
double BasicShape3<Triangulation>::volume(const Triangulation& triangulation) const {
  const auto& mesh = Delaunay3Access::mesh(triangulation);
  double sum = 0.0;
  for (std::uint32_t t = 0; t < impl_->state.of.size(); ++t) {
    if (!shape::is_kept(impl_->state.of[t])) continue;
    std::array<shape::Vector3, 4> p;
    for (std::size_t i = 0; i < 4; ++i)
      p[i] = shape::to_doubles(mesh.vertex[mesh.tetrahedron[t].corner[i]].point);
    sum += shape::dot(shape::minus(p[1], p[0]),
                      shape::cross(shape::minus(p[2], p[0]), shape::minus(p[3], p[0])));
  }
  return sum / 6;
}

template <class Triangulation>
const ShapeOptions& BasicShape3<Triangulation>::options() const {
  return impl_->options;
}

template <class Triangulation>
std::size_t BasicShape3<Triangulation>::memory_bytes() const {
  return sizeof(Impl) + impl_->state.bytes();
}

template class BasicShape3<Delaunay3<std::int32_t>>;
template class BasicShape3<Delaunay3<double>>;
template class BasicShape3<Delaunay3<double, EllipticalMetric3>>;

}  // namespace terrace::tri
