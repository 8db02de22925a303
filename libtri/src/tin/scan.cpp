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

constinit const Scans kScansPortable = all_scans();

#ifdef TERRACE_TRI_X86
const Scans& scans(base::SimdPath set) {
  return set == base::SimdPath::avx512 ? kScansAvx512
         : set == base::SimdPath::avx2 ? kScansAvx2
                                       : kScansPortable;
}
#else
const Scans& scans(base::SimdPath) { return kScansPortable; }
#endif

}  // namespace terrace::tri::tin
