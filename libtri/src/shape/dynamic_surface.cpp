// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/dynamic_surface.hpp"

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <utility>

#include <terrace/base/random.hpp>
#include <terrace/base/stop_check.hpp>

#include "delaunay3/access.hpp"
#include "free_slots.hpp"
#include "journal.hpp"
#include "lids.hpp"
#include "nearby.hpp"
#include "poles.hpp"
#include "pool.hpp"
#include "state.hpp"
#include "triangle_hash.hpp"

namespace terrace::tri {
namespace {

using Corners3 = std::array<std::uint32_t, 3>;

/// The face rotated so that the smallest number comes first.
Corners3 rotate_to_smallest(Corners3 c) {
  std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
  return c;
}

}  // namespace

template <class Coord>
struct DynamicSurface<Coord>::Impl {
  Delaunay3<Coord> tetrahedra;
  shape::State state;
  // The facets of the closed surface by slot. `facet_at` holds their slots by tetrahedron and
  // opposite corner, kNone elsewhere.
  Pool<Corners3> corners;  ///< in a free slot the first corner is kFreeCorner
  Pool<spatial::Side> side;
  Pool<shape::LidFace> lid_face;
  Pool<std::array<std::uint32_t, 4>> facet_at;
  FreeSlots free;
  shape::LidShare share;
  bool open = false;                     ///< if true, lids are not triangles
  std::vector<shape::Spacing> spacings;  ///< by vertex slot
  // The triangles are all facets except for the lids of an open scan.
  Pool<std::uint32_t> at_vertex;  ///< number of triangles with this corner, by vertex slot
  std::size_t count = 0;
  Journal<Point, 3> journal;
  base::StopCheck check_stop;
  // Scratch memory.
  struct Facet {
    Corners3 corners;
    std::uint32_t slot_or_side;  ///< slot of a removed facet, side of an added one
    bool operator<(const Facet& other) const { return corners < other.corners; }
  };
  typename Delaunay3<Coord>::Changes changes;
  std::vector<std::uint32_t> examined, exposed;
  std::vector<Facet> removed_facets, added_facets;
  std::vector<std::uint32_t>
      lid_candidates;        ///< facets that may have become lids or stopped being lids
  std::vector<bool> is_new;  ///< by vertex slot: new since the last changes. false between calls

  [[nodiscard]] std::uint32_t& at(spatial::Side s) {
    return facet_at[spatial::tetrahedron_of(s)][spatial::index_of(s)];
  }
  [[nodiscard]] const auto& mesh() const { return Delaunay3Access::mesh(tetrahedra); }

  /// Brings labels up to date. Lists the tetrahedra whose facets may have changed.
  void relabel(bool from_scratch, unsigned threads) {
    if (!from_scratch && shape::worth_updating(mesh(), state, changes)) {
      examined = shape::update_nearby(mesh(), state, changes, exposed);
      return;
    }
    shape::restore_by_poles(mesh(), state, threads, check_stop);
    examined.resize(mesh().tetrahedron.size());
    for (std::uint32_t t = 0; t < examined.size(); ++t) examined[t] = t;
  }

  void find_changed_facets() {
    const auto& all = mesh();
    removed_facets.clear();
    added_facets.clear();
    const std::uint32_t old_size = facet_at.size();
    facet_at.resize(std::max(old_size, all.tetrahedron.size()));
    for (std::uint32_t t = old_size; t < facet_at.size(); ++t) facet_at[t].fill(spatial::kNone);
    const auto remove_facet = [&](spatial::Side s) {
      const std::uint32_t triangle = std::exchange(at(s), spatial::kNone);
      if (triangle != spatial::kNone) removed_facets.push_back({corners[triangle], triangle});
    };
    for (const TetrahedronId t : changes.removed_tetrahedra)
      for (std::uint32_t i = 0; i < 4; ++i) remove_facet(spatial::make_side(slot(t), i));
    for (const std::uint32_t t : examined) {
      const spatial::Tetrahedron& tetrahedron = all.tetrahedron[t];
      if (!spatial::is_finite(tetrahedron.corner)) continue;
      for (std::uint32_t i = 0; i < 4; ++i) {
        const spatial::Side s = spatial::make_side(t, i);
        const bool facet = state.of[t] == shape::kKept &&
                           state.of[spatial::tetrahedron_of(tetrahedron.mate[i])] != shape::kKept;
        if (!facet) {
          remove_facet(s);
        } else if (at(s) == spatial::kNone) {
          added_facets.push_back({rotate_to_smallest(spatial::facet_of(tetrahedron, i)), s});
        }
      }
    }
    std::sort(removed_facets.begin(), removed_facets.end());
    std::sort(added_facets.begin(), added_facets.end());
  }

