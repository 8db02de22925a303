// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/surface_front.hpp"

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <utility>

#include <terrace/base/random.hpp>

#include "free_slots.hpp"
#include "incidence.hpp"
#include "journal.hpp"
#include "triangle_hash.hpp"

namespace terrace::tri {
namespace {

using Corners = std::array<std::uint32_t, 3>;

/// No vertex, corner, face or slot.
constexpr std::uint32_t kNoNumber = VertexClusters::kNone;

/// Lists of numbers, one after the other.
struct Lists {
  std::vector<std::uint32_t> begin;  ///< of each, and the end of the last
  std::vector<std::uint32_t> items;

  [[nodiscard]] std::span<const std::uint32_t> operator[](std::size_t list) const {
    return std::span(items).subspan(begin[list], begin[list + 1] - begin[list]);
  }
  /// Replaces the contents. visit(add) calls add(list, item) for all items, each time the same.
  template <class Visit>
  void assign(std::size_t lists, const Visit& visit) {
    begin.assign(lists + 1, 0);
    visit([&](std::uint32_t list, std::uint32_t) { ++begin[list + 1]; });
    for (std::size_t i = 0; i < lists; ++i) begin[i + 1] += begin[i];
    items.resize(begin[lists]);
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    visit([&](std::uint32_t list, std::uint32_t item) { items[next[list]++] = item; });
  }
};

/// Returns the vertices so that each comes before its descendants, which are consecutive. Siblings
/// are in ascending order.
std::vector<std::uint32_t> depth_first(const std::vector<std::uint32_t>& parents) {
  const std::size_t n = parents.size();
  Lists children;
  children.assign(n + 1, [&](const auto& add) {
    for (std::uint32_t v = 0; v < n; ++v) {
      if (parents[v] != kNoNumber && parents[v] >= n) {
        throw std::invalid_argument("vertex " + std::to_string(v) + " has an impossible parent");
      }
      add(parents[v] == kNoNumber ? static_cast<std::uint32_t>(n) : parents[v], v);
    }
  });
  std::vector<std::uint32_t> order, waiting;
  order.reserve(n);
  const auto push = [&](std::size_t list) {
    const std::span<const std::uint32_t> all = children[list];
    waiting.insert(waiting.end(), all.rbegin(), all.rend());
  };
  push(n);
  while (!waiting.empty()) {
    order.push_back(waiting.back());
    waiting.pop_back();
    push(order.back());
  }
  if (order.size() != n) throw std::invalid_argument("the parents of vertices form a circle");
  return order;
}

}  // namespace

void SurfaceFront::Changes::clear() {
  removed_vertices.clear();
  removed_points.clear();
  added_vertices.clear();
  removed_triangles.clear();
  removed_corners.clear();
  added_triangles.clear();
}

struct SurfaceFront::Impl {
  Impl(const Surface& surface, const VertexTree& tree);

  /// A triangle that exists. The triangles of a vertex are a ring of corners: corner 3 t + k is
  /// corner k of the triangle in slot t.
  struct Triangle {
    std::uint32_t face = kNoNumber;  ///< of the full surface; kNoNumber in a free slot
    Corners corners{};
    Corners next{}, previous{};
  };

  [[nodiscard]] bool is_below(std::uint32_t vertex, std::uint32_t ancestor) const {
    return vertex >= ancestor && vertex < end[ancestor];
  }
  /// The highest ancestor of `vertex`, or itself, that is not above or equal to `other`; kNoNumber
  /// if there is none.
  [[nodiscard]] std::uint32_t side(std::uint32_t vertex, std::uint32_t other) const {
    if (is_below(other, vertex)) return kNoNumber;
    while (parents[vertex] != kNoNumber && !is_below(other, parents[vertex]))
      vertex = parents[vertex];
    return vertex;
  }
  /// Calls add(vertex) for those without which the face does not appear in any cut: it can only
  /// appear or disappear when one of them does. None if it is in every cut.
  template <class Add>
  void for_each_side(const Corners& face, const Add& add) const;

