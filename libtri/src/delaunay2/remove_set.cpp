// SPDX-License-Identifier: Apache-2.0
// Removes a set of vertices as one hole, after J. Skala, thesis, section 8.1, extended to the whole
// set at once: all triangles at the vertices are taken out first. If they leave a simple disc (or
// several), it is filled in one go. The thesis requires that a vertex is on the hole's boundary and
// that no boundary vertex occurs twice. Here these rules become one count (Euler's formula) and one
// comparison.
//
// Vertices that stay but are inside the hole (islands) or touch its boundary twice (pinches) are
// absorbed: taken out as well and reinserted into the filled hole.
#include <algorithm>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "insert.hpp"
#include "int_kernel.hpp"
#include "operations.hpp"
#include "walk.hpp"
#include "windowed_kernel.hpp"

namespace terrace::tri::planar {
namespace {

/// Smaller sets are removed one by one.
constexpr std::size_t kMinSet = 4;
/// Filling is quadratic at worst, so longer boundaries are not attempted.
constexpr std::size_t kMaxBoundary = 4096;
/// Scratch memory beyond this is released.
constexpr std::size_t kMaxScratch = std::size_t{1} << 20;

/// Values of Mesh::mark.
constexpr std::uint8_t kKept = 0;
constexpr std::uint8_t kRemoved = 1;
constexpr std::uint8_t kOnBoundary = 2;

/// Set in Triangle::corner[0], between flood() and unmark_region(), for triangles of the region.
constexpr std::uint32_t kInRegion = 0x80000000u;

/// In an entry of the queue: no side, because the triangle is a start of the flood.
constexpr std::uint32_t kNoSide = 3;

/// Arrays of the flood. Each triangle adds at most three entries to the queue and one to each of
/// the others.
struct Output {
  explicit Output(Region& region) : region_(region) {}
  void make_room(std::size_t entries) {
    if (entries > size_) [[unlikely]]
      grow(static_cast<std::uint32_t>(entries));
  }

  Side* queue = nullptr;
  std::uint32_t* triangles = nullptr;
  std::uint32_t* mixed = nullptr;
  Side* rim = nullptr;

 private:
  void grow(std::uint32_t entries) {
    size_ = entries + entries / 2;
    const auto resized = [size = size_](auto& array) {
      array.resize(size);
      return array.data();
    };
    queue = resized(region_.queue);
    triangles = resized(region_.triangles);
    mixed = resized(region_.mixed);
    rim = resized(region_.rim);
  }

  Region& region_;
  std::uint32_t size_ = 0;
};

/// Finds the region left by removed vertices: all triangles at them, and the edges around these.
/// Input: the vertices in region.removed, and Mesh::mark, which is kRemoved for them and kKept for
/// all others. Fills region.triangles, .mixed and .boundary. Marks the triangles with kInRegion.
///
/// Floods the region across edges breadth-first, so that a triangle is fetched from memory long
/// before its turn comes, and almost without branches, which could not be predicted. (Walking
/// around each vertex would visit each triangle three times in succession.) O(triangles).
template <class Kernel>
void flood(Mesh<Kernel>& mesh) {
  Region& region = mesh.region;
  Output out(region);
  std::size_t tail = 0;
  out.make_room(4 * region.removed.size());
  Triangle* const triangle = mesh.triangle.data();
  const std::uint8_t* const mark = mesh.mark.data();
  std::uint32_t* const incident = mesh.incident.data();
  const auto push = [&](Side side, bool keep) {
    out.queue[tail] = side;
    tail += keep ? 1 : 0;
    __builtin_prefetch(&triangle[triangle_of(side)], 1);
  };
  // Starts from a triangle of every vertex, as the set need not be connected.
  for (const std::uint32_t v : region.removed) push(make_side(incident[v], kNoSide), true);

  std::uint32_t triangles = 0;
  std::uint32_t mixed = 0;
  std::uint32_t rim = 0;
  for (std::size_t head = 0; head < tail; ++head) {
    out.make_room(tail + 3);
    const std::uint32_t t = triangle_of(out.queue[head]);
    const std::uint32_t entry_side = index_of(out.queue[head]);
    Triangle& at = triangle[t];
    const bool first_visit = (at.corner[0] & kInRegion) == 0;
    const unsigned a = mark[at.corner[0] & ~kInRegion];
    const unsigned b = mark[at.corner[1]];
    const unsigned c = mark[at.corner[2]];
    at.corner[0] |= kInRegion;
    out.triangles[triangles] = t;
    triangles += first_visit ? 1 : 0;
    // The triangle across an edge with a removed vertex belongs to the region too.
    push(at.mate[0], first_visit & ((b | c) != 0) & (entry_side != 0));
    push(at.mate[1], first_visit & ((c | a) != 0) & (entry_side != 1));
    push(at.mate[2], first_visit & ((a | b) != 0) & (entry_side != 2));
    const unsigned count = a + b + c;
    out.mixed[mixed] = t;
    mixed += (first_visit & (count < 3)) ? 1 : 0;
    out.rim[rim] = make_side(t, b + 2 * c);
    rim += (first_visit & (count == 1)) ? 1 : 0;
  }
  region.triangles.resize(triangles);
  region.mixed.resize(mixed);

  // The boundary consists of edges between kept vertices that have the region on one side only.
  region.boundary.clear();
  for (std::uint32_t k = 0; k < rim; ++k) {
    const Triangle& at = triangle[triangle_of(out.rim[k])];
    const std::uint32_t i = index_of(out.rim[k]);
    const Side outer = at.mate[i];
    if ((triangle[triangle_of(outer)].corner[0] & kInRegion) != 0) continue;
    const std::uint32_t from = at.corner[next_index(i)] & ~kInRegion;
    __builtin_prefetch(&incident[from], 1);
    region.boundary.push_back({from, at.corner[previous_index(i)] & ~kInRegion, outer});
  }
}

/// Removes kInRegion from the region's triangles.
template <class Kernel>
void unmark_region(Mesh<Kernel>& mesh) {
  for (const std::uint32_t t : span_of(mesh.region.triangles))
    mesh.triangle[t].corner[0] &= ~kInRegion;
}

template <class Kernel>
class SetRemoval {
 public:
  SetRemoval(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices)
      : mesh_(mesh), region_(mesh.region), requested_(vertices.size()) {
    region_.removed.assign(vertices.begin(), vertices.end());
    const std::uint32_t marked = mesh.mark.size();
    mesh.mark.resize(mesh.point.size());
    std::fill(mesh.mark.data() + marked, mesh.mark.data() + mesh.mark.size(), kKept);
    for (const std::uint32_t v : region_.removed) mesh_.mark[v] = kRemoved;
  }
  ~SetRemoval() {
    for (const std::uint32_t v : region_.removed) mesh_.mark[v] = kKept;
    if (region_.queue.bytes() > kMaxScratch) region_ = {};
  }
  SetRemoval(const SetRemoval&) = delete;
  SetRemoval& operator=(const SetRemoval&) = delete;

