// SPDX-License-Identifier: GPL-3.0-or-later
// Fills the hole of one vertex by cutting ears, after J. Skala, thesis, section 8.2, and O.
// Devillers, "On deletion in Delaunay triangulations", doi:10.1142/S0218195902000815. An ear is the
// tetrahedron of two neighbouring facets. Ears wait in a priority queue. The first is the one whose
// sphere contains the removed vertex least, measured by its power, which is the in-sphere test
// divided by the orientation.
//
// The powers are rounded, so the order is only approximate, and arbitrary among equal powers.
// Before an ear is cut, exact perturbed tests check that its sphere contains none of the hole's
// vertices. Such a tetrahedron belongs to the result in any order, so the result is exact, ties
// included. An ear that fails will always fail and is dropped. With ties and at the hull, the queue
// may become empty before the hole is full. The rest is then wrapped.
#include "ear_queue.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

#include "delaunay3/access.hpp"
#include "delaunay3/double_kernel.hpp"
#include "delaunay3/int_kernel.hpp"
#include "delaunay3/operations.hpp"
#include "delaunay3/predicates.hpp"
#include "delaunay3/wrap/wrap.hpp"

namespace terrace::research {

using namespace tri;
using namespace tri::spatial;

namespace {

template <class Kernel>
class EarQueue {
 public:
  using Point = typename Kernel::Point;

  EarQueue(Mesh<Kernel>& mesh, HoleFilling<Kernel>& filling, const Point& removed)
      : mesh_(mesh), hole_(mesh.hole), filling_(filling), removed_(removed) {}

  void run() {
    add_facets(0);
    while (!queue_.empty()) {
      std::pop_heap(queue_.begin(), queue_.end(), later);
      const Ear ear = queue_.back();
      queue_.pop_back();
      if (!filling_.is_open(ear.facet) || !is_empty(ear)) continue;
      const auto before = static_cast<std::uint32_t>(hole_.facets.size());
      filling_.attach(ear.facet, ear.apex);
      add_facets(before);
    }
  }

 private:
  struct Ear {
    double power;
    std::uint32_t facet;
    std::uint32_t apex;
  };
  struct Edge {
    std::uint64_t ends;  ///< from, to
    std::uint32_t facet;
    bool operator<(const Edge& other) const {
      return ends != other.ends ? ends < other.ends : facet < other.facet;
    }
  };

  static bool later(const Ear& a, const Ear& b) {
    if (a.power != b.power) return a.power > b.power;
    return a.facet != b.facet ? a.facet > b.facet : a.apex > b.apex;
  }

  /// Lists the edges of facets from index `first` on, and the ears at these edges.
  void add_facets(std::uint32_t first) {
    const auto count = static_cast<std::uint32_t>(hole_.facets.size());
    const auto before = static_cast<std::ptrdiff_t>(edges_.size());
    for (std::uint32_t i = first; i < count; ++i) {
      const auto& corner = hole_.facets[i].corner;
      for (std::size_t k = 0; k < 3; ++k)
        edges_.push_back({ends(corner[(k + 1) % 3], corner[(k + 2) % 3]), i});
    }
    std::sort(edges_.begin() + before, edges_.end());
    std::inplace_merge(edges_.begin(), edges_.begin() + before, edges_.end());
    for (std::uint32_t i = first; i < count; ++i) {
      if (!filling_.is_open(i) || !filling_.is_finite_facet(i)) continue;
      const auto& corner = hole_.facets[i].corner;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint64_t back = ends(corner[(k + 2) % 3], corner[(k + 1) % 3]);
        for (auto at = std::lower_bound(edges_.begin(), edges_.end(), Edge{back, 0});
             at != edges_.end() && at->ends == back; ++at) {
          // Takes each pair once.
          if (at->facet < i && filling_.is_open(at->facet)) add_ear(i, at->facet);
        }
      }
    }
  }
  static std::uint64_t ends(std::uint32_t from, std::uint32_t to) {
    return std::uint64_t{from} << 32 | to;
  }

