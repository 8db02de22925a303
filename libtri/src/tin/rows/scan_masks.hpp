// SPDX-License-Identifier: Apache-2.0
#pragma once

// Masks of lanes where a mask is a vector, for point_rows_scan_impl.hpp; with type Ints and
// function bits_of() for it defined before. The rules there hold here.
namespace {

using Reals = double __attribute__((vector_size(64)));

[[gnu::always_inline]] inline Ints at_least(Reals a, Reals b) { return (Ints)(a >= b); }
[[gnu::always_inline]] inline Ints above(Reals a, Reals b) { return (Ints)(a > b); }
[[gnu::always_inline]] inline Ints both(Ints a, Ints b) { return a & b; }
/// a where the mask is set, else b.
[[gnu::always_inline]] inline Reals either_of(Ints mask, Reals a, Reals b) {
  return (Reals)(((Ints)a & mask) | ((Ints)b & ~mask));
}

}  // namespace

#include "scan_impl.hpp"
