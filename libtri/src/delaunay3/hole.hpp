// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "delaunay3/wrap/scan.hpp"
#include "facet_table.hpp"
#include "tetrahedron.hpp"

namespace terrace::tri::spatial {

/// What the removal of vertices leaves: open facets round it, and the vertices on and in it, which
/// have local numbers; scratch memory of removal. Local number 0 is the ghost's.
template <class Point>
struct Hole {
  struct Facet {
    /// Local numbers; a corner inside the hole and these are in order.
    std::array<std::uint32_t, 3> corner;
    Side outer;  ///< the side beyond; kMatched once both tetrahedra are there
  };
  static constexpr Side kMatched = 0xFFFFFFFFu;

  std::vector<std::uint32_t> vertex;    ///< by local number
  std::vector<Point> point;             ///< of vertex, in parallel
  std::vector<std::uint32_t> incident;  ///< a new tetrahedron at each vertex
  std::vector<Facet> facets;
  std::vector<std::uint32_t> slots;  ///< of the tetrahedra taken out

  /// Fill the hole of one vertex by ear_queue.cpp, a second method to compare with.
  bool by_ears = false;

  // For hole_filling.hpp: open facets, as a stack, some of them closed again; facets by corners.
  std::vector<std::uint32_t> pending;
  std::vector<FacetEntry> table;

  // For wrap.cpp: coordinates of the vertices by local number, padded; what a facet makes of each;
  // numbers of those that may be the next corner.
  std::vector<double> x, y, z;
  std::vector<double> power, volume;
  std::vector<std::uint32_t> near;
  ScanFunction scan = best_scan_function();

  [[nodiscard]] std::size_t bytes() const {
    return (vertex.capacity() + incident.capacity() + slots.capacity() + near.capacity() +
            pending.capacity()) *
               sizeof(std::uint32_t) +
           point.capacity() * sizeof(Point) + facets.capacity() * sizeof(Facet) +
           (x.capacity() + y.capacity() + z.capacity() + power.capacity() + volume.capacity()) *
               sizeof(double) +
           table.capacity() * sizeof(FacetEntry);
  }
};

}  // namespace terrace::tri::spatial