  /// Returns false, having changed nothing, if removal by holes was not possible.
  bool run() {
    flood(mesh_);
    if (region_.boundary.size() > kMaxBoundary) {
      unmark_region(mesh_);
      return false;
    }
    for (int round = 0; !is_simple(); ++round) {
      restore_incident();
      if (round == 2 || !absorb()) {
        unmark_region(mesh_);
        return false;
      }
    }
    unmark_region(mesh_);
    if (survivors_collinear()) {
      restore_incident();
      return false;
    }
    fill_loops();
    reinsert_absorbed();
    return true;
  }

 private:
  /// True if every hole is a disc whose boundary vertices are different. Sets Mesh::incident of
  /// these to the number of the edge that starts there.
  bool is_simple() {
    const auto& boundary = region_.boundary;
    region_.pinches.clear();
    for (std::uint32_t e = 0; e < boundary.size(); ++e) mesh_.incident[boundary[e].from] = e;
    if (boundary.empty()) return false;
    for (std::uint32_t e = 0; e < boundary.size(); ++e)
      if (mesh_.incident[boundary[e].from] != e) region_.pinches.push_back(boundary[e].from);
    if (!region_.pinches.empty()) return false;
    trace_loops();
    return region_.triangles.size() + 2 * region_.loop_ends.size() ==
           2 * region_.removed.size() + boundary.size();
  }

  /// Orders the boundary edges into loops.
  void trace_loops() {
    const auto& boundary = region_.boundary;
    region_.loop_edges.clear();
    region_.loop_ends.clear();
    region_.visited.assign(boundary.size(), 0);
    for (std::uint32_t e = 0; e < boundary.size(); ++e) {
      if (region_.visited[e] != 0) continue;
      for (std::uint32_t at = e; region_.visited[at] == 0; at = mesh_.incident[boundary[at].to]) {
        region_.visited[at] = 1;
        region_.loop_edges.push_back(at);
      }
      region_.loop_ends.push_back(region_.loop_edges.size());
    }
  }

  void restore_incident() {
    for (const Region::Edge& edge : region_.boundary)
      mesh_.incident[edge.from] = triangle_of(edge.outer);
  }

