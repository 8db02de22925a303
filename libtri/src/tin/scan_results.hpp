// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// The results of scanning the samples in a triangle.

namespace terrace::tri::tin {

template <class T>
struct WorstSample {
  T error;
  std::uint32_t place;  ///< row << 16 | column
};

/// The range by which a vertex may rise (negative: sink).
struct Interval {
  double low = -__builtin_inf();
  double high = __builtin_inf();
};

}  // namespace terrace::tri::tin
