// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>

namespace {

using Ints = std::int64_t __attribute__((vector_size(64)));

/// A bit for each lane that is true.
[[gnu::always_inline]] inline unsigned bits_of(Ints mask) {
  unsigned bits = 0;
  for (int i = 0; i < 8; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
}

}  // namespace

#include "scan_masks.hpp"

namespace terrace::tri::tin::rows {

const RowScan kRowScanPortable = scan_of();

#ifdef TERRACE_TRI_X86

bool supported(RowPath path) {
  if (path == RowPath::kAvx2) return __builtin_cpu_supports("avx2") != 0;
  if (path == RowPath::kAvx512)
    return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0;
  return true;
}

const RowScan& row_scan(RowPath path) {
  return path == RowPath::kAvx512 ? kRowScanAvx512
         : path == RowPath::kAvx2 ? kRowScanAvx2
                                  : kRowScanPortable;
}

#else

bool supported(RowPath path) { return path == RowPath::kPortable; }

const RowScan& row_scan(RowPath) { return kRowScanPortable; }

#endif

RowPath best_row_path() {
  static const RowPath best = supported(RowPath::kAvx512) ? RowPath::kAvx512
                              : supported(RowPath::kAvx2) ? RowPath::kAvx2
                                                          : RowPath::kPortable;
  return best;
}

}  // namespace terrace::tri::tin::rows
