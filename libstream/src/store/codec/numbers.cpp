// SPDX-License-Identifier: Apache-2.0
#include "store/codec/numbers.hpp"

#include <algorithm>

namespace terrace::stream::store {
namespace {

constexpr double kLargest = 9007199254740992.0;  // 2^53

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool holds(double value, NumberForm form) {
  const unsigned digits = form < kFloatDecimals ? form : form - kFloatDecimals;
  const double scaled = value * kPowersOfTen[digits];
  if (!(std::abs(scaled) < kLargest)) return false;
  return same_bits(to_double(to_integer(value, form), form), value);
}

bool all_integers(std::span<const double> values) {
  // One pass without branches, because nearly every raster and every column number takes this path.
  std::uint64_t difference = 0;
  for (const double value : values) {
    const double bounded = std::abs(value) < kLargest ? value : 0.5;
    const auto k = static_cast<std::int64_t>(bounded);
    difference |=
        std::bit_cast<std::uint64_t>(static_cast<double>(k)) ^ std::bit_cast<std::uint64_t>(value);
  }
  return difference == 0;
}

/// Returns the first form of base, base + 1, ... base + 9 that can represent all values, or
/// kDoubleBits. A value that n digits represent is represented by n + 1, so one pass is enough,
/// except for the largest values.
NumberForm decimals(std::span<const double> values, NumberForm base) {
  auto form = base;
  std::size_t settled = 0;  // values before this one were tried with fewer digits
  for (std::size_t i = 0; i < values.size(); ++i) {
    while (!holds(values[i], form)) {
      if (++form == base + 10) return kDoubleBits;
      settled = i;
    }
  }
  for (const double value : values.first(settled)) {
    if (!holds(value, form)) return kDoubleBits;
  }
  return form;
}

}  // namespace

NumberForm form_of(std::span<const double> values) {
  if (all_integers(values)) return kIntegerForm;
  // NaN is not ordered, so only the bits can represent it.
  if (std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) {
    return kDoubleBits;
  }
  const bool floats = std::all_of(values.begin(), values.end(), [](double v) {
    return std::abs(v) <= std::numeric_limits<float>::max() && same_bits(static_cast<float>(v), v);
  });
  const NumberForm bits = floats ? kFloatBits : kDoubleBits;
  NumberForm best = bits;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const auto range = [&, bottom = *low, top = *high](NumberForm form) {
    return static_cast<std::uint64_t>(to_integer(top, form)) -
           static_cast<std::uint64_t>(to_integer(bottom, form));
  };
  for (const NumberForm base : {kIntegerForm, kFloatDecimals}) {
    if (base == kFloatDecimals && !floats) continue;
    const NumberForm form = decimals(values, base);
    if (form != kDoubleBits && range(form) < range(best)) best = form;
  }
  return best;
}

}  // namespace terrace::stream::store