  /// Applies the differences. Facets that exist before and after keep their slots.
  void replace_facets() {
    const std::uint32_t old_size = at_vertex.size();
    at_vertex.resize(std::max(old_size, tetrahedra.vertex_slots()));
    for (std::uint32_t v = old_size; v < at_vertex.size(); ++v) at_vertex[v] = 0;
    is_new.resize(std::max<std::size_t>(is_new.size(), tetrahedra.vertex_slots()));
    for (const VertexId v : changes.added_vertices) is_new[slot(v)] = true;
    const auto is_same = [&](const Facet& old_facet, const Facet& new_facet) {
      return old_facet.corners == new_facet.corners && !is_new[old_facet.corners[0]] &&
             !is_new[old_facet.corners[1]] && !is_new[old_facet.corners[2]];
    };
    auto old = removed_facets.begin();
    std::size_t added_count = 0;
    for (const Facet& facet : added_facets) {
      for (; old != removed_facets.end() && *old < facet; ++old) drop(old->slot_or_side);
      if (old != removed_facets.end() && is_same(*old, facet)) {
        at(facet.slot_or_side) = old->slot_or_side;
        side[old->slot_or_side] = facet.slot_or_side;
        ++old;
      } else {
        added_facets[added_count++] = facet;
      }
    }
    for (; old != removed_facets.end(); ++old) drop(old->slot_or_side);
    added_facets.resize(added_count);
    for (const Facet& facet : added_facets) add(facet);
  }
  void drop(std::uint32_t facet) {
    if (is_triangle(facet)) hide(facet);
    share.remove(lid_face[facet]);
    corners[facet].fill(spatial::kFreeCorner);
    free.put(facet);
  }
  /// Adds a facet as a triangle. find_lids() decides later whether it is a lid.
  void add(const Facet& facet) {
    const std::uint32_t slot = free.empty() ? side.size() : free.take();
    if (slot == side.size()) {
      side.push_back({});
      corners.push_back({});
      lid_face.push_back({});
    }
    side[slot] = facet.slot_or_side;
    corners[slot] = facet.corners;
    lid_face[slot] = {};
    at(facet.slot_or_side) = slot;
    lid_candidates.push_back(slot);
    show(slot);
  }
  void show(std::uint32_t facet) {
    if (journal.on()) journal.touch_cell(facet, {spatial::kFreeCorner, 0, 0});
    for (const std::uint32_t v : corners[facet]) ++at_vertex[v];
    ++count;
  }
  void hide(std::uint32_t facet) {
    if (journal.on()) journal.touch_cell(facet, corners[facet]);
    for (const std::uint32_t v : corners[facet]) --at_vertex[v];
    --count;
  }

  /// Examines new facets and those where spacings have changed.
  void find_lids() {
    shape::LidFinder<std::decay_t<decltype(mesh())>> finder(mesh(), spacings);
    for (const std::uint32_t facet : lid_candidates) {
      lid_face[facet] = finder.measure(corners[facet]);
      share.add(lid_face[facet]);
    }
    for (const VertexId v : changes.removed_vertices) finder.forget(slot(v));
    for (const VertexId v : changes.added_vertices) finder.forget(slot(v));
    for (const auto& v : changes.removed_corners)
      finder.remove({slot(v[0]), slot(v[1]), slot(v[2]), slot(v[3])});
    for (const TetrahedronId t : changes.added_tetrahedra)
      finder.add(mesh().tetrahedron[slot(t)].corner, is_new);
    for (const VertexId v : changes.added_vertices) is_new[slot(v)] = false;
    finder.update_spacings([&](std::uint32_t v) {
      if (state.degree[v] == 0) return;  // it is not a corner of any facet
      finder.find_spacing(v, [&](std::uint32_t t) {
        for (std::uint32_t i = 0; i < 4; ++i) {
          const std::uint32_t facet = facet_at[t][i];
          if (facet != spatial::kNone && mesh().tetrahedron[t].corner[i] != v)
            lid_candidates.push_back(facet);
        }
      });
    });
    for (const std::uint32_t facet : lid_candidates) {
      const bool lid = finder.is_lid(corners[facet]);
      shape::LidFace& face = lid_face[facet];
      if (lid == (face.lid != 0)) continue;
      share.remove(face);
      face.lid = lid;
      share.add(face);
      if (open) lid ? hide(facet) : show(facet);
    }
    lid_candidates.clear();
    if (std::exchange(open, share.open()) == open) return;
    for (std::uint32_t facet = 0; facet < corners.size(); ++facet) {
      if (!in_use(corners[facet]) || lid_face[facet].lid == 0) continue;
      open ? hide(facet) : show(facet);
    }
  }

