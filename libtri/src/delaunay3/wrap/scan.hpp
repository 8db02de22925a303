// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <terrace/base/simd.hpp>

/// The inner loop of filling a hole: computes values of every vertex for a facet, in double.

namespace terrace::tri::spatial {

/// A facet, with a normal that points into the hole. A vertex has two values relative to the
/// facet's first corner: its volume is its scalar product with the normal, and its power is taken
/// with respect to the smallest sphere through the facet's corners. The centre of the sphere
/// through the corners and the vertex is offset from that sphere's centre by power / (2 volume)
/// normals.
struct ScanFacet {
  double corner[3];
  double normal[3];
  double diameter[3];  ///< twice the vector from the corner to the smallest sphere's centre
  double power_error;  ///< bounds of the absolute errors of both, for every vertex
  double volume_error;
};

/// Coordinates of the vertices, in arrays padded to a multiple of kScanPadding, and memory for a
/// power and a volume of each. An entry with NaN is not a vertex.
struct ScanVertices {
  const double* x;
  const double* y;
  const double* z;
  std::size_t count;  ///< including padding
  double* power;
  double* volume;
};
inline constexpr std::size_t kScanPadding = 8;

/// Lists the vertices that may have positive volume and, among these, the least power / volume.
/// Fills in power and volume of all vertices. Returns the length of the list. `near` has room for
/// all vertices.
using ScanFunction = std::size_t (*)(const ScanVertices& vertices, const ScanFacet& facet,
                                     std::uint32_t* near);

/// Requires a supported instruction set. The lists of different sets may differ where values are at
/// the error bounds.
ScanFunction scan_function(base::SimdPath set);

std::size_t scan_portable(const ScanVertices& vertices, const ScanFacet& facet,
                          std::uint32_t* near);
std::size_t scan_avx2(const ScanVertices& vertices, const ScanFacet& facet, std::uint32_t* near);
std::size_t scan_avx512(const ScanVertices& vertices, const ScanFacet& facet, std::uint32_t* near);

}  // namespace terrace::tri::spatial
