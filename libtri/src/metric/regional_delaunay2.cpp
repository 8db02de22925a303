// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/regional_delaunay2.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "delaunay2/elliptical_kernel.hpp"
#include "flip_mesh.hpp"
#include "free_slots.hpp"
#include "journal.hpp"

namespace terrace::tri {
namespace {

using planar::FlipMesh;
using planar::kNoMate;
using planar::make_side;
using planar::next_index;
using planar::previous_index;
using planar::triangle_of;
using PlanePosition = planar::DoubleKernel::Point;
using Triple = std::array<std::uint32_t, 3>;

/// The region with the Euclidean metric.
constexpr std::uint32_t kPlainRegion = 0;
constexpr std::uint32_t kNoOneRegion = 0xFFFFFFFFu;

std::uint32_t least_index(const Triple& c) {
  return static_cast<std::uint32_t>(std::min_element(c.begin(), c.end()) - c.begin());
}
/// The triangle rotated so that the smallest number comes first.
Triple from_least(Triple c) {
  std::rotate(c.begin(), c.begin() + least_index(c), c.end());
  return c;
}

/// Assigns numbers to the metrics of the field, in the order in which they first occur.
class RegionTable {
 public:
  explicit RegionTable(MetricField2 field) : field_(std::move(field)) {
    maps_.push_back(kIdentityMap<2>);
    forms_.emplace_back(kIdentityMap<2>);
    map_index_.emplace(maps_.back(), kPlainRegion);
  }
  /// Returns the number of the region at a position. Throws as metric_triangles() does.
  std::uint32_t at(const PlanePosition& p) {
    const LinearMap2 map = field_(p);
    // Successive points are mostly in the same region.
    if (map == maps_[last_]) return last_;
    // Checked before it becomes a key, because NaN has no order.
    check_metric(map, "the field of metrics: the map at " + std::to_string(p[0]) + ", " +
                          std::to_string(p[1]));
    const auto [at, is_new] = map_index_.try_emplace(map, static_cast<std::uint32_t>(maps_.size()));
    if (is_new) {
      maps_.push_back(map);
      forms_.emplace_back(map);
    }
    return last_ = at->second;
  }
  [[nodiscard]] const planar::QuadraticForm& form(std::uint32_t region) const {
    return forms_[region];
  }
  [[nodiscard]] const MetricField2& field() const { return field_; }

 private:
  MetricField2 field_;
  std::map<LinearMap2, std::uint32_t> map_index_;
  std::vector<LinearMap2> maps_;
  std::vector<planar::QuadraticForm> forms_;
  std::uint32_t last_ = kPlainRegion;
};

/// Enumerates the triangles at a vertex, counter-clockwise from the first one and, after meeting
/// the hull, clockwise from the first one.
class Around {
 public:
  Around(const FlipMesh& mesh, std::uint32_t first, std::uint32_t vertex)
      : mesh_(mesh), first_(first), t_(first) {
    const auto& corner = mesh.triangle[first].corner;
    first_index_ = index_ = corner[0] == vertex ? 0u : corner[1] == vertex ? 1u : 2u;
  }
  [[nodiscard]] bool done() const { return t_ == planar::kNone; }
  [[nodiscard]] std::uint32_t triangle() const { return t_; }
  /// The index of the vertex in that triangle.
  [[nodiscard]] std::uint32_t index() const { return index_; }
  void advance() {
    if (forward_) {
      const planar::Side mate = mesh_.triangle[t_].mate[next_index(index_)];
      if (mate != kNoMate) {
        t_ = triangle_of(mate);
        index_ = next_index(planar::index_of(mate));
        if (t_ == first_) t_ = planar::kNone;
        return;
      }
      forward_ = false;
      t_ = first_;
      index_ = first_index_;
    }
    const planar::Side mate = mesh_.triangle[t_].mate[previous_index(index_)];
    t_ = mate == kNoMate ? planar::kNone : triangle_of(mate);
    index_ = previous_index(planar::index_of(mate));
  }

