// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "store/codec/rans.hpp"
#include "store/codec/symbols.hpp"

/// Functions that code in either direction: they read `value` when encoding and set it when
/// decoding.

namespace terrace::stream::store {

template <class Coder>
TERRACE_STORE_INLINE void code_symbol(Coder& coder, unsigned context, unsigned& symbol) {
  if constexpr (Coder::kDecoding) {
    symbol = coder.symbol(context);
  } else {
    coder.symbol(context, symbol);
  }
}

/// Returns the class of the number.
template <class Coder>
TERRACE_STORE_INLINE unsigned code_number(Coder& coder, unsigned context, std::uint64_t& value) {
  if constexpr (Coder::kDecoding) {
    const unsigned c = coder.symbol(context);
    value = kClassRange[c].base + coder.raw(kClassRange[c].bits);
    return c;
  } else {
    const unsigned c = class_of(value);
    coder.symbol(context, c);
    coder.raw(value - kClassRange[c].base, kClassRange[c].bits);
    return c;
  }
}

/// Maps a position among n to the zigzag of its distance from the middle, which representatives are
/// mostly near to.
constexpr std::uint32_t centred(std::uint32_t position, std::uint32_t n) {
  return static_cast<std::uint32_t>(zigzag(std::int64_t{position} - n / 2));
}
/// Requires code < n.
constexpr std::uint32_t uncentred(std::uint32_t code, std::uint32_t n) {
  return static_cast<std::uint32_t>(unzigzag(code) + n / 2);
}

/// Returns the truncated binary code of a number below `size` (>= 1): all values cost the same, to
/// within one bit.
TERRACE_STORE_INLINE RawBits uniform_bits(std::uint64_t value, std::uint64_t size) {
  const unsigned bits = static_cast<unsigned>(std::bit_width(size | 1)) - 1;  // size is not 0
  const std::uint64_t power = std::uint64_t{1} << bits;
  const std::uint64_t shorter = power - (size - power);  // this many values take `bits` bits
  // A branch here would be unpredictable.
  const std::uint64_t longer = value >= shorter ? 1 : 0;
  return {value + (shorter & (0 - longer)), bits + static_cast<unsigned>(longer)};
}

template <class Coder>
TERRACE_STORE_INLINE void code_uniform(Coder& coder, std::uint64_t& value, std::uint64_t size) {
  if constexpr (Coder::kDecoding) {
    const unsigned bits = static_cast<unsigned>(std::bit_width(size)) - 1;
    const std::uint64_t power = std::uint64_t{1} << bits;
    const std::uint64_t shorter = power - (size - power);
    value = coder.raw(bits);
    if (value >= shorter) value = (value << 1 | coder.raw(1)) - shorter;
  } else {
    const RawBits coded = uniform_bits(value, size);
    coder.raw(coded.value, coded.bits);
  }
}

}  // namespace terrace::stream::store
