// SPDX-License-Identifier: Apache-2.0
#include "scan.hpp"

#include <terrace/base/simd.hpp>

#include "scan_lanes.hpp"

namespace terrace::tri::tin {
namespace {

/// A bit for each true lane.
[[gnu::always_inline]] inline unsigned bits_of(Ints16 mask) {
  unsigned bits = 0;
  for (int i = 0; i < 16; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
}
[[gnu::always_inline]] inline unsigned bits_of(Ints8 mask) {
  unsigned bits = 0;
  for (int i = 0; i < 8; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
}

}  // namespace
}  // namespace terrace::tri::tin

#include "scan_masks.hpp"

namespace terrace::tri::tin {

constinit const GridScan<float> kGridFloatsPortable = grid_scan<float>();
constinit const GridScan<double> kGridDoublesPortable = grid_scan<double>();
constinit const RowScans kRowScansPortable = {row_scan<false>(), row_scan<true>()};
constinit const CheckScans kCheckScansPortable = {check_in<float>, check_in<double>};

#ifdef TERRACE_TRI_X86
namespace {

template <class Table>
const Table& choose(base::SimdPath set, const Table& portable, const Table& avx2,
                    const Table& avx512) {
  return set == base::SimdPath::avx512 ? avx512 : set == base::SimdPath::avx2 ? avx2 : portable;
}

}  // namespace

template <>
const GridScan<float>& grid_scans(base::SimdPath set) {
  return choose(set, kGridFloatsPortable, kGridFloatsAvx2, kGridFloatsAvx512);
}
template <>
const GridScan<double>& grid_scans(base::SimdPath set) {
  return choose(set, kGridDoublesPortable, kGridDoublesAvx2, kGridDoublesAvx512);
}
const RowScans& row_scans(base::SimdPath set) {
  return choose(set, kRowScansPortable, kRowScansAvx2, kRowScansAvx512);
}
const CheckScans& check_scans(base::SimdPath set) {
  return choose(set, kCheckScansPortable, kCheckScansAvx2, kCheckScansAvx512);
}
#else
template <>
const GridScan<float>& grid_scans(base::SimdPath) {
  return kGridFloatsPortable;
}
template <>
const GridScan<double>& grid_scans(base::SimdPath) {
  return kGridDoublesPortable;
}
const RowScans& row_scans(base::SimdPath) { return kRowScansPortable; }
const CheckScans& check_scans(base::SimdPath) { return kCheckScansPortable; }
#endif

}  // namespace terrace::tri::tin
