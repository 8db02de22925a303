// SPDX-License-Identifier: Apache-2.0
// The scans of grids of doubles with narrow vectors, for WebAssembly, where a vector of 64 bytes
// would become many instructions that a page has to load. Takes the place of scan.cpp and gives the
// same bits.
#define TERRACE_TRI_NARROW_LANES
#include "scan.hpp"
#include "scan_lanes.hpp"

namespace terrace::tri::tin {
namespace {

/// A bit for each true lane.
template <class Ints>
[[gnu::always_inline]] inline unsigned bits_of(Ints mask) {
  unsigned bits = 0;
  for (int i = 0; i < 4; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
}

}  // namespace
}  // namespace terrace::tri::tin

#include "scan_masks.hpp"

namespace terrace::tri::tin {

namespace {

constinit const GridScan<double> kGridDoublesNarrow = grid_scan<double>();

}  // namespace

template <>
const GridScan<double>& grid_scans(base::SimdPath) {
  return kGridDoublesNarrow;
}

}  // namespace terrace::tri::tin