  void reserve(std::size_t vertices) {
    tetrahedra.reserve(vertices);
    // Typical numbers for a scan.
    const std::size_t tetrahedron_room = 7 * vertices, triangle_room = 5 * vertices / 2;
    state.of.reserve(tetrahedron_room);
    state.forest.reserve(tetrahedron_room);
    state.local_tetrahedron.reserve(tetrahedron_room);
    facet_at.reserve(tetrahedron_room);
    corners.reserve(triangle_room);
    side.reserve(triangle_room);
    lid_face.reserve(triangle_room);
    spacings.reserve(vertices + 1);
    at_vertex.reserve(vertices + 1);
    state.degree.reserve(vertices + 1);
    state.removed_labels.reserve(vertices + 1);
    state.local_vertex.reserve(vertices + 1);
  }

  /// Lists the tetrahedra next to new ghosts, which may have new facets on the hull.
  void find_exposed() {
    exposed.clear();
    mesh().journal.for_each_cell([&](std::uint32_t t, const auto&) {
      if (t >= mesh().tetrahedron.size()) return;
      const spatial::Tetrahedron& ghost = mesh().tetrahedron[t];
      if (ghost.corner[0] == spatial::kFreeCorner || !spatial::has_ghost(ghost.corner)) return;
      const auto at = std::find(ghost.corner.begin(), ghost.corner.end(), spatial::kGhost);
      exposed.push_back(
          spatial::tetrahedron_of(ghost.mate[static_cast<std::size_t>(at - ghost.corner.begin())]));
    });
  }

  void follow(bool from_scratch, unsigned threads) {
    find_exposed();
    tetrahedra.take_changes(changes);
    if (!from_scratch && changes.added_vertices.empty() && changes.removed_vertices.empty()) return;
    if (journal.on()) {
      for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i)
        journal.touch_vertex(slot(changes.removed_vertices[i]), true, changes.removed_points[i]);
      for (const VertexId v : changes.added_vertices) journal.touch_vertex(slot(v), false, {});
    }
    relabel(from_scratch, threads);
    find_changed_facets();
    replace_facets();
    find_lids();
  }
  void take_changes(Changes& out) {
    assert(journal.on());
    out.clear();
    const auto& all = mesh();
    journal.take(
        [&](std::uint32_t v) { return all.vertex_alive(v) ? &all.vertex[v].point : nullptr; },
        [&](std::uint32_t t) { return is_triangle(t) ? &corners[t] : nullptr; },
        [](const Corners3& c) { return in_use(c); }, out, out.removed_triangles,
        out.added_triangles);
  }
  static bool in_use(const Corners3& c) { return c[0] != spatial::kFreeCorner; }
  [[nodiscard]] bool is_triangle(std::uint32_t facet) const {
    return in_use(corners[facet]) && !(open && lid_face[facet].lid != 0);
  }
};

template <class Coord>
DynamicSurface<Coord>::DynamicSurface() : impl_(std::make_unique<Impl>()) {
  impl_->tetrahedra.start_journal();
}
template <class Coord>
DynamicSurface<Coord>::~DynamicSurface() = default;
template <class Coord>
DynamicSurface<Coord>::DynamicSurface(DynamicSurface&&) noexcept = default;
template <class Coord>
DynamicSurface<Coord>& DynamicSurface<Coord>::operator=(DynamicSurface&&) noexcept = default;

template <class Coord>
std::vector<VertexId> DynamicSurface<Coord>::build(std::span<const Point> points) {
  std::vector<VertexId> vertices = impl_->tetrahedra.build(points);
  follow();
  return vertices;
}

