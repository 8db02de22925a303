// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "terrace/stream/schema.hpp"

/// Represents doubles exactly by integers in the same order. A *number form* defines how:
///    0 .. 9 k / 10^n, n = form: decimals, and with n = 0 plain integers
///   10 .. 19 the same rounded to float32, n = form - 10
///   20 the bits of the float32, as an ordered integer
///   21 the bits of the float64, as an ordered integer
/// Forms 0 to 19 never represent -0.0, infinities or NaN.

namespace terrace::stream::store {

using NumberForm = std::uint8_t;
inline constexpr NumberForm kIntegerForm = 0;
inline constexpr NumberForm kFloatDecimals = 10;
inline constexpr NumberForm kFloatBits = 20;
inline constexpr NumberForm kDoubleBits = 21;
inline constexpr unsigned kNumberForms = 22;

inline constexpr std::array<double, 10> kPowersOfTen{1e0, 1e1, 1e2, 1e3, 1e4,
                                                     1e5, 1e6, 1e7, 1e8, 1e9};

constexpr std::int64_t ordered_bits(double value) {
  const auto bits = std::bit_cast<std::int64_t>(value);
  return bits < 0 ? bits ^ INT64_MAX : bits;
}
constexpr double from_ordered_bits(std::int64_t bits) {
  return std::bit_cast<double>(bits < 0 ? bits ^ INT64_MAX : bits);
}
constexpr std::int32_t ordered_bits(float value) {
  const auto bits = std::bit_cast<std::int32_t>(value);
  return bits < 0 ? bits ^ INT32_MAX : bits;
}
constexpr float from_ordered_bits(std::int32_t bits) {
  return std::bit_cast<float>(bits < 0 ? bits ^ INT32_MAX : bits);
}

/// Returns the number represented by `k`.
inline double to_double(std::int64_t k, NumberForm form) {
  if (form == kIntegerForm) return static_cast<double>(k);
  if (form < kFloatDecimals) return static_cast<double>(k) / kPowersOfTen[form];
  if (form < kFloatBits) {
    return static_cast<float>(static_cast<double>(k) / kPowersOfTen[form - kFloatDecimals]);
  }
  if (form == kFloatBits) return from_ordered_bits(static_cast<std::int32_t>(k));
  return from_ordered_bits(k);
}

/// Returns the integer that represents `value`. Requires that the form can represent it (see
/// form_of()).
inline std::int64_t to_integer(double value, NumberForm form) {
  if (form == kIntegerForm) return static_cast<std::int64_t>(value);
  if (form < kFloatBits) {
    const unsigned digits = form < kFloatDecimals ? form : form - kFloatDecimals;
    // Rounds to the nearest integer without a function call; std::nearbyint() is a call without SSE
    // 4.1.
    const double scaled = value * kPowersOfTen[digits];
    return static_cast<std::int64_t>(scaled + (scaled < 0 ? -0.5 : 0.5));
  }
  if (form == kFloatBits) return ordered_bits(static_cast<float>(value));
  return ordered_bits(value);
}

/// Returns the form that can represent all of `values`; if several can, the one in which they span
/// the smallest range of integers. Time O(values).
NumberForm form_of(std::span<const double> values);

}  // namespace terrace::stream::store
