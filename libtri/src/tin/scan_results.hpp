// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// What scans of the samples in a triangle find.

namespace terrace::tri::tin {

template <class T>
struct WorstSample {
  T error;
  std::uint32_t place;  ///< row << 16 | column
};

/// By how much a vertex may rise (below 0: sink).
struct Interval {
  double low = -__builtin_inf();
  double high = __builtin_inf();
};

}  // namespace terrace::tri::tin