  [[nodiscard]] std::uint32_t nearest_active(std::uint32_t vertex) const {
    while (!active[vertex]) vertex = parents[vertex];
    return vertex;
  }
  [[nodiscard]] Corners nearest_active(const Corners& face) const {
    return {nearest_active(face[0]), nearest_active(face[1]), nearest_active(face[2])};
  }
  static bool is_triangle(const Corners& c) { return c[0] != c[1] && c[1] != c[2] && c[2] != c[0]; }

  void touch(std::uint32_t slot) {
    if (!journal.on()) return;
    const Triangle& t = triangles[slot];
    journal.touch_cell(slot,
                       t.face == kNoNumber ? Corners{kNoNumber, kNoNumber, kNoNumber} : t.corners);
  }
  void link(std::uint32_t corner, std::uint32_t vertex);
  void unlink(std::uint32_t corner);
  void add_triangle(std::uint32_t face, const Corners& corners);
  void remove_triangle(std::uint32_t slot);
  template <class Moves>
  void move_corners(std::uint32_t from, std::uint32_t to, const Moves& moves);

  // By vertex.
  std::vector<std::uint32_t> input, parents, end;
  std::vector<Point> points;
  std::vector<bool> active;
  std::vector<std::uint32_t> ring;  ///< a corner at the vertex, or kNoNumber
  Lists faces_at;                   ///< the faces with the vertex as a side
  // By face of the full surface.
  std::vector<Corners> faces;
  std::vector<std::uint32_t> slot_of;  ///< kNoNumber: the face does not appear
  // By slot.
  std::vector<Triangle> triangles;
  FreeSlots free;
  std::size_t vertex_count = 0, triangle_count = 0;
  Journal<Point, 3> journal;
};

SurfaceFront::Impl::Impl(const Surface& surface, const VertexTree& tree) {
  const std::size_t n = surface.points.size();
  if (tree.parents.size() != n) {
    throw std::invalid_argument("the tree is not one of the surface's vertices");
  }
  shape::check_faces(surface);
  if (surface.faces.size() > kNoNumber / 3) throw std::invalid_argument("there are too many faces");
  input = depth_first(tree.parents);
  std::vector<std::uint32_t> number(n);
  for (std::uint32_t v = 0; v < n; ++v) number[input[v]] = v;
  points.resize(n);
  parents.resize(n);
  end.resize(n);
  for (std::uint32_t v = 0; v < n; ++v) {
    const std::uint32_t parent = tree.parents[input[v]];
    points[v] = surface.points[input[v]];
    parents[v] = parent == kNoNumber ? kNoNumber : number[parent];
    end[v] = v + 1;
  }
  for (std::size_t v = n; v-- > 0;) {
    if (parents[v] != kNoNumber) end[parents[v]] = std::max(end[parents[v]], end[v]);
  }
  active.resize(n);
  ring.assign(n, kNoNumber);
  for (std::uint32_t v = 0; v < n; ++v) {
    active[v] = parents[v] == kNoNumber;
    vertex_count += active[v];
  }
  faces = surface.faces;
  for (Corners& face : faces) {
    for (std::uint32_t& v : face) v = number[v];
  }
  slot_of.assign(faces.size(), kNoNumber);
  faces_at.assign(n, [&](const auto& add) {
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
      for_each_side(faces[f], [&](std::uint32_t v) { add(v, f); });
    }
  });
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    const Corners corners = nearest_active(faces[f]);
    if (is_triangle(corners)) add_triangle(f, corners);
  }
}

// Two of the corners part last, at their lowest common ancestor: there each is in the subtree of
// another child, its side, or one of them is the ancestor itself. The third corner has parted from
// them above, unless all three part at the same vertex. So the face appears once a side of the two
// is active; or, of three that part at the same vertex, all but one.
template <class Add>
void SurfaceFront::Impl::for_each_side(const Corners& face, const Add& add) const {
  Corners sides{kNoNumber, kNoNumber, kNoNumber};
  std::uint32_t lowest =
      kNoNumber;  // the ancestor where corners part last; kNoNumber: above all vertices
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t a = face[k], b = face[(k + 1) % 3];
    const std::uint32_t of_a = side(a, b), of_b = side(b, a);
    const std::uint32_t ancestor = of_a == kNoNumber ? a : parents[of_a];
    if (ancestor == kNoNumber) continue;
    // Those of the three pairs are on one path, and ancestors have smaller numbers.
    if (lowest != kNoNumber && ancestor < lowest) continue;
    if (lowest == kNoNumber || ancestor > lowest) sides = {kNoNumber, kNoNumber, kNoNumber};
    lowest = ancestor;
    sides[k] = of_a;
    sides[(k + 1) % 3] = of_b;
  }
  for (const std::uint32_t v : sides) {
    if (v != kNoNumber) add(v);
  }
}

