// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tetrahedron.hpp"

namespace terrace::tri::spatial {

/// Scratch memory of insertion, see insert.cpp.
struct Cavity {
  struct Facet {
    std::array<std::uint32_t, 3> corner;  ///< with the new vertex before them in order
    Side outer;                           ///< the same facet, seen from outside
    std::array<std::uint32_t, 3> local;   ///< numbers of the corners among the boundary's vertices
    std::uint32_t slot;                   ///< of the tetrahedron on it
  };
  /// With up to so many facets the boundary has 63 vertices, which are numbered from 1 with six
  /// bits.
  static constexpr std::size_t kSmall = 2 * 63 - 4;
  static constexpr std::uint32_t kStride = 64;

  std::vector<std::uint32_t> inside;  ///< slots of the tetrahedra in conflict, as a queue
  std::vector<Facet> facets;
  /// By directed edge of local numbers: which side has it. Never cleared.
  std::vector<Side> by_edge = std::vector<Side>(std::size_t{kStride} * kStride);
  /// The same for large cavities: both vertices of an edge, the smaller first, and a side.
  struct Edge {
    std::uint64_t vertices;
    Side side;
  };
  std::vector<Edge> edges;

  [[nodiscard]] std::size_t bytes() const {
    return inside.capacity() * sizeof(std::uint32_t) + facets.capacity() * sizeof(Facet) +
           by_edge.capacity() * sizeof(Side) + edges.capacity() * sizeof(Edge);
  }
};

}  // namespace terrace::tri::spatial
