// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cassert>
#include <cstdint>

#include "delaunay3/facet_table.hpp"
#include "delaunay3/mesh.hpp"

namespace terrace::tri::spatial {

/// The operations that all methods of filling a hole share: keeping the open facets, making a
/// tetrahedron on one, and joining matching facets. Facets may be taken in any order, as long as
/// each gets the right tetrahedron.
template <class Kernel>
class HoleFilling {
 public:
  using Point = typename Kernel::Point;

  explicit HoleFilling(Mesh<Kernel>& mesh)
      : mesh_(mesh), hole_(mesh.hole), table_(mesh.hole.table) {
    hole_.incident.resize(hole_.vertex.size());
    hole_.pending.clear();
    table_.clear(hole_.facets.size());
    for (std::uint32_t i = 0; i < hole_.facets.size(); ++i) {
      table_.find_or_add(hole_.facets[i].corner, i);
      if (is_finite_facet(i)) hole_.pending.push_back(i);
    }
    std::uint32_t finite_removed = 0;
    for (const std::uint32_t t : hole_.slots)
      if (!has_ghost(mesh_.tetrahedron[t].corner)) ++finite_removed;
    mesh_.finite_count -= finite_removed;
  }

  /// The most recently opened finite facet that is still open, or kNone.
  std::uint32_t next_open() {
    while (!hole_.pending.empty()) {
      const std::uint32_t i = hole_.pending.back();
      hole_.pending.pop_back();
      if (is_open(i)) return i;
    }
    return kNone;
  }
  [[nodiscard]] bool is_open(std::uint32_t i) const {
    return hole_.facets[i].outer != hole_.kMatched;
  }
  [[nodiscard]] bool is_finite_facet(std::uint32_t i) const {
    const auto& corner = hole_.facets[i].corner;
    return corner[0] != 0 && corner[1] != 0 && corner[2] != 0;
  }

  /// Makes the tetrahedron of an open facet and a vertex or the ghost. Newly opened facets are at
  /// the end of the list.
  void attach(std::uint32_t i, std::uint32_t apex) {
    const auto [a, b, c] = hole_.facets[i].corner;
    if (used_ == hole_.slots.size()) hole_.slots.push_back(mesh_.new_tetrahedron());
    const std::uint32_t t = hole_.slots[used_++];
    const std::array<std::uint32_t, 4> local = {apex, a, b, c};
    for (std::size_t k = 0; k < 4; ++k) {
      mesh_.tetrahedron[t].corner[k] = hole_.vertex[local[k]];
      hole_.incident[local[k]] = t;
    }
    if (apex != 0) ++mesh_.finite_count;
    mesh_.link(make_side(t, 0), hole_.facets[i].outer);
    hole_.facets[i].outer = hole_.kMatched;
    for (std::uint32_t k = 1; k < 4; ++k) {
      const auto& f = kFacet[k];
      // Seen from the other side.
      const std::array<std::uint32_t, 3> corner = {local[f[0]], local[f[2]], local[f[1]]};
      const auto next = static_cast<std::uint32_t>(hole_.facets.size());
      const std::uint32_t facet = table_.find_or_add(corner, next);
      if (facet != next) {
        assert(is_open(facet));
        mesh_.link(make_side(t, k), hole_.facets[facet].outer);
        hole_.facets[facet].outer = hole_.kMatched;
        continue;
      }
      hole_.facets.push_back({corner, make_side(t, k)});
      if (is_finite_facet(next)) hole_.pending.push_back(next);
    }
  }

  /// Gives every vertex of the hole a new tetrahedron and frees unused slots.
  void finish() {
    for (std::uint32_t k = 1; k < hole_.vertex.size(); ++k)
      mesh_.vertex[hole_.vertex[k]].incident = hole_.incident[k];
    for (; used_ < hole_.slots.size(); ++used_) mesh_.free_tetrahedron_slot(hole_.slots[used_]);
  }

 private:
  Mesh<Kernel>& mesh_;
  Hole<Point>& hole_;
  FacetTable table_;
  std::size_t used_ = 0;  ///< slots that have been reused
};

/// Fills mesh.hole, which has at least one finite facet and vertices that are not coplanar, see
/// wrap.cpp. Gives its vertices tetrahedra and frees unused slots.
template <class Kernel>
void wrap_hole(Mesh<Kernel>& mesh);

/// The same for facets that another method of filling has left open.
template <class Kernel>
void wrap_rest(Mesh<Kernel>& mesh, HoleFilling<Kernel>& filling);

}  // namespace terrace::tri::spatial
