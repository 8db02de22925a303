// SPDX-License-Identifier: Apache-2.0
#pragma once

// Masks of lanes where a mask is a vector, for grid_scan_impl.hpp; with functions bits_of() for
// masks of 16 ints and of 8 longs defined before. The rules there hold here.
#include <cstddef>
#include <cstdint>

namespace {

using Reals16 = float __attribute__((vector_size(64)));
using Reals8 = double __attribute__((vector_size(64)));

[[gnu::always_inline]] inline Ints16 not_negative(Ints16 lanes) { return (Ints16)(lanes >= 0); }
[[gnu::always_inline]] inline Ints8 not_negative(Ints8 lanes) { return (Ints8)(lanes >= 0); }
[[gnu::always_inline]] inline Ints16 at_most(Ints16 a, Ints16 b) { return (Ints16)(a <= b); }
[[gnu::always_inline]] inline Ints8 at_most(Ints8 a, Ints8 b) { return (Ints8)(a <= b); }
[[gnu::always_inline]] inline Ints16 more(Ints16 a, Ints16 b) { return (Ints16)(a > b); }
[[gnu::always_inline]] inline Ints8 more(Ints8 a, Ints8 b) { return (Ints8)(a > b); }
[[gnu::always_inline]] inline Ints16 either(Ints16 a, Ints16 b) { return a | b; }
[[gnu::always_inline]] inline Ints8 either(Ints8 a, Ints8 b) { return a | b; }
/// Lanes of a where the mask is set, else of b.
[[gnu::always_inline]] inline Ints16 chosen(Ints16 mask, Ints16 a, Ints16 b) {
  return (a & mask) | (b & ~mask);
}
[[gnu::always_inline]] inline Ints8 chosen(Ints8 mask, Ints8 a, Ints8 b) {
  return (a & mask) | (b & ~mask);
}
[[gnu::always_inline]] inline Ints16 both(Ints16 a, Ints16 b) { return a & b; }
[[gnu::always_inline]] inline Ints8 both(Ints8 a, Ints8 b) { return a & b; }
/// The others become 0.
[[gnu::always_inline]] inline Reals16 kept(Reals16 lanes, Ints16 mask) {
  return (Reals16)((Ints16)lanes & mask);
}
[[gnu::always_inline]] inline Reals8 kept(Reals8 lanes, Ints8 mask) {
  return (Reals8)((Ints8)lanes & mask);
}
/// A bit for each lane of the mask that is not at most the limit; NaN is not.
[[gnu::always_inline]] inline unsigned beyond(Reals16 lanes, Reals16 limit, Ints16 mask) {
  return bits_of(~(Ints16)(lanes <= limit) & mask);
}
[[gnu::always_inline]] inline unsigned beyond(Reals8 lanes, Reals8 limit, Ints8 mask) {
  return bits_of(~(Ints8)(lanes <= limit) & mask);
}
[[gnu::always_inline]] inline unsigned equal(Ints16 a, Ints16 b) {
  return bits_of((Ints16)(a == b));
}
[[gnu::always_inline]] inline unsigned equal(Ints8 a, Ints8 b) { return bits_of((Ints8)(a == b)); }

}  // namespace

#include "scan_impl.hpp"