template <class Coord>
void DynamicSurface<Coord>::insert(std::span<const Point> points, std::span<Insertion> results,
                                   VertexId hint) {
  impl_->tetrahedra.insert(points, results, hint);
}
template <class Coord>
void DynamicSurface<Coord>::remove(std::span<const VertexId> vertices) {
  impl_->tetrahedra.remove(vertices);
}
template <class Coord>
std::size_t DynamicSurface<Coord>::removal_work(std::span<const VertexId> vertices) const {
  constexpr std::size_t kUsual = 14;  // tetrahedra inside the surface at one of its vertices
  const auto& degree = impl_->state.degree;
  std::size_t inside = 0;
  for (const VertexId v : vertices)
    if (slot(v) < degree.size()) inside += degree[slot(v)];
  return vertices.size() + (inside - std::min(inside, kUsual * vertices.size())) / 2;
}
template <class Coord>
void DynamicSurface<Coord>::set_check_stop(base::StopCheck check_stop) {
  impl_->tetrahedra.set_check_stop(check_stop);
  impl_->check_stop = std::move(check_stop);
}
template <class Coord>
void DynamicSurface<Coord>::reserve(std::size_t vertices) {
  impl_->reserve(vertices);
}

template <class Coord>
void DynamicSurface<Coord>::follow() {
  impl_->follow(false, 1);
}
template <class Coord>
void DynamicSurface<Coord>::restore(unsigned threads) {
  impl_->follow(true, threads);
}
template <class Coord>
void DynamicSurface<Coord>::start_journal() {
  follow();
  impl_->journal.start();
}
template <class Coord>
void DynamicSurface<Coord>::take_changes(Changes& changes) {
  follow();
  impl_->take_changes(changes);
}

template <class Coord>
std::size_t DynamicSurface<Coord>::vertex_count() const {
  return impl_->tetrahedra.vertex_count();
}
template <class Coord>
std::size_t DynamicSurface<Coord>::triangle_count() const {
  return impl_->count;
}
template <class Coord>
bool DynamicSurface<Coord>::open() const {
  return impl_->open;
}
template <class Coord>
auto DynamicSurface<Coord>::point(VertexId vertex) const -> Point {
  return impl_->tetrahedra.point(vertex);
}
template <class Coord>
std::array<VertexId, 3> DynamicSurface<Coord>::vertices(TriangleId triangle) const {
  assert(alive(triangle));
  const auto& [a, b, c] = impl_->corners[slot(triangle)];
  return {VertexId{a}, VertexId{b}, VertexId{c}};
}

template <class Coord>
std::size_t DynamicSurface<Coord>::triangles_at(VertexId vertex) const {
  return slot(vertex) < impl_->at_vertex.size() ? impl_->at_vertex[slot(vertex)] : 0;
}

template <class Coord>
std::uint32_t DynamicSurface<Coord>::vertex_slots() const {
  return impl_->tetrahedra.vertex_slots();
}
template <class Coord>
std::uint32_t DynamicSurface<Coord>::triangle_slots() const {
  return impl_->side.size();
}
template <class Coord>
bool DynamicSurface<Coord>::alive(VertexId vertex) const {
  return impl_->tetrahedra.alive(vertex);
}
template <class Coord>
bool DynamicSurface<Coord>::alive(TriangleId triangle) const {
  return slot(triangle) < impl_->side.size() && impl_->is_triangle(slot(triangle));
}

template <class Coord>
const Delaunay3<Coord>& DynamicSurface<Coord>::tetrahedra() const {
  return impl_->tetrahedra;
}

template <class Coord>
std::uint64_t DynamicSurface<Coord>::hash() const {
  std::uint64_t sum = base::mix64(impl_->count);
  for (const TriangleId triangle : all_triangles()) {
    std::array<Point, 3> p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = point(vertices(triangle)[i]);
    sum += shape::triangle_hash(p);
  }
  return sum;
}

template <class Coord>
std::size_t DynamicSurface<Coord>::memory_bytes() const {
  const Impl& i = *impl_;
  return i.tetrahedra.memory_bytes() + i.state.bytes() + i.corners.bytes() + i.side.bytes() +
         i.lid_face.bytes() + i.facet_at.bytes() + i.at_vertex.bytes() +
         i.spacings.capacity() * sizeof(shape::Spacing) +
         (i.examined.capacity() + i.lid_candidates.capacity()) * sizeof(std::uint32_t) +
         i.free.bytes() + i.journal.bytes() +
         (i.removed_facets.capacity() + i.added_facets.capacity()) * sizeof(typename Impl::Facet) +
         i.is_new.capacity() / 8;
}

#ifdef TERRACE_TRI_CORE
template class DynamicSurface<std::int32_t>;
#else
template class DynamicSurface<double>;
#endif

}  // namespace terrace::tri
