// SPDX-License-Identifier: GPL-3.0-or-later
// Removal of a set of vertices by one hole, after J. Skala, thesis, section 8.1, but set-wise: all
// triangles at the vertices are taken out first. Where what they leave is a simple disc (or
// several) it is filled at once. The thesis's rules that a vertex must lie on the hole's boundary,
// and that no boundary vertex may occur twice, become one count (Euler's formula) and one
// comparison.
//
// Vertices that stay but lie inside the hole (islands) or touch its boundary twice (pinches) are
// absorbed: taken out as well and put back into the filled hole.
#include <algorithm>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "fill.hpp"
#include "insert.hpp"
#include "int_kernel.hpp"
#include "remove.hpp"
#include "walk.hpp"

namespace terrace::tri::planar {
namespace {

/// Sets below this size are removed one by one.
constexpr std::size_t kMinSet = 4;
/// Filling is quadratic at worst: longer boundaries are not tried.
constexpr std::size_t kMaxBoundary = 4096;

/// Values of Mesh::mark.
constexpr std::uint8_t kKept = 0;
constexpr std::uint8_t kRemoved = 1;
constexpr std::uint8_t kOnBoundary = 2;

template <class Kernel>
class SetRemoval {
 public:
  SetRemoval(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices)
      : mesh_(mesh), removed_(vertices.begin(), vertices.end()), requested_(vertices.size()) {
    const std::uint32_t marked = mesh.mark.size();
    mesh.mark.resize(mesh.point.size());
    std::fill(mesh.mark.data() + marked, mesh.mark.data() + mesh.mark.size(), kKept);
    for (const std::uint32_t v : removed_) mesh_.mark[v] = kRemoved;
  }
  ~SetRemoval() {
    for (const std::uint32_t v : removed_) mesh_.mark[v] = kKept;
  }
  SetRemoval(const SetRemoval&) = delete;
  SetRemoval& operator=(const SetRemoval&) = delete;

  /// Whether it was possible by holes; else nothing has changed.
  bool run() {
    gather();
    for (int round = 0; !is_simple(); ++round) {
      restore_incident();
      if (round == 2 || !absorb()) return false;
    }
    if (!trace_loops()) {
      restore_incident();
      return false;
    }
    fill_loops();
    put_back();
    return true;
  }

 private:
  struct BoundaryEdge {
    std::uint32_t from;
    std::uint32_t to;
    Side outer;
  };

  /// Lists the triangles of all removed vertices, and the edges round them.
  void gather() {
    triangles_.clear();
    boundary_.clear();
    // Clusters lie scattered in memory: the triangle of a vertex is asked for a few vertices
    // before.
    constexpr std::size_t kAhead = 8;
    for (std::size_t k = 0; k < removed_.size(); ++k) {
      const std::uint32_t v = removed_[k];
      if (k + 2 * kAhead < removed_.size()) {
        __builtin_prefetch(&mesh_.incident[removed_[k + 2 * kAhead]]);
        __builtin_prefetch(&mesh_.triangle[mesh_.incident[removed_[k + kAhead]]]);
      }
      const std::uint32_t start = mesh_.incident[v];
      std::uint32_t t = start;
      do {
        const Triangle& at = mesh_.triangle[t];
        const std::uint32_t i = mesh_.corner_index(t, v);
        const std::uint32_t b = at.corner[next_index(i)];
        const std::uint32_t c = at.corner[previous_index(i)];
        const bool b_removed = mesh_.mark[b] == kRemoved;
        const bool c_removed = mesh_.mark[c] == kRemoved;
        // Once, at the lowest of its removed vertices.
        if (!(b_removed && b < v) && !(c_removed && c < v)) triangles_.push_back(t);
        if (!b_removed && !c_removed) {
          const Side outer = at.mate[i];
          const std::uint32_t beyond = mesh_.triangle[triangle_of(outer)].corner[index_of(outer)];
          if (mesh_.mark[beyond] != kRemoved) boundary_.push_back({b, c, outer});
        }
        t = triangle_of(at.mate[next_index(i)]);
      } while (t != start);
    }
  }

  /// Whether every hole is a disc whose boundary vertices are different. Mesh::incident of these
  /// becomes the number of the edge that starts there.
  bool is_simple() {
    pinches_.clear();
    for (std::uint32_t e = 0; e < boundary_.size(); ++e) mesh_.incident[boundary_[e].from] = e;
    for (std::uint32_t e = 0; e < boundary_.size(); ++e)
      if (mesh_.incident[boundary_[e].from] != e) pinches_.push_back(boundary_[e].from);
    if (!pinches_.empty() || boundary_.empty()) return false;
    count_loops();
    return triangles_.size() + 2 * loops_ == 2 * removed_.size() + boundary_.size();
  }

  void count_loops() {
    loops_ = 0;
    visited_.assign(boundary_.size(), 0);
    for (std::uint32_t e = 0; e < boundary_.size(); ++e) {
      if (visited_[e] != 0) continue;
      ++loops_;
      for (std::uint32_t at = e; visited_[at] == 0; at = mesh_.incident[boundary_[at].to])
        visited_[at] = 1;
    }
  }

