// SPDX-License-Identifier: Apache-2.0
// Bulk construction numbers vertices along a Hilbert curve and inserts them one by one, each near
// the one before. In pure Hilbert order the front of the curve would be a fan of long triangles, so
// coarse samples go first: every 32nd vertex, before that every 32nd of these, and so on. This
// halves the work (after N. Amenta, S. Choi, G. Rote, "Incremental constructions con BRIO",
// doi:10.1145/777792.777824, with fixed samples in place of random ones).
#include <algorithm>

#include "curve_sort.hpp"
#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "flat.hpp"
#include "insert.hpp"
#include "int_kernel.hpp"
#include "operations.hpp"
#include "walk.hpp"
#include "windowed_kernel.hpp"

namespace terrace::tri::planar {
namespace {

constexpr std::uint32_t kSample = 32;

/// Puts points into slots begin, begin + 1, ... in Hilbert order. Returns the slot of each.
template <class Kernel>
std::vector<VertexId> number_vertices(Mesh<Kernel>& mesh,
                                      std::span<const typename Kernel::Point> points,
                                      std::uint32_t begin) {
  Pool<std::uint32_t> order = hilbert_order<typename Kernel::Point>(points);
  const auto count = static_cast<std::uint32_t>(points.size());
  mesh.point.reserve(begin + count);
  mesh.incident.reserve(begin + count);
  mesh.point.resize(begin + count);
  mesh.incident.resize(begin + count);
  for (std::uint32_t i = 0; i < count; ++i) {
    mesh.point[begin + i] = points[order[i]];
    mesh.incident[begin + i] = kNoIncident;
  }
  std::vector<VertexId> vertex_of(count);
  for (std::uint32_t i = 0; i < count; ++i) vertex_of[order[i]] = VertexId{begin + i};
  mesh.vertex_count = count;
  return vertex_of;
}

/// Set in Mesh::incident while the slots of duplicates are not yet free. The other bits are the
/// vertex that represents the duplicate.
constexpr std::uint32_t kAlias = kFreeVertexBit;

template <class Kernel>
void insert_slot(Mesh<Kernel>& mesh, std::uint32_t vertex) {
  mesh.ticks(kTicksOfWalk);
  const auto& p = mesh.point[vertex];
  const WalkEnd end = walk(mesh, p, mesh.incident[mesh.last_vertex]);
  if (!end.outside) {
    const std::uint32_t equal = equal_corner(mesh, end.triangle, p);
    if (equal != kNone) {
      mesh.incident[vertex] = kAlias | equal;
      return;
    }
  }
  insert_vertex(mesh, vertex, end.triangle);
  mesh.last_vertex = vertex;
}

/// Sorts the vertices of all slots into mesh.line, the flat state. Duplicates become aliases.
template <class Kernel>
void sort_on_line(Mesh<Kernel>& mesh, std::uint32_t begin, std::uint32_t end) {
  std::vector<std::uint32_t>& line = mesh.line;
  for (std::uint32_t v = begin; v < end; ++v) line.push_back(v);
  std::sort(line.begin(), line.end(), [&](std::uint32_t a, std::uint32_t b) {
    mesh.ticks(4);
    return lexicographically_less(mesh.point[a], mesh.point[b]) ||
           (mesh.point[a] == mesh.point[b] && a < b);
  });
  std::size_t unique_count = 0;
  for (const std::uint32_t v : line) {
    if (unique_count > 0 && mesh.point[line[unique_count - 1]] == mesh.point[v]) {
      mesh.incident[v] = kAlias | line[unique_count - 1];
    } else {
      line[unique_count++] = v;
    }
  }
  line.resize(unique_count);
  mesh.last_vertex = line.front();
}

/// The first vertex not collinear with the ones before, or kNone. `second`: the first vertex that
/// differs from vertex `begin`.
template <class Kernel>
std::uint32_t find_first_off_line(Mesh<Kernel>& mesh, std::uint32_t begin, std::uint32_t end,
                                  std::uint32_t& second) {
  second = begin + 1;
  while (second < end && mesh.point[second] == mesh.point[begin]) ++second;
  for (std::uint32_t v = second + 1; v < end; ++v) {
    mesh.ticks(kTicksOfWalk);
    if (Kernel::orientation(mesh.point[begin], mesh.point[second], mesh.point[v]) != 0) return v;
  }
  return kNone;
}

/// Frees the slots of duplicates and sets vertex_of to the vertices that represent them.
template <class Kernel>
void resolve_aliases(Mesh<Kernel>& mesh, std::vector<VertexId>& vertex_of, std::uint32_t begin,
                     std::uint32_t end) {
  bool has_duplicates = false;
  for (std::uint32_t v = begin; v < end && !has_duplicates; ++v)
    has_duplicates = (mesh.incident[v] & kAlias) != 0;
  if (!has_duplicates) return;
  for (VertexId& v : vertex_of) {
    const std::uint32_t entry = mesh.incident[slot(v)];
    if ((entry & kAlias) != 0) v = VertexId{entry & ~kAlias};
  }
  for (std::uint32_t v = end; v-- > begin;) {
    if ((mesh.incident[v] & kAlias) == 0) continue;
    mesh.incident[v] = kFreeVertexBit;
    mesh.free_vertices.put(v);
    --mesh.vertex_count;
  }
}

}  // namespace

template <class Kernel>
std::vector<VertexId> build(Mesh<Kernel>& mesh, std::span<const typename Kernel::Point> points) {
  mesh.forget_slots();
  if (points.empty()) return {};
  const std::uint32_t begin = mesh.point.size();
  std::vector<VertexId> vertex_of = number_vertices(mesh, points, begin);
  const std::uint32_t end = mesh.point.size();
  std::uint32_t second = kNone;
  const std::uint32_t third = find_first_off_line(mesh, begin, end, second);
  if (third == kNone) {
    sort_on_line(mesh, begin, end);
  } else {
    mesh.triangle.reserve(2 * std::size_t{mesh.vertex_count} - 2);
    mesh.line = {begin, second};
    if (lexicographically_less(mesh.point[second], mesh.point[begin]))
      std::swap(mesh.line[0], mesh.line[1]);
    make_fan(mesh, third);
    mesh.last_vertex = begin;
    const auto insert_every = [&](std::uint32_t step, bool coarser_inserted) {
      for (std::uint32_t i = step; i < end - begin; i += step) {
        const std::uint32_t v = begin + i;
        if (v == second || v == third || (coarser_inserted && i % (step * kSample) == 0)) continue;
        insert_slot(mesh, v);
      }
    };
    std::uint32_t step = 1;
    while ((end - begin) / step > kSample * kSample) step *= kSample;
    bool coarser_inserted = false;
    for (; step > 0; step /= kSample) {
      insert_every(step, coarser_inserted);
      coarser_inserted = true;
    }
  }
  resolve_aliases(mesh, vertex_of, begin, end);
  if (mesh.journal.on())
    for (std::uint32_t v = begin; v < end; ++v)
      if (mesh.vertex_alive(v)) mesh.journal.touch_vertex(v, false, mesh.point[v]);
  return vertex_of;
}

#ifdef TERRACE_TRI_CORE
template std::vector<VertexId> build(Mesh<IntKernel>&, std::span<const IntKernel::Point>);
template std::vector<VertexId> build(Mesh<WindowedKernel>&, std::span<const WindowedKernel::Point>);
#else
template std::vector<VertexId> build(Mesh<DoubleKernel>&, std::span<const DoubleKernel::Point>);
template std::vector<VertexId> build(Mesh<EllipticalKernel>&,
                                     std::span<const EllipticalKernel::Point>);
#endif

}  // namespace terrace::tri::planar