 private:
  const FlipMesh& mesh_;
  std::uint32_t first_, first_index_ = 0, t_, index_ = 0;
  bool forward_ = true;
};

}  // namespace

template <class Coord>
struct RegionalDelaunay2<Coord>::Impl {
  explicit Impl(MetricField2 field) : regions(std::move(field)) { plain.start_journal(); }

  Delaunay2<Coord> plain;
  base::StopTicks ticks;
  RegionTable regions;
  FlipMesh mesh;  ///< each triangle starts with its smallest corner, except within follow()
  FreeSlots free;
  std::size_t count = 0;
  Journal<Point, 3> journal;
  // By vertex slot. Entries of new vertices are valid after follow().
  std::vector<PlanePosition> position;
  std::vector<std::uint32_t> region;
  std::vector<std::uint32_t> incident;     ///< a triangle at the vertex, or kNone
  std::vector<std::uint32_t> next_region;  ///< regions of vertices inserted since the last follow()

  // Scratch memory of follow().
  struct Listed {
    Triple corners;  ///< the smallest first
    std::uint32_t slot;
    bool operator<(const Listed& other) const { return corners < other.corners; }
  };
  struct Edge {
    std::uint32_t low, high;
    planar::Side side;
    bool operator<(const Edge& other) const {
      return low != other.low ? low < other.low : high < other.high;
    }
  };
  // Bits of `marks`.
  static constexpr std::uint8_t kTouched = 1, kUnflipped = 2, kRemoved = 4, kKept = 8;
  Changes changes;
  std::vector<std::uint8_t> marks;      ///< by triangle slot. 0 between calls
  std::vector<std::uint32_t> to, turn;  ///< by triangle slot. `to` is kNone between calls
  std::vector<std::uint32_t> touched;   ///< slots that change
  std::vector<Listed> old_triangles, new_triangles;     ///< the triangles in these slots
  std::vector<std::uint32_t> unflipped, removed_slots;  ///< slots
  std::vector<planar::Side> pending;
  std::vector<Edge> edges;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> to_flip;  ///< region, slot
  std::vector<planar::Triangle> sorted;
  std::vector<bool> is_new;  ///< by vertex slot: new since the last call
  std::vector<Insertion> inserted;

  static PlanePosition as_position(const Point& p) {
    return {static_cast<double>(p[0]), static_cast<double>(p[1])};
  }
  std::vector<std::uint32_t> regions_of(std::span<const Point> points) {
    std::vector<std::uint32_t> result(points.size(), kPlainRegion);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PlanePosition p = as_position(points[i]);
      if (std::isfinite(p[0]) && std::isfinite(p[1])) result[i] = regions.at(p);  // else it throws
    }
    return result;
  }
  void set_next_region(VertexId vertex, std::uint32_t number) {
    if (slot(vertex) >= next_region.size()) next_region.resize(plain.vertex_slots());
    next_region[slot(vertex)] = number;
  }

  /// The region of all three corners, or kNoOneRegion.
  [[nodiscard]] std::uint32_t region_of(const Triple& c) const {
    const std::uint32_t one = region[c[0]];
    return region[c[1]] == one && region[c[2]] == one ? one : kNoOneRegion;
  }
  /// True if a triangle of plain() with these corners is also a triangle of this mesh, in any
  /// region.
  [[nodiscard]] bool never_flipped(const Triple& c) const {
    const std::uint32_t one = region_of(c);
    return one == kPlainRegion || one == kNoOneRegion;
  }
  static Triple slots_of(const std::array<VertexId, 3>& v) {
    return {slot(v[0]), slot(v[1]), slot(v[2])};
  }

  void touch(std::uint32_t t) {
    if ((marks[t] & kTouched) != 0) return;
    marks[t] |= kTouched;
    touched.push_back(t);
    const Triple& c = mesh.triangle[t].corner;
    if (in_use(c)) old_triangles.push_back({c, t});
  }
  static bool in_use(const Triple& c) { return c[0] != planar::kFreeCorner; }