  void restore_incident() {
    for (const BoundaryEdge& edge : boundary_) mesh_.incident[edge.from] = triangle_of(edge.outer);
  }

  /// Adds islands and pinches to the removed vertices; false where there are too many, or none, or
  /// the ghost is one.
  bool absorb() {
    const std::size_t before = removed_.size();
    const std::size_t most = requested_ / 4 + 8;
    std::sort(pinches_.begin(), pinches_.end());
    pinches_.erase(std::unique(pinches_.begin(), pinches_.end()), pinches_.end());
    for (const std::uint32_t v : pinches_) {
      if (v == kGhost || removed_.size() - requested_ >= most) return false;
      mesh_.mark[v] = kRemoved;
      removed_.push_back(v);
    }
    for (const BoundaryEdge& edge : boundary_)
      if (mesh_.mark[edge.from] == kKept) mesh_.mark[edge.from] = kOnBoundary;
    bool possible = true;
    for (const std::uint32_t t : triangles_) {
      for (const std::uint32_t v : mesh_.triangle[t].corner) {
        if (mesh_.mark[v] != kKept) continue;
        if (v == kGhost || removed_.size() - requested_ >= most) {
          possible = false;
          break;
        }
        mesh_.mark[v] = kRemoved;
        removed_.push_back(v);
      }
      if (!possible) break;
    }
    for (const BoundaryEdge& edge : boundary_)
      if (mesh_.mark[edge.from] == kOnBoundary) mesh_.mark[edge.from] = kKept;
    if (!possible || removed_.size() == before) return false;
    // An island's triangles were all listed before; only pinches bring new ones.
    if (!pinches_.empty()) gather();
    return true;
  }

  /// Orders the boundary edges by loops. False where filling would not be right or not be fast.
  bool trace_loops() {
    if (boundary_.size() > kMaxBoundary) return false;
    // Only when all survivors are on the boundary can they be collinear.
    if (boundary_.size() + removed_.size() >= mesh_.vertex_count) {
      std::vector<std::uint32_t> survivors;
      for (const BoundaryEdge& edge : boundary_) survivors.push_back(edge.from);
      if (collinear<Kernel>(mesh_, survivors)) return false;
    }
    ordered_.clear();
    loop_ends_.clear();
    visited_.assign(boundary_.size(), 0);
    for (std::uint32_t e = 0; e < boundary_.size(); ++e) {
      if (visited_[e] != 0) continue;
      for (std::uint32_t at = e; visited_[at] == 0; at = mesh_.incident[boundary_[at].to]) {
        visited_[at] = 1;
        ordered_.push_back(at);
      }
      loop_ends_.push_back(ordered_.size());
    }
    return true;
  }

  void fill_loops() {
    auto& hole = mesh_.hole;
    for (const std::uint32_t t : triangles_) mesh_.record(t);
    hole.slots = triangles_;
    std::size_t begin = 0;
    for (const std::size_t end : loop_ends_) {
      hole.vertex.clear();
      hole.point.clear();
      hole.outer.clear();
      for (std::size_t k = begin; k < end; ++k) {
        const BoundaryEdge& edge = boundary_[ordered_[k]];
        hole.vertex.push_back(edge.from);
        hole.point.push_back(mesh_.point[edge.from]);
        hole.outer.push_back(edge.outer);
      }
      turn_ghost_inside(hole);
      fill_hole(mesh_);
      begin = end;
    }
    for (const std::uint32_t t : hole.slots) mesh_.free_triangle_slot(t);
    for (std::size_t k = 0; k < requested_; ++k) mesh_.free_vertex_slot(removed_[k]);
    mesh_.last_vertex = hole.vertex.front();
  }

  /// Inserts the absorbed vertices again.
  void put_back() {
    for (std::size_t k = requested_; k < removed_.size(); ++k) {
      const std::uint32_t v = removed_[k];
      const WalkEnd end = walk(mesh_, mesh_.point[v], mesh_.incident[mesh_.last_vertex]);
      insert_vertex(mesh_, v, end.triangle);
      mesh_.last_vertex = v;
    }
  }

  Mesh<Kernel>& mesh_;
  std::vector<std::uint32_t> removed_;  ///< the requested ones first, then the absorbed ones
  std::size_t requested_;
  std::vector<std::uint32_t> triangles_;
  std::vector<BoundaryEdge> boundary_;
  std::vector<std::uint32_t> pinches_;
  std::vector<std::uint8_t> visited_;
  std::vector<std::uint32_t> ordered_;
  std::vector<std::size_t> loop_ends_;
  std::size_t loops_ = 0;
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
  for (const std::uint32_t v : vertices) remove_vertex(mesh, v);
}

template void remove_set(Mesh<IntKernel>&, std::span<const std::uint32_t>);
template void remove_set(Mesh<DoubleKernel>&, std::span<const std::uint32_t>);
template void remove_set(Mesh<EllipticalKernel>&, std::span<const std::uint32_t>);

}  // namespace terrace::tri::planar
