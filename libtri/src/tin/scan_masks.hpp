// SPDX-License-Identifier: Apache-2.0
#pragma once

// Masks of lanes for instruction sets in which a mask is a vector. bits_of() for Ints16 and Ints8
// must be defined before.
#include "scan_lanes.hpp"

namespace terrace::tri::tin {
namespace {

template <class Ints>
[[gnu::always_inline]] inline Ints not_negative(Ints lanes) {
  return (Ints)(lanes >= 0);
}
template <class Ints>
[[gnu::always_inline]] inline Ints at_most(Ints a, Ints b) {
  return (Ints)(a <= b);
}
template <class Ints>
[[gnu::always_inline]] inline Ints more(Ints a, Ints b) {
  return (Ints)(a > b);
}
[[gnu::always_inline]] inline Ints8 at_least(Reals8 a, Reals8 b) { return (Ints8)(a >= b); }
[[gnu::always_inline]] inline Ints8 above(Reals8 a, Reals8 b) { return (Ints8)(a > b); }
template <class Ints>
[[gnu::always_inline]] inline Ints mask_or(Ints a, Ints b) {
  return a | b;
}
template <class Ints>
[[gnu::always_inline]] inline Ints mask_and(Ints a, Ints b) {
  return a & b;
}
/// Lanes of a where the mask is set, and of b elsewhere.
template <class Ints, class Values>
[[gnu::always_inline]] inline Values blend(Ints mask, Values a, Values b) {
  return (Values)(((Ints)a & mask) | ((Ints)b & ~mask));
}
/// Keeps the lanes of the mask and sets the others to 0.
template <class Reals, class Ints>
[[gnu::always_inline]] inline Reals zero_unless(Reals lanes, Ints mask) {
  return (Reals)((Ints)lanes & mask);
}
/// A bit for each lane of the mask that is not at most the limit, including NaN.
template <class Reals, class Ints>
[[gnu::always_inline]] inline unsigned exceeding(Reals lanes, Reals limit, Ints mask) {
  return bits_of(~(Ints)(lanes <= limit) & mask);
}
template <class Ints>
[[gnu::always_inline]] inline unsigned equal(Ints a, Ints b) {
  return bits_of((Ints)(a == b));
}

}  // namespace
}  // namespace terrace::tri::tin

#include "scan_impl.hpp"
