// SPDX-License-Identifier: Apache-2.0
// Bulk construction numbers vertices along a Hilbert curve and inserts them one by one, each near
// the previous one, coarse samples first. Two threads insert the fine samples, see
// parallel_insert.cpp.
#include <algorithm>
#include <array>

#include "curve_sort.hpp"
#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "flat.hpp"
#include "insert.hpp"
#include "int_kernel.hpp"
#include "operations.hpp"

namespace terrace::tri::spatial {
namespace {

/// Passes over fewer points use one thread.
constexpr std::uint32_t kMinParallel = 8192;

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

/// Sorts the vertices of all slots into the flat state, whose plane mesh.basis spans. Duplicates
/// become aliases.
template <class Kernel>
void sort_flat_vertices(Mesh<Kernel>& mesh, std::uint32_t begin, std::uint32_t end) {
  std::vector<std::uint32_t>& flat_vertices = mesh.flat_vertices;
  for (std::uint32_t v = begin; v < end; ++v) flat_vertices.push_back(v);
  std::sort(flat_vertices.begin(), flat_vertices.end(), [&](std::uint32_t a, std::uint32_t b) {
    mesh.ticks(4);
    const auto& p = mesh.vertex[a].point;
    const auto& q = mesh.vertex[b].point;
    return lexicographically_less(p, q) || (same_point(p, q) && a < b);
  });
  std::size_t unique_count = 0;
  for (const std::uint32_t v : flat_vertices) {
    if (unique_count > 0 &&
        same_point(mesh.vertex[flat_vertices[unique_count - 1]].point, mesh.vertex[v].point)) {
      mesh.vertex[v].incident = kAlias | flat_vertices[unique_count - 1];
    } else {
      flat_vertices[unique_count++] = v;
    }
  }
  flat_vertices.resize(unique_count);
  mesh.last_vertex = flat_vertices.front();
}

/// Frees the slots of duplicates and sets vertex_of to the vertices that represent them.
template <class Kernel>
void resolve_aliases(Mesh<Kernel>& mesh, std::vector<VertexId>& vertex_of, std::uint32_t begin,
                     std::uint32_t end) {
  bool has_duplicates = false;
  for (std::uint32_t v = begin; v < end && !has_duplicates; ++v)
    has_duplicates = (mesh.vertex[v].incident & kAlias) != 0;
  if (!has_duplicates) return;
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
  std::vector<std::uint32_t> vertices;
  for (bool coarsest = true; step > 0; step /= kFactor, coarsest = false) {
    vertices.clear();
    if (!coarsest) vertices.reserve(count / step);
    for (std::uint32_t k = 0; k < count; k += step) {
      if (!coarsest && k % (step * kFactor) == 0) continue;
      if (std::find(first.begin(), first.end(), begin + k) == first.end())
        vertices.push_back(begin + k);
    }
    // With fewer points nearly all of space is close to the border between the parts.
    if (count / step < kMinParallel) {
      for (const std::uint32_t v : vertices) insert_slot(mesh, v, mesh.last_vertex);
    } else {
      insert_in_parallel(mesh, {begin, end, step}, vertices, threads);
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
    sort_flat_vertices(mesh, begin, end);
  } else {
    // Uniformly distributed points have 6.77 tetrahedra each, including ghosts.
    const std::size_t expected = 7 * std::size_t{mesh.vertex_count};
    mesh.tetrahedron.reserve(expected);
    mesh.mark.reserve(expected);
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
