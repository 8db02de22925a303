// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

/// The inner loop of filling a hole: what a facet makes of every vertex, in double.

namespace terrace::tri::spatial {

/// A facet, with a normal that points into the hole. For a vertex, relative to the facet's first
/// corner: volume = its scalar product with the normal; power = its power with respect to the
/// smallest sphere through the facet's corners. The sphere through the corners and the vertex has
/// its centre at power / (2 volume) normals from that one's.
struct ScanFacet {
  double corner[3];
  double normal[3];
  double diameter[3];  ///< twice the vector from the corner to the smallest sphere's centre
  double power_error;  ///< bounds of the absolute errors of the two, for every vertex
  double volume_error;
};

inline constexpr std::size_t kScanPadding = 8;  ///< arrays are as long as a multiple of it

/// Writes power and volume of `count` vertices (rounded up to kScanPadding; NaN is no vertex).
/// Returns an upper bound of the least power / volume among vertices with certainly positive
/// volume, or infinity.
using ScanFunction = double (*)(const double* x, const double* y, const double* z,
                                std::size_t count, const ScanFacet& facet, double* power,
                                double* volume);
ScanFunction scan_function();

}  // namespace terrace::tri::spatial