  // ---- The steps of follow() ------------------------------------------------------------------

  /// Lists the triangles that cover those that plain() has lost.
  void gather() {
    for (const auto& corners : changes.removed_corners) {
      const Triple c = slots_of(corners);
      const std::uint32_t sides = never_flipped(c) ? 1 : 3;
      for (std::uint32_t i = 0; i < sides; ++i) take_along(c[i], c[next_index(i)]);
    }
  }
  void take(std::uint32_t t) {
    if ((marks[t] & kUnflipped) != 0) return;
    touch(t);
    marks[t] |= kUnflipped;
    unflipped.push_back(t);
  }
  /// Takes the triangle to the left of the edge from a to b or, if there is no such edge, all
  /// triangles that the line between them crosses. Alternates between both ends, as one of them may
  /// have many triangles.
  void take_along(std::uint32_t a, std::uint32_t b) {
    Around at_a(mesh, incident[a], a), at_b(mesh, incident[b], b);
    for (;;) {
      assert(!at_a.done() || !at_b.done());
      if (at_a.done() && at_b.done()) return;
      if (!at_a.done()) {
        if (take_from(at_a, a, b, true)) return;
        at_a.advance();
      }
      if (!at_b.done()) {
        if (take_from(at_b, b, a, false)) return;
        at_b.advance();
      }
    }
  }
  /// Returns true, having taken the triangles along the line from v to w, if that line starts in
  /// this triangle or along one of its edges.
  bool take_from(const Around& around, std::uint32_t v, std::uint32_t w, bool left) {
    const std::uint32_t t = around.triangle(), i = around.index();
    const planar::Triangle& triangle = mesh.triangle[t];
    const std::uint32_t p = triangle.corner[next_index(i)], q = triangle.corner[previous_index(i)];
    if (p == w || q == w) {
      const planar::Side neighbour = triangle.mate[p == w ? previous_index(i) : next_index(i)];
      take((p == w) == left ? t : triangle_of(neighbour));
      return true;
    }
    const auto orientation = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      return planar::DoubleKernel::orientation(position[x], position[y], position[z]);
    };
    if (orientation(v, p, w) <= 0 || orientation(v, w, q) <= 0) return false;
    take(t);
    for (planar::Side side = make_side(t, i);;) {
      const planar::Side mate = mesh.triangle[triangle_of(side)].mate[planar::index_of(side)];
      const std::uint32_t n = triangle_of(mate), k = planar::index_of(mate);
      take(n);
      const std::uint32_t r = mesh.triangle[n].corner[k];
      if (r == w) return true;
      side = make_side(n, orientation(v, w, r) > 0 ? next_index(k) : previous_index(k));
    }
  }

  /// Flips the listed triangles so that they contain the triangles that plain() has lost. This is
  /// possible because those have empty circles, and none of their edges crosses the border of the
  /// flipped area.
  void unflip() {
    for (const std::uint32_t t : unflipped) {
      if (never_flipped(mesh.triangle[t].corner)) continue;
      for (std::uint32_t i = 0; i < 3; ++i) pending.push_back(make_side(t, i));
    }
    mesh.settle<planar::DoubleKernel>(
        pending, position,
        [&](planar::Side, planar::Side mate) {
          return (marks[triangle_of(mate)] & kUnflipped) != 0;
        },
        [](std::uint32_t, std::uint32_t) {});
    for (const std::uint32_t t : unflipped)
      for (const std::uint32_t v : mesh.triangle[t].corner) incident[v] = t;
  }

  /// The side of the triangle to the left of the edge from a to b if there is nothing beyond it, or
  /// kNoMate if there is no such edge on the hull.
  [[nodiscard]] planar::Side hull_side(std::uint32_t a, std::uint32_t b) const {
    if (incident[a] == planar::kNone || incident[b] == planar::kNone) return kNoMate;
    Around at_a(mesh, incident[a], a), at_b(mesh, incident[b], b);
    const auto free_side = [&](std::uint32_t t, std::uint32_t i) {
      return mesh.triangle[t].mate[i] == kNoMate ? make_side(t, i) : kNoMate;
    };
    // Alternates between both ends, as one of them may have many triangles.
    for (; !at_a.done() && !at_b.done(); at_a.advance(), at_b.advance()) {
      const Triple& c = mesh.triangle[at_a.triangle()].corner;
      if (c[next_index(at_a.index())] == b)
        return free_side(at_a.triangle(), previous_index(at_a.index()));
      if (c[previous_index(at_a.index())] == b) return kNoMate;
      const Triple& d = mesh.triangle[at_b.triangle()].corner;
      if (d[previous_index(at_b.index())] == a)
        return free_side(at_b.triangle(), next_index(at_b.index()));
      if (d[next_index(at_b.index())] == a) return kNoMate;
    }
    return kNoMate;
  }

  /// Takes out the lost triangles. Sets `edges` to the sides around the holes and to the hull sides
  /// to which new triangles will be attached.
  void take_out() {
    new_triangles.clear();
    for (const std::uint32_t t : unflipped)
      new_triangles.push_back({from_least(mesh.triangle[t].corner), t});
    std::sort(new_triangles.begin(), new_triangles.end());
    for (const auto& corners : changes.removed_corners) {
      const Listed key{from_least(slots_of(corners)), 0};
      const auto entry = std::lower_bound(new_triangles.begin(), new_triangles.end(), key);
      assert(entry != new_triangles.end() && entry->corners == key.corners);
      marks[entry->slot] |= kRemoved;
      removed_slots.push_back(entry->slot);
    }
    for (const TriangleId id : changes.added_triangles) {
      const Triple c = slots_of(plain.vertices(id));
      for (std::uint32_t i = 0; i < 3; ++i) {
        const std::uint32_t u = c[next_index(i)], v = c[previous_index(i)];
        if (!is_new[c[i]] || is_new[u] || is_new[v]) continue;
        const planar::Side side = hull_side(v, u);
        if (side != kNoMate && (marks[triangle_of(side)] & kRemoved) == 0)
          edges.push_back({std::min(u, v), std::max(u, v), side});
      }
    }
    for (const std::uint32_t t : removed_slots)
      for (const std::uint32_t v : mesh.triangle[t].corner) incident[v] = planar::kNone;
    for (const std::uint32_t t : removed_slots) {
      for (std::uint32_t i = 0; i < 3; ++i) {
        const planar::Side outer = mesh.triangle[t].mate[i];
        if (outer == kNoMate || (marks[triangle_of(outer)] & kRemoved) != 0) continue;
        const std::uint32_t u = mesh.triangle[t].corner[next_index(i)];
        const std::uint32_t v = mesh.triangle[t].corner[previous_index(i)];
        edges.push_back({std::min(u, v), std::max(u, v), outer});
        incident[u] = incident[v] = triangle_of(outer);
        mesh.triangle[triangle_of(outer)].mate[planar::index_of(outer)] = kNoMate;
      }
      mesh.triangle[t].corner.fill(planar::kFreeCorner);
    }
  }

  void exchange_vertices() {
    const std::size_t slots = plain.vertex_slots();
    position.resize(std::max(position.size(), slots));
    region.resize(position.size());
    incident.resize(position.size(), planar::kNone);
    for (const VertexId v : changes.added_vertices) {
      position[slot(v)] = as_position(plain.point(v));
      region[slot(v)] = next_region[slot(v)];
      incident[slot(v)] = planar::kNone;
    }
  }

  /// Adds the new triangles of plain().
  void put_in() {
    for (const TriangleId id : changes.added_triangles) {
      std::uint32_t t = 0;
      if (!removed_slots.empty()) {
        t = removed_slots.back();
        removed_slots.pop_back();
      } else {
        t = free.empty() ? static_cast<std::uint32_t>(mesh.triangle.size()) : free.take();
        if (t == mesh.triangle.size()) {
          mesh.triangle.push_back({{planar::kFreeCorner, 0, 0}, {}});
          marks.push_back(0);
          to.push_back(planar::kNone);
          turn.push_back(0);
        }
        touch(t);
      }
      marks[t] &= static_cast<std::uint8_t>(~kRemoved);
      if ((marks[t] & kUnflipped) == 0) {
        marks[t] |= kUnflipped;
        unflipped.push_back(t);
      }
      const Triple c = slots_of(plain.vertices(id));
      mesh.triangle[t] = {c, {kNoMate, kNoMate, kNoMate}};
      for (std::uint32_t i = 0; i < 3; ++i) {
        const std::uint32_t u = c[next_index(i)], v = c[previous_index(i)];
        edges.push_back({std::min(u, v), std::max(u, v), make_side(t, i)});
      }
    }
    std::sort(edges.begin(), edges.end());
    for (std::size_t i = 1; i < edges.size(); ++i)
      if (edges[i].low == edges[i - 1].low && edges[i].high == edges[i - 1].high)
        mesh.link(edges[i].side, edges[i - 1].side);
  }

  void flip_by_regions() {
    for (const std::uint32_t t : unflipped) {
      const Triple& c = mesh.triangle[t].corner;
      if (in_use(c) && !never_flipped(c)) to_flip.emplace_back(region[c[0]], t);
    }
    std::sort(to_flip.begin(), to_flip.end());
    for (std::size_t i = 0; i < to_flip.size();) {
      const std::uint32_t one = to_flip[i].first;
      for (; i < to_flip.size() && to_flip[i].first == one; ++i)
        for (std::uint32_t k = 0; k < 3; ++k) pending.push_back(make_side(to_flip[i].second, k));
      const planar::EllipticalKernel::Scope scope(regions.form(one));
      mesh.settle<planar::EllipticalKernel>(
          pending, position,
          // Two of the neighbour's corners belong to this triangle, so only the third is checked.
          [&](planar::Side, planar::Side mate) {
            return region[mesh.triangle[triangle_of(mate)].corner[planar::index_of(mate)]] == one;
          },
          [&](std::uint32_t t, std::uint32_t o) {
            ticks(256);
            touch(t);
            touch(o);
          });
    }
  }

  /// Triangles that exist before and after return to their slots. The others take the remaining
  /// ones.
  void settle_slots() {
    new_triangles.clear();
    for (const std::uint32_t t : touched)
      if (in_use(mesh.triangle[t].corner))
        new_triangles.push_back({from_least(mesh.triangle[t].corner), t});
    std::sort(old_triangles.begin(), old_triangles.end());
    std::sort(new_triangles.begin(), new_triangles.end());
    const auto has_new_vertex = [&](const Triple& c) {
      return is_new[c[0]] || is_new[c[1]] || is_new[c[2]];
    };
    auto old = old_triangles.begin();
    for (const Listed& current : new_triangles) {
      while (old != old_triangles.end() && *old < current) ++old;
      if (old == old_triangles.end() || old->corners != current.corners ||
          has_new_vertex(current.corners))
        continue;
      to[current.slot] = old->slot;
      marks[old->slot] |= kKept;
    }
    if (journal.on()) {
      for (const Listed& listed : old_triangles)
        if ((marks[listed.slot] & kKept) == 0) journal.touch_cell(listed.slot, listed.corners);
    }
    std::sort(touched.begin(), touched.end());
    auto room = touched.begin();
    for (const Listed& current : new_triangles) {
      if (to[current.slot] == planar::kNone) {
        while ((marks[*room] & kKept) != 0) ++room;
        to[current.slot] = *room;
        if (journal.on()) journal.touch_cell(*room, {planar::kFreeCorner, 0, 0});
        marks[*room] |= kKept;
      }
      turn[current.slot] = least_index(mesh.triangle[current.slot].corner);
    }
    move_to_slots();
  }
  void move_to_slots() {
    sorted.clear();
    for (const Listed& current : new_triangles) sorted.push_back(mesh.triangle[current.slot]);
    for (std::size_t n = 0; n < new_triangles.size(); ++n) {
      const std::uint32_t t = new_triangles[n].slot, target = to[t];
      planar::Triangle& triangle = mesh.triangle[target];
      triangle.corner = new_triangles[n].corners;
      for (std::uint32_t i = 0; i < 3; ++i) {
        incident[triangle.corner[i]] = target;
        const planar::Side mate = sorted[n].mate[(i + turn[t]) % 3];
        triangle.mate[i] = mate;
        if (mate == kNoMate) continue;
        const std::uint32_t other = triangle_of(mate), k = planar::index_of(mate);
        if (to[other] == planar::kNone) {
          mesh.triangle[other].mate[k] = make_side(target, i);
        } else {
          triangle.mate[i] = make_side(to[other], (k + 3 - turn[other]) % 3);
        }
      }
    }
    for (const std::uint32_t t : touched) {
      if ((marks[t] & kKept) == 0) {
        mesh.triangle[t].corner.fill(planar::kFreeCorner);
        free.put(t);
      }
      marks[t] = 0;
      to[t] = planar::kNone;
    }
  }

  void follow() {
    plain.take_changes(changes);
    if (changes.added_vertices.empty() && changes.removed_vertices.empty()) return;
    if (journal.on()) {
      for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i)
        journal.touch_vertex(slot(changes.removed_vertices[i]), true, changes.removed_points[i]);
      for (const VertexId v : changes.added_vertices) journal.touch_vertex(slot(v), false, {});
    }
    is_new.resize(std::max<std::size_t>(is_new.size(), plain.vertex_slots()));
    for (const VertexId v : changes.added_vertices) is_new[slot(v)] = true;
    touched.clear();
    old_triangles.clear();
    unflipped.clear();
    removed_slots.clear();
    edges.clear();
    to_flip.clear();
    gather();
    unflip();
    take_out();
    exchange_vertices();
    put_in();
    flip_by_regions();
    settle_slots();
    count += changes.added_triangles.size();
    count -= changes.removed_triangles.size();
    for (const VertexId v : changes.added_vertices) is_new[slot(v)] = false;
  }
  void take_changes(Changes& out) {
    assert(journal.on());
    out.clear();
    Point current{};
    journal.take(
        [&](std::uint32_t v) {
          if (!plain.alive(VertexId{v})) return static_cast<const Point*>(nullptr);
          current = plain.point(VertexId{v});
          return static_cast<const Point*>(&current);
        },
        [&](std::uint32_t t) {
          const Triple& c = mesh.triangle[t].corner;
          return in_use(c) ? &c : nullptr;
        },
        in_use, out, out.removed_triangles, out.added_triangles);
  }
};

