// SPDX-License-Identifier: Apache-2.0
// Bulk construction numbers vertices along a Hilbert curve and inserts them one by one, each near
// the previous one, coarse samples first. Two threads insert the fine samples, see
// parts_insert.cpp.
#include "build.hpp"

#include <algorithm>
#include <array>

#include "../curve_sort.hpp"
#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "flat.hpp"
#include "hilbert.hpp"
#include "insert.hpp"
#include "int_kernel.hpp"
#include "parts_insert.hpp"

namespace terrace::tri::spatial {
namespace {

/// Passes over fewer points are not divided into parts.
constexpr std::uint32_t kInParts = 8192;

/// Puts points into slots begin, begin + 1, ... in Hilbert order. Returns the slot of each.
template <class Kernel>
std::vector<VertexId> number_vertices(Mesh<Kernel>& mesh,
                                      std::span<const typename Kernel::Point> points,
                                      std::uint32_t begin, unsigned threads) {
  Pool<std::uint32_t> order = hilbert_order<typename Kernel::Point>(points, threads);
  const auto count = static_cast<std::uint32_t>(points.size());
  mesh.vertex.reserve(begin + count);
  mesh.vertex.resize(begin + count);
  std::vector<VertexId> vertex_of(count);
  for_ranges(count, threads, [&](std::uint32_t from, std::uint32_t to) {
    for (std::uint32_t i = from; i < to; ++i) {
      mesh.vertex[begin + i] = {points[order[i]], kNoIncident};
      vertex_of[order[i]] = VertexId{begin + i};
    }
  });
  for (const auto& p : points) mesh.lattice.add(p);
  mesh.vertex_count = count;
  return vertex_of;
}

/// Puts all slots from `begin` on into the flat state; mesh.basis spans their plane.
template <class Kernel>
void wait_all(Mesh<Kernel>& mesh, std::uint32_t begin, std::uint32_t end) {
  std::vector<std::uint32_t>& waiting = mesh.waiting;
  for (std::uint32_t v = begin; v < end; ++v) waiting.push_back(v);
  std::sort(waiting.begin(), waiting.end(), [&](std::uint32_t a, std::uint32_t b) {
    mesh.ticks(4);
    const auto& p = mesh.vertex[a].point;
    const auto& q = mesh.vertex[b].point;
    return lexicographically_less(p, q) || (same_point(p, q) && a < b);
  });
  std::size_t kept = 0;
  for (const std::uint32_t v : waiting) {
    if (kept > 0 && same_point(mesh.vertex[waiting[kept - 1]].point, mesh.vertex[v].point)) {
      mesh.vertex[v].incident = kAlias | waiting[kept - 1];
    } else {
      waiting[kept++] = v;
    }
  }
  waiting.resize(kept);
  mesh.last_vertex = waiting.front();
}

/// Frees the slots of duplicates and sets vertex_of to the vertices that represent them.
template <class Kernel>
void resolve_aliases(Mesh<Kernel>& mesh, std::vector<VertexId>& vertex_of, std::uint32_t begin,
                     std::uint32_t end) {
  bool any = false;
  for (std::uint32_t v = begin; v < end && !any; ++v) any = (mesh.vertex[v].incident & kAlias) != 0;
  if (!any) return;
  for (VertexId& v : vertex_of) {
    const std::uint32_t entry = mesh.vertex[slot(v)].incident;
    if ((entry & kAlias) != 0) v = VertexId{entry & ~kAlias};
  }
  for (std::uint32_t v = end; v-- > begin;) {
    if ((mesh.vertex[v].incident & kAlias) == 0) continue;
    mesh.vertex[v].incident = kFreeVertexBit | mesh.free_vertex;
    mesh.free_vertex = v;
    --mesh.vertex_count;
  }
}

/// Inserts all vertices except the four of the first tetrahedron: every fourth vertex, before that
/// every fourth of these, and so on.
template <class Kernel>
void insert_all(Mesh<Kernel>& mesh, std::uint32_t begin, std::uint32_t end,
                const std::array<std::uint32_t, 4>& first, unsigned threads) {
  constexpr std::uint32_t kFactor = 4;
  const std::uint32_t count = end - begin;
  std::uint32_t step = 1;
  while (count / step > kFactor * kFactor) step *= kFactor;
  std::vector<std::uint32_t> going;
  for (bool coarsest = true; step > 0; step /= kFactor, coarsest = false) {
    going.clear();
    if (!coarsest) going.reserve(count / step);
    for (std::uint32_t k = 0; k < count; k += step) {
      if (!coarsest && k % (step * kFactor) == 0) continue;
      if (std::find(first.begin(), first.end(), begin + k) == first.end())
        going.push_back(begin + k);
    }
    // With fewer points nearly all of space is close to the border between the parts.
    if (count / step < kInParts) {
      for (const std::uint32_t v : going) insert_slot(mesh, v, mesh.last_vertex);
    } else {
      insert_in_parts(mesh, {begin, end, step}, going, threads);
    }
  }
}

}  // namespace

template <class Kernel>
std::vector<VertexId> build(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points,
                            unsigned threads) {
  mesh.forget_slots();
  if (points.empty()) return {};
  const std::uint32_t begin = mesh.vertex.size();
  std::vector<VertexId> vertex_of = number_vertices(mesh, points, begin, threads);
  const std::uint32_t end = mesh.vertex.size();
  mesh.basis.clear();
  std::uint32_t apex = begin;
  for (; apex < end && extend_basis(mesh, mesh.basis, apex); ++apex) mesh.ticks(kTicksOfInsertion);
  if (apex == end) {
    wait_all(mesh, begin, end);
  } else {
    // Uniformly distributed points have 6.77 tetrahedra each, including ghosts.
    const std::size_t usual = 7 * std::size_t{mesh.vertex_count};
    mesh.tetrahedron.reserve(usual);
    mesh.mark.reserve(usual);
    const std::array<std::uint32_t, 4> first = {mesh.basis[0], mesh.basis[1], mesh.basis[2], apex};
    // Several threads cannot record. The journal is filled afterwards, as all slots were free
    // before.
    Journal<typename Kernel::Point, 4> journal;
    std::swap(journal, mesh.journal);
    make_first(mesh, apex);
    mesh.last_vertex = apex;
    insert_all(mesh, begin, end, first, threads);
    std::swap(journal, mesh.journal);
    if (mesh.journal.on())
      for (std::uint32_t t = 0; t < mesh.tetrahedron.size(); ++t)
        mesh.journal.touch_cell(t, {kFreeCorner, 0, 0, 0});
  }
  resolve_aliases(mesh, vertex_of, begin, end);
  if (mesh.journal.on())
    for (std::uint32_t v = begin; v < end; ++v)
      if (mesh.vertex_alive(v)) mesh.journal.touch_vertex(v, false, mesh.vertex[v].point);
  return vertex_of;
}

#ifdef TERRACE_TRI_CORE
template std::vector<VertexId> build(Mesh<IntKernel>&, std::span<const IntKernel::Point>, unsigned);
#else
template std::vector<VertexId> build(Mesh<DoubleKernel>&, std::span<const DoubleKernel::Point>,
                                     unsigned);
template std::vector<VertexId> build(Mesh<EllipticalKernel>&,
                                     std::span<const EllipticalKernel::Point>, unsigned);
#endif

}  // namespace terrace::tri::spatial
