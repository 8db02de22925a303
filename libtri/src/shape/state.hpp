// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "../delaunay3/mesh.hpp"
#include "../pool.hpp"
#include "terrace/tri/shape.hpp"

/// The state of a shape, and the steps that the rules share.

namespace terrace::tri::shape {

// Values of State::of. A value below kKept means removed and is the facet through which the flood
// came.
inline constexpr std::uint8_t kKept = 4;
/// Not a finite tetrahedron. Ghosts have this value too, so the neighbour of an existing
/// tetrahedron is open (removed or beyond the hull) if and only if its state is not kKept.
inline constexpr std::uint8_t kAbsent = 5;
/// Removed by the flood and put back. Set only between operations.
inline constexpr std::uint8_t kRescuedBit = 8;

constexpr bool is_kept(std::uint8_t state) { return state == kKept || (state & kRescuedBit) != 0; }
constexpr bool is_removed(std::uint8_t state) { return state < kKept; }

struct State {
  std::vector<std::uint8_t> of;  ///< by tetrahedron slot
  /// By vertex slot: number of its tetrahedra in state kKept.
  std::vector<std::uint32_t> degree;
  std::vector<std::uint32_t> lost;     ///< existing vertices of degree 0 while there are tetrahedra
  std::vector<std::uint32_t> rescued;  ///< tetrahedra
  std::size_t kept_count = 0;          ///< number of tetrahedra in state kKept
  std::vector<std::uint8_t> forest;    ///< poles rule: labels of its first step, by slot
  base::StopTicks ticks;               ///< ticks of the rules that peel
  // Scratch memory, kept between calls.
  std::vector<std::uint32_t> queue;    ///< removed tetrahedra whose neighbours must be tested
  std::vector<std::uint32_t> pending;  ///< kept tetrahedra that must be tested on all sides
  std::vector<std::uint32_t> touched;  ///< vertices whose degree may have changed
  /// By vertex slot: 1 if tetrahedra removed there were outside, 2 if inside, 3 if both. 0 between
  /// calls.
  std::vector<std::uint8_t> removed_labels;
  /// Local numbers by slot, see nearby.hpp. kNone between calls.
  Pool<std::uint32_t> local_tetrahedron, local_vertex;

  template <class Mesh>
  void keep(const Mesh& mesh, std::uint32_t t) {
    of[t] = kKept;
    ++kept_count;
    for (const std::uint32_t v : mesh.tetrahedron[t].corner) ++degree[v];
  }
  template <class Mesh>
  void remove(const Mesh& mesh, std::uint32_t t, std::uint32_t side) {
    of[t] = static_cast<std::uint8_t>(side);
    --kept_count;
    for (const std::uint32_t v : mesh.tetrahedron[t].corner) --degree[v];
  }
  [[nodiscard]] std::size_t bytes() const {
    const std::size_t words = degree.capacity() + lost.capacity() + rescued.capacity() +
                              queue.capacity() + pending.capacity() + touched.capacity();
    return of.capacity() + forest.capacity() + removed_labels.capacity() +
           words * sizeof(std::uint32_t) + local_tetrahedron.bytes() + local_vertex.bytes();
  }
  void forget_rescued() {
    for (const std::uint32_t t : rescued) of[t] &= static_cast<std::uint8_t>(~kRescuedBit);
    rescued.clear();
  }
};

/// Sets all finite tetrahedra to kept.
template <class Mesh>
void keep_all(const Mesh& mesh, State& state) {
  state.of.assign(mesh.tetrahedron.size(), kAbsent);
  state.degree.assign(mesh.vertex.size(), 0);
  state.lost.clear();
  state.rescued.clear();
  state.kept_count = 0;
  for (std::uint32_t t = 0; t < mesh.tetrahedron.size(); ++t)
    if (spatial::is_finite(mesh.tetrahedron[t].corner)) state.keep(mesh, t);
}

template <class Mesh>
void find_lost(const Mesh& mesh, State& state) {
  state.lost.clear();
  if (mesh.flat) return;
  for (std::uint32_t v = 1; v < mesh.vertex.size(); ++v)
    if (state.degree[v] == 0 && mesh.vertex_alive(v)) state.lost.push_back(v);
}

}  // namespace terrace::tri::shape