template <class Coord>
RegionalDelaunay2<Coord>::RegionalDelaunay2(MetricField2 field)
    : impl_(std::make_unique<Impl>(std::move(field))) {}
template <class Coord>
RegionalDelaunay2<Coord>::~RegionalDelaunay2() = default;
template <class Coord>
RegionalDelaunay2<Coord>::RegionalDelaunay2(RegionalDelaunay2&&) noexcept = default;
template <class Coord>
RegionalDelaunay2<Coord>& RegionalDelaunay2<Coord>::operator=(RegionalDelaunay2&&) noexcept =
    default;

template <class Coord>
std::vector<VertexId> RegionalDelaunay2<Coord>::build(std::span<const Point> points) {
  const std::vector<std::uint32_t> regions = impl_->regions_of(points);
  std::vector<VertexId> vertices = impl_->plain.build(points);
  for (std::size_t i = 0; i < vertices.size(); ++i) impl_->set_next_region(vertices[i], regions[i]);
  follow();
  return vertices;
}

template <class Coord>
void RegionalDelaunay2<Coord>::insert(std::span<const Point> points, std::span<Insertion> results,
                                      VertexId hint) {
  const std::vector<std::uint32_t> regions = impl_->regions_of(points);
  if (results.empty()) {
    impl_->inserted.resize(points.size());
    results = impl_->inserted;
  }
  impl_->plain.insert(points, results, hint);
  for (std::size_t i = 0; i < points.size(); ++i)
    impl_->set_next_region(results[i].vertex, regions[i]);
}
template <class Coord>
void RegionalDelaunay2<Coord>::remove(std::span<const VertexId> vertices) {
  impl_->plain.remove(vertices);
}
template <class Coord>
void RegionalDelaunay2<Coord>::reserve(std::size_t vertices) {
  impl_->plain.reserve(vertices);
  impl_->position.reserve(vertices + 1);
  impl_->region.reserve(vertices + 1);
  impl_->incident.reserve(vertices + 1);
  impl_->next_region.reserve(vertices + 1);
  impl_->mesh.triangle.reserve(2 * vertices);
  impl_->marks.reserve(2 * vertices);
  impl_->to.reserve(2 * vertices);
  impl_->turn.reserve(2 * vertices);
}