void SurfaceFront::Impl::link(std::uint32_t corner, std::uint32_t vertex) {
  triangles[corner / 3].corners[corner % 3] = vertex;
  std::uint32_t& first = ring[vertex];
  if (first == kNoNumber) {
    first = corner;
    triangles[corner / 3].next[corner % 3] = triangles[corner / 3].previous[corner % 3] = corner;
    return;
  }
  const std::uint32_t last = triangles[first / 3].previous[first % 3];
  triangles[corner / 3].next[corner % 3] = first;
  triangles[corner / 3].previous[corner % 3] = last;
  triangles[first / 3].previous[first % 3] = corner;
  triangles[last / 3].next[last % 3] = corner;
}

void SurfaceFront::Impl::unlink(std::uint32_t corner) {
  const Triangle& t = triangles[corner / 3];
  const std::uint32_t next = t.next[corner % 3], previous = t.previous[corner % 3];
  triangles[next / 3].previous[next % 3] = previous;
  triangles[previous / 3].next[previous % 3] = next;
  std::uint32_t& first = ring[t.corners[corner % 3]];
  if (first == corner) first = next == corner ? kNoNumber : next;
}

void SurfaceFront::Impl::add_triangle(std::uint32_t face, const Corners& corners) {
  std::uint32_t slot = static_cast<std::uint32_t>(triangles.size());
  if (free.empty()) {
    triangles.emplace_back();
  } else {
    slot = free.take();
  }
  touch(slot);
  triangles[slot].face = face;
  slot_of[face] = slot;
  for (std::uint32_t k = 0; k < 3; ++k) link(3 * slot + k, corners[k]);
  ++triangle_count;
}

void SurfaceFront::Impl::remove_triangle(std::uint32_t slot) {
  touch(slot);
  for (std::uint32_t k = 0; k < 3; ++k) unlink(3 * slot + k);
  slot_of[triangles[slot].face] = kNoNumber;
  triangles[slot].face = kNoNumber;
  free.put(slot);
  --triangle_count;
}

/// Moves the corners at one vertex to another where moves(corner of the face) holds.
template <class Moves>
void SurfaceFront::Impl::move_corners(std::uint32_t from, std::uint32_t to, const Moves& moves) {
  const std::uint32_t first = ring[from];
  if (first == kNoNumber) return;
  const std::uint32_t last = triangles[first / 3].previous[first % 3];
  for (std::uint32_t corner = first, next = first;; corner = next) {
    const Triangle& t = triangles[corner / 3];
    next = t.next[corner % 3];
    if (moves(faces[t.face][corner % 3])) {
      touch(corner / 3);
      unlink(corner);
      link(corner, to);
    }
    if (corner == last) return;
  }
}

SurfaceFront::SurfaceFront(const Surface& surface, const VertexTree& tree)
    : impl_(std::make_unique<Impl>(surface, tree)) {}
SurfaceFront::~SurfaceFront() = default;
SurfaceFront::SurfaceFront(SurfaceFront&&) noexcept = default;
SurfaceFront& SurfaceFront::operator=(SurfaceFront&&) noexcept = default;

std::size_t SurfaceFront::size() const { return impl_->points.size(); }
std::span<const std::uint32_t> SurfaceFront::input() const { return impl_->input; }
VertexId SurfaceFront::parent(VertexId vertex) const {
  return VertexId{impl_->parents[slot(vertex)]};
}
std::uint32_t SurfaceFront::end_of_descendants(VertexId vertex) const {
  return impl_->end[slot(vertex)];
}

void SurfaceFront::activate(VertexId vertex) {
  Impl& i = *impl_;
  const std::uint32_t v = slot(vertex), parent = i.parents[v];
  assert(!i.active[v] && i.active[parent]);
  if (i.journal.on()) i.journal.touch_vertex(v, false, i.points[v]);
  i.active[v] = true;
  ++i.vertex_count;
  i.move_corners(parent, v, [&](std::uint32_t corner) { return i.is_below(corner, v); });
  for (const std::uint32_t face : i.faces_at[v]) {
    if (i.slot_of[face] != kNoNumber) continue;
    const Corners corners = i.nearest_active(i.faces[face]);
    if (Impl::is_triangle(corners)) i.add_triangle(face, corners);
  }
}