  /// Adds the tetrahedron of a facet and the corner of another facet that is not in it.
  void add_ear(std::uint32_t facet, std::uint32_t other) {
    const auto [a, b, c] = hole_.facets[facet].corner;
    for (const std::uint32_t d : hole_.facets[other].corner) {
      if (d == 0 || d == a || d == b || d == c) continue;
      if (Kernel::orientation(hole_.point[d], hole_.point[a], hole_.point[b], hole_.point[c]) <= 0)
        continue;
      queue_.push_back({power(d, a, b, c), facet, d});
      std::push_heap(queue_.begin(), queue_.end(), later);
    }
  }

  /// Rounded; comes last if it overflows.
  [[nodiscard]] double power(std::uint32_t d, std::uint32_t a, std::uint32_t b,
                             std::uint32_t c) const {
    std::array<std::array<double, 3>, 4> r;
    const std::array<std::uint32_t, 4> corner = {d, a, b, c};
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        r[i][k] = static_cast<double>(hole_.point[corner[i]][k]) - static_cast<double>(removed_[k]);
    const auto pair = [&](std::size_t i, std::size_t k) { return Pair{r[i][k], r[i + 1][k]}; };
    const double test =
        in_sphere_value({pair(0, 0), pair(2, 0), pair(0, 1), pair(2, 1), pair(0, 2), pair(2, 2)})
            .value;
    for (std::size_t i = 1; i < 4; ++i)
      for (std::size_t k = 0; k < 3; ++k) r[i][k] -= r[0][k];
    const double orientation = (r[1][1] * r[2][2] - r[1][2] * r[2][1]) * r[3][0] +
                               (r[1][2] * r[2][0] - r[1][0] * r[2][2]) * r[3][1] +
                               (r[1][0] * r[2][1] - r[1][1] * r[2][0]) * r[3][2];
    const double result = test / orientation;
    return result >= 0 ? result : std::numeric_limits<double>::infinity();
  }

  [[nodiscard]] bool is_empty(const Ear& ear) const {
    const auto [a, b, c] = hole_.facets[ear.facet].corner;
    const auto at = [&](std::uint32_t k) -> const auto& { return mesh_.vertex[hole_.vertex[k]]; };
    for (std::uint32_t k = 1; k < hole_.vertex.size(); ++k) {
      if (k == a || k == b || k == c || k == ear.apex) continue;
      if (inside_sphere<Kernel>(at(ear.apex), at(a), at(b), at(c), hole_.point[k], mesh_.lattice))
        return false;
    }
    return true;
  }

  Mesh<Kernel>& mesh_;
  Hole<Point>& hole_;
  HoleFilling<Kernel>& filling_;
  const Point& removed_;
  std::vector<Ear> queue_;
  std::vector<Edge> edges_;
};

/// Returns the vertex whose removal left mesh.hole.
template <class Kernel>
const typename Kernel::Point& removed_point(const Mesh<Kernel>& mesh) {
  for (const std::uint32_t v : mesh.tetrahedron[mesh.hole.slots.front()].corner) {
    if (v != kGhost && mesh.vertex[v].incident == kInHole) return mesh.vertex[v].point;
  }
  assert(false);
  return mesh.hole.point.front();
}

template <class Kernel>
void fill_by_ears(Mesh<Kernel>& mesh) {
  const typename Kernel::Point removed = removed_point(mesh);
  HoleFilling<Kernel> filling(mesh);
  EarQueue<Kernel>(mesh, filling, removed).run();
  wrap_rest(mesh, filling);
}

}  // namespace

template <class Coord>
void remove_by_ears(Delaunay3<Coord>& triangulation, VertexId vertex) {
  const std::uint32_t one = slot(vertex);
  [[maybe_unused]] const auto scope = Delaunay3Access::scope(triangulation);
  auto& mesh = Delaunay3Access::mesh(triangulation);
  using Kernel = typename std::remove_reference_t<decltype(mesh)>::Kernel;
  remove_set<Kernel>(mesh, std::span(&one, 1), fill_by_ears<Kernel>);
}

template void remove_by_ears(Delaunay3<std::int32_t>&, VertexId);
template void remove_by_ears(Delaunay3<double>&, VertexId);

}  // namespace terrace::research