template <class Coord>
void RegionalDelaunay2<Coord>::set_check_stop(base::StopCheck check_stop) {
  impl_->plain.set_check_stop(check_stop);
  impl_->ticks = base::StopTicks(std::move(check_stop));
}

template <class Coord>
void RegionalDelaunay2<Coord>::follow() {
  impl_->follow();
}
template <class Coord>
void RegionalDelaunay2<Coord>::start_journal() {
  follow();
  impl_->journal.start();
}
template <class Coord>
void RegionalDelaunay2<Coord>::take_changes(Changes& changes) {
  follow();
  impl_->take_changes(changes);
}

template <class Coord>
std::size_t RegionalDelaunay2<Coord>::vertex_count() const {
  return impl_->plain.vertex_count();
}
template <class Coord>
std::size_t RegionalDelaunay2<Coord>::triangle_count() const {
  return impl_->count;
}
template <class Coord>
auto RegionalDelaunay2<Coord>::point(VertexId vertex) const -> Point {
  return impl_->plain.point(vertex);
}
template <class Coord>
std::array<VertexId, 3> RegionalDelaunay2<Coord>::vertices(TriangleId triangle) const {
  assert(alive(triangle));
  const auto& [a, b, c] = impl_->mesh.triangle[slot(triangle)].corner;
  return {VertexId{a}, VertexId{b}, VertexId{c}};
}

