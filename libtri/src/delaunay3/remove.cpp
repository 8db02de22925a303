// SPDX-License-Identifier: Apache-2.0
// Removes one or many vertices: deletes all their tetrahedra and fills the hole in one pass,
// whatever its shape. The hole may contain surviving vertices (islands), have handles and pinches,
// or touch the hull. It ends at the facets of surviving tetrahedra. Holes that touch only in edges
// or vertices are filled one after the other.
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "curve_sort.hpp"
#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "flat.hpp"
#include "int_kernel.hpp"
#include "operations.hpp"

namespace terrace::tri::spatial {
namespace {

/// Filling a hole tests each of its vertices for each facet, so larger sets are divided.
constexpr std::size_t kMaxVerticesPerHole = 512;
/// Replacing this many tetrahedra takes about as long as an insertion.
constexpr std::size_t kSlotsPerInsertion = 24;

template <class Kernel>
class Removal {
 public:
  Removal(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices, FillHole<Kernel> fill)
      : mesh_(mesh), hole_(mesh.hole), vertices_(vertices), fill_(fill) {}

  void run() {
    first_tetrahedra_.clear();
    for (const std::uint32_t v : vertices_) {
      first_tetrahedra_.push_back(mesh_.vertex[v].incident);
      mesh_.vertex[v].incident = kPendingRemoval;
    }
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      if (mesh_.vertex[vertices_[i]].incident != kPendingRemoval) continue;
      gather_hole(first_tetrahedra_[i]);
      if (must_restart()) {
        for (const std::uint32_t v : vertices_) mesh_.free_vertex_slot(v);
        std::vector<std::uint32_t> survivors;
        for (std::uint32_t v = 1; v < mesh_.vertex.size(); ++v)
          if (mesh_.vertex_alive(v)) survivors.push_back(v);
        restart(mesh_, std::move(survivors));
        return;
      }
      for (const std::uint32_t t : hole_.slots) mesh_.mark[t] = kUnknown;
      mesh_.ticks(kTicksOfInsertion * hole_.slots.size() / kSlotsPerInsertion);
      fill_(mesh_);
    }
    for (const std::uint32_t v : vertices_) mesh_.free_vertex_slot(v);
    mesh_.last_vertex = hole_.vertex[1];
  }

 private:
  [[nodiscard]] bool is_removed(std::uint32_t v) const {
    const std::uint32_t incident = mesh_.vertex[v].incident;
    return incident == kPendingRemoval || incident == kInHole;
  }

  /// Returns the local number of a surviving vertex, and assigns one if it has none.
  std::uint32_t local_number(std::uint32_t v) {
    if (v == kGhost) return 0;
    std::uint32_t& incident = mesh_.vertex[v].incident;
    if ((incident & kLocalBit) == 0) {
      incident = kLocalBit | static_cast<std::uint32_t>(hole_.vertex.size());
      hole_.vertex.push_back(v);
      hole_.point.push_back(mesh_.vertex[v].point);
    }
    return incident & ~kLocalBit;
  }

  /// Lists the tetrahedra of a hole, the facets around it, and the surviving vertices on it.
  void gather_hole(std::uint32_t start) {
    hole_.vertex.assign(1, kGhost);
    hole_.point.assign(1, {});
    hole_.facets.clear();
    hole_.slots.clear();
    take_tetrahedron(start);
    for (std::size_t k = 0; k < hole_.slots.size(); ++k) {
      const Tetrahedron& t = mesh_.tetrahedron[hole_.slots[k]];
      std::array<std::uint32_t, 4> local;
      unsigned removed_corners = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        const std::uint32_t v = t.corner[i];
        if (is_removed(v)) {
          mesh_.vertex[v].incident = kInHole;
          removed_corners |= 1u << i;
        } else {
          local[i] = local_number(v);
        }
      }
      for (std::uint32_t i = 0; i < 4; ++i) {
        const std::uint32_t other = tetrahedron_of(t.mate[i]);
        if (mesh_.mark[other] == kCollected) continue;
        // The neighbour belongs to the hole if it has a removed corner: on the shared facet, or
        // opposite to it.
        if ((removed_corners & ~(1u << i)) != 0 ||
            is_removed(mesh_.tetrahedron[other].corner[index_of(t.mate[i])])) {
          take_tetrahedron(other);
        } else {
          const auto& f = kFacet[i];
          hole_.facets.push_back({{local[f[0]], local[f[1]], local[f[2]]}, t.mate[i]});
        }
      }
    }
  }
  void take_tetrahedron(std::uint32_t t) {
    mesh_.mark[t] = kCollected;
    mesh_.record(t);
    hole_.slots.push_back(t);
    for (const Side mate : mesh_.tetrahedron[t].mate)
      __builtin_prefetch(&mesh_.tetrahedron[tetrahedron_of(mate)]);
  }

  /// Returns true if everything must be rebuilt: no tetrahedron remains to start from, the
  /// remaining vertices are coplanar (then all of them are on this hole), or the hole has so many
  /// vertices that a rebuild costs less than testing every vertex with every facet.
  [[nodiscard]] bool must_restart() const {
    if (hole_.facets.empty()) return true;
    const std::size_t vertices = hole_.vertex.size();
    constexpr std::size_t kTestsPerInsertion = 2048;
    if (vertices > FacetTable::kMaxCorner ||
        vertices * vertices > kTestsPerInsertion * mesh_.vertex_count)
      return true;
    return vertices - 1 + vertices_.size() == mesh_.vertex_count &&
           coplanar<Kernel>(mesh_, hole_.vertex);
  }

  Mesh<Kernel>& mesh_;
  Hole<typename Kernel::Point>& hole_;
  std::span<const std::uint32_t> vertices_;
  FillHole<Kernel> fill_;
  std::vector<std::uint32_t> first_tetrahedra_;
};

}  // namespace

template <class Kernel>
void remove_set(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices,
                FillHole<Kernel> fill) {
  if (vertices.empty()) return;
  if (mesh.flat) {
    remove_flat(mesh, vertices);
    return;
  }
  if (vertices.size() <= kMaxVerticesPerHole) {
    Removal<Kernel>(mesh, vertices, fill).run();
    return;
  }
  std::vector<typename Kernel::Point> points;
  points.reserve(vertices.size());
  for (const std::uint32_t v : vertices) points.push_back(mesh.vertex[v].point);
  const Pool<std::uint32_t> order = hilbert_order<typename Kernel::Point>(points);
  std::vector<std::uint32_t> part;
  for (std::uint32_t begin = 0; begin < order.size();) {
    part.clear();
    for (; begin < order.size() && part.size() < kMaxVerticesPerHole; ++begin)
      part.push_back(vertices[order[begin]]);
    remove_set<Kernel>(mesh, part, fill);
  }
}

#ifdef TERRACE_TRI_CORE
template void remove_set(Mesh<IntKernel>&, std::span<const std::uint32_t>, FillHole<IntKernel>);
#else
template void remove_set(Mesh<DoubleKernel>&, std::span<const std::uint32_t>,
                         FillHole<DoubleKernel>);
template void remove_set(Mesh<EllipticalKernel>&, std::span<const std::uint32_t>,
                         FillHole<EllipticalKernel>);
#endif

}  // namespace terrace::tri::spatial