void SurfaceFront::deactivate(VertexId vertex) {
  Impl& i = *impl_;
  const std::uint32_t v = slot(vertex), parent = i.parents[v];
  assert(i.active[v] && parent != kNoNumber);
  if (i.journal.on()) i.journal.touch_vertex(v, true, i.points[v]);
  i.active[v] = false;
  --i.vertex_count;
  for (const std::uint32_t face : i.faces_at[v]) {
    const std::uint32_t t = i.slot_of[face];
    if (t == kNoNumber) continue;
    Corners corners = i.triangles[t].corners;
    for (std::uint32_t& c : corners) c = c == v ? parent : c;
    if (!Impl::is_triangle(corners)) i.remove_triangle(t);
  }
  i.move_corners(v, parent, [](std::uint32_t) { return true; });
}

bool SurfaceFront::alive(VertexId vertex) const {
  return slot(vertex) < impl_->active.size() && impl_->active[slot(vertex)];
}
std::size_t SurfaceFront::vertex_count() const { return impl_->vertex_count; }
std::size_t SurfaceFront::triangle_count() const { return impl_->triangle_count; }
const SurfaceFront::Point& SurfaceFront::point(VertexId vertex) const {
  return impl_->points[slot(vertex)];
}
std::array<VertexId, 3> SurfaceFront::vertices(TriangleId triangle) const {
  const Corners& c = impl_->triangles[slot(triangle)].corners;
  return {VertexId{c[0]}, VertexId{c[1]}, VertexId{c[2]}};
}
std::size_t SurfaceFront::triangles_at(VertexId vertex) const {
  const std::uint32_t first = impl_->ring[slot(vertex)];
  if (first == kNoNumber) return 0;
  std::size_t count = 0;
  std::uint32_t corner = first;
  do {
    ++count;
    corner = impl_->triangles[corner / 3].next[corner % 3];
  } while (corner != first);
  return count;
}
std::uint32_t SurfaceFront::vertex_slots() const {
  return static_cast<std::uint32_t>(impl_->points.size());
}
std::uint32_t SurfaceFront::triangle_slots() const {
  return static_cast<std::uint32_t>(impl_->triangles.size());
}
bool SurfaceFront::alive(TriangleId triangle) const {
  return slot(triangle) < impl_->triangles.size() &&
         impl_->triangles[slot(triangle)].face != kNoNumber;
}

std::uint64_t SurfaceFront::hash() const {
  std::uint64_t sum = base::mix64(impl_->triangle_count);
  for (const TriangleId triangle : all_triangles()) {
    std::array<Point, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = point(vertices(triangle)[k]);
    sum += shape::triangle_hash(p);
  }
  return sum;
}

std::size_t SurfaceFront::memory_bytes() const {
  const Impl& i = *impl_;
  return (i.input.capacity() + i.parents.capacity() + i.end.capacity() + i.ring.capacity() +
          i.faces_at.begin.capacity() + i.faces_at.items.capacity() + i.slot_of.capacity()) *
             sizeof(std::uint32_t) +
         i.points.capacity() * sizeof(Point) + i.active.capacity() / 8 +
         i.faces.capacity() * sizeof(Corners) + i.triangles.capacity() * sizeof(Impl::Triangle) +
         i.free.bytes() + i.journal.bytes();
}

void SurfaceFront::start_journal() { impl_->journal.start(); }

void SurfaceFront::take_changes(Changes& changes) {
  changes.clear();
  Impl& i = *impl_;
  i.journal.take([&](std::uint32_t v) { return i.active[v] ? &i.points[v] : nullptr; },
                 [&](std::uint32_t t) {
                   return i.triangles[t].face == kNoNumber ? nullptr : &i.triangles[t].corners;
                 },
                 [](const Corners& corners) { return corners[0] != kNoNumber; }, changes,
                 changes.removed_triangles, changes.added_triangles);
}

}  // namespace terrace::tri