template <class Coord>
std::uint32_t RegionalDelaunay2<Coord>::vertex_slots() const {
  return impl_->plain.vertex_slots();
}
template <class Coord>
std::uint32_t RegionalDelaunay2<Coord>::triangle_slots() const {
  return static_cast<std::uint32_t>(impl_->mesh.triangle.size());
}
template <class Coord>
bool RegionalDelaunay2<Coord>::alive(VertexId vertex) const {
  return impl_->plain.alive(vertex);
}
template <class Coord>
bool RegionalDelaunay2<Coord>::alive(TriangleId triangle) const {
  return slot(triangle) < triangle_slots() &&
         Impl::in_use(impl_->mesh.triangle[slot(triangle)].corner);
}

template <class Coord>
const Delaunay2<Coord>& RegionalDelaunay2<Coord>::plain() const {
  return impl_->plain;
}
template <class Coord>
const MetricField2& RegionalDelaunay2<Coord>::field() const {
  return impl_->regions.field();
}
template <class Coord>
std::size_t RegionalDelaunay2<Coord>::memory_bytes() const {
  const Impl& m = *impl_;
  const std::size_t words = m.region.capacity() + m.incident.capacity() + m.next_region.capacity() +
                            m.to.capacity() + m.turn.capacity();
  return m.plain.memory_bytes() + words * sizeof(std::uint32_t) + m.marks.capacity() +
         m.position.capacity() * sizeof(PlanePosition) +
         m.mesh.triangle.capacity() * sizeof(planar::Triangle) + m.free.bytes() + m.journal.bytes();
}

template class RegionalDelaunay2<std::int32_t>;
template class RegionalDelaunay2<double>;

}  // namespace terrace::tri