  /// Adds islands and pinches to the removed vertices. Returns false if there are too many or none,
  /// or if the ghost is among them.
  bool absorb() {
    auto& removed = region_.removed;
    auto& pinches = region_.pinches;
    const std::size_t size_before = removed.size();
    const std::size_t max_absorbed = requested_ / 4 + 8;
    std::sort(pinches.begin(), pinches.end());
    pinches.erase(std::unique(pinches.begin(), pinches.end()), pinches.end());
    for (const std::uint32_t v : pinches) {
      if (v == kGhost || removed.size() - requested_ >= max_absorbed) return false;
      mesh_.mark[v] = kRemoved;
      removed.push_back(v);
    }
    for (const Region::Edge& edge : region_.boundary)
      if (mesh_.mark[edge.from] == kKept) mesh_.mark[edge.from] = kOnBoundary;
    const bool possible = absorb_islands(max_absorbed);
    for (const Region::Edge& edge : region_.boundary)
      if (mesh_.mark[edge.from] == kOnBoundary) mesh_.mark[edge.from] = kKept;
    if (!possible || removed.size() == size_before) return false;
    // All triangles of an island are already listed. Only pinches add new ones.
    if (!pinches.empty()) {
      unmark_region(mesh_);
      flood(mesh_);
    }
    return true;
  }

  bool absorb_islands(std::size_t max_absorbed) {
    auto& removed = region_.removed;
    for (const std::uint32_t t : span_of(region_.mixed)) {
      const auto& [a, b, c] = mesh_.triangle[t].corner;
      for (const std::uint32_t v : {a & ~kInRegion, b, c}) {
        if (mesh_.mark[v] != kKept) continue;
        if (v == kGhost || removed.size() - requested_ >= max_absorbed) return false;
        mesh_.mark[v] = kRemoved;
        removed.push_back(v);
      }
    }
    return true;
  }

  bool survivors_collinear() const {
    // Survivors can be collinear only if all of them are on the boundary.
    if (region_.boundary.size() + region_.removed.size() < mesh_.vertex_count) return false;
    std::vector<std::uint32_t> survivors;
    for (const Region::Edge& edge : region_.boundary) survivors.push_back(edge.from);
    return collinear<Kernel>(mesh_, survivors);
  }

  void fill_loops() {
    auto& hole = mesh_.hole;
    if (mesh_.journal.on())
      for (const std::uint32_t t : span_of(region_.triangles)) mesh_.record(t);
    const auto triangles = span_of(region_.triangles);
    // Filling takes slots from the end.
    std::uint32_t used = 0;
    std::size_t begin = 0;
    for (const std::size_t end : region_.loop_ends) {
      hole.vertex.clear();
      hole.point.clear();
      hole.outer.clear();
      for (std::size_t k = begin; k < end; ++k) {
        const Region::Edge& edge = region_.boundary[region_.loop_edges[k]];
        hole.vertex.push_back(edge.from);
        hole.point.push_back(mesh_.point[edge.from]);
        hole.outer.push_back(edge.outer);
      }
      const auto count = static_cast<std::uint32_t>(end - begin) - 2;
      const auto slots = triangles.subspan(used, count);
      hole.slots.assign(slots.begin(), slots.end());
      used += count;
      turn_ghost_inside(hole);
      fill_hole(mesh_);
      begin = end;
    }
    for (const std::uint32_t t : triangles.subspan(used)) mesh_.free_triangle_slot(t);
    for (std::size_t k = 0; k < requested_; ++k) mesh_.free_vertex_slot(region_.removed[k]);
    mesh_.last_vertex = hole.vertex.front();
  }

  /// Reinserts the absorbed vertices.
  void reinsert_absorbed() {
    for (std::size_t k = requested_; k < region_.removed.size(); ++k) {
      const std::uint32_t v = region_.removed[k];
      const WalkEnd end = walk(mesh_, mesh_.point[v], mesh_.incident[mesh_.last_vertex]);
      insert_vertex(mesh_, v, end.triangle);
      mesh_.last_vertex = v;
    }
  }

  Mesh<Kernel>& mesh_;
  Region& region_;  ///< region_.removed: the requested vertices, then the absorbed ones
  std::size_t requested_;
};

template <class Kernel>
void remove_set_flat(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices) {
  for (const std::uint32_t v : vertices) mesh.free_vertex_slot(v);
  std::erase_if(mesh.line, [&](std::uint32_t v) { return !mesh.vertex_alive(v); });
  mesh.last_vertex = mesh.line.empty() ? kNone : mesh.line.front();
}

}  // namespace

template <class Kernel>
void remove_set(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices) {
  if (mesh.flat) {
    remove_set_flat(mesh, vertices);
    return;
  }
  if (vertices.size() >= kMinSet && SetRemoval<Kernel>(mesh, vertices).run()) return;
  for (const std::uint32_t v : vertices) {
    mesh.ticks(kTicksOfWalk);
    remove_vertex(mesh, v);
  }
}

#ifdef TERRACE_TRI_CORE
template void remove_set(Mesh<IntKernel>&, std::span<const std::uint32_t>);
template void remove_set(Mesh<WindowedKernel>&, std::span<const std::uint32_t>);
#else
template void remove_set(Mesh<DoubleKernel>&, std::span<const std::uint32_t>);
template void remove_set(Mesh<EllipticalKernel>&, std::span<const std::uint32_t>);
#endif

}  // namespace terrace::tri::planar
