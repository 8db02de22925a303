// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "laz/bytes.hpp"

/// Adaptive models of symbols and bits.
/// Source: A. Said, Introduction to arithmetic coding, HPL-2004-76, and its FastAC code, with
/// LASzip's constants.

namespace terrace::stream::laz {

/// Models are in zeroed memory and are initialised when they are first used in a chunk, whose
/// number (from 1 on) they store. Most contexts never occur, so their models cost nothing.
using ChunkNumber = std::uint64_t;

struct Free {
  void operator()(void* memory) const { std::free(memory); }
};
template <class T>
using Zeroed = std::unique_ptr<T[], Free>;

/// `count` zeroed objects. Pages that are never touched take no memory.
template <class T>
Zeroed<T> make_zeroed(std::size_t count) {
  static_assert(std::is_trivially_default_constructible_v<T>);
  auto* memory = static_cast<T*>(std::calloc(std::max<std::size_t>(count, 1), sizeof(T)));
  if (memory == nullptr) throw std::bad_alloc();
  return Zeroed<T>(memory);
}

/// Intervals of symbols are in units of 2^-kSymbolBits.
inline constexpr unsigned kSymbolBits = 15;

/// A model of at most `Capacity` symbols; the caller passes the actual number, `symbols`, to each
/// call.
template <unsigned Capacity>
struct SymbolModel {
  /// A decoder looks up the first candidate by the upper bits of the value, and compares eight
  /// symbols at once from there on. Values can exceed 2^15 by 63, so there is one extra bucket.
  static constexpr unsigned kLanes = 8;
  static constexpr unsigned kBucketBits = Capacity <= kLanes ? 0 : std::bit_width(Capacity - 1) - 1;
  using Candidate = std::conditional_t<(Capacity > 256), std::uint16_t, std::uint8_t>;

  ChunkNumber initialised_in;
  std::uint32_t countdown;  ///< symbols until the next update
  std::uint32_t cycle;
  std::uint32_t total;
  std::uint32_t most_frequent;                           ///< a symbol with the highest count
  std::array<Candidate, (1u << kBucketBits) + 1> first;  ///< candidates
  std::array<std::uint16_t, Capacity + kLanes> start;    ///< start of each symbol's interval
  std::array<std::uint16_t, Capacity> count;

  TERRACE_LAZ_NOINLINE void begin(ChunkNumber chunk, unsigned symbols);

  /// Returns a model before its first symbol.
  static constexpr SymbolModel initial(unsigned symbols) {
    SymbolModel model{};
    model.cycle = symbols;
    std::fill_n(model.count.begin(), symbols, std::uint16_t{1});
    // Greater than all values.
    std::fill_n(model.start.begin() + symbols, kLanes, std::uint16_t{0xffff});
    model.update(symbols);
    model.cycle = model.countdown = (symbols + 6) >> 1;
    return model;
  }

  TERRACE_LAZ_NOINLINE constexpr void update(unsigned symbols) {
    total += cycle;
    if (total > 1u << kSymbolBits) {
      total = 0;
      for (unsigned i = 0; i < symbols; ++i) {
        count[i] = static_cast<std::uint16_t>((count[i] + 1u) >> 1);
        total += count[i];
      }
    }
    const std::uint32_t scale = 0x80000000u / total;
    std::uint32_t sum = 0, highest = 0;
    for (unsigned i = 0; i < symbols; ++i) {
      most_frequent = count[i] > highest ? i : most_frequent;
      highest = std::max(highest, std::uint32_t{count[i]});
      start[i] = static_cast<std::uint16_t>((scale * sum) >> 16);
      sum += count[i];
    }
    if constexpr (kBucketBits > 0) {
      constexpr unsigned kShift = kSymbolBits - kBucketBits;
      unsigned bucket = 0;
      for (unsigned i = 1; i < symbols; ++i) {
        for (; bucket << kShift < start[i]; ++bucket) first[bucket] = static_cast<Candidate>(i - 1);
      }
      std::fill(first.begin() + bucket, first.end(), static_cast<Candidate>(symbols - 1));
    }
    cycle = std::min((5 * cycle) >> 2, (symbols + 6) << 3);
    countdown = cycle;
  }

  /// Returns the last symbol whose interval begins at or before `value`.
  [[nodiscard]] TERRACE_LAZ_INLINE unsigned find(std::uint32_t value) const {
    unsigned symbol = kBucketBits == 0 ? 0 : first[value >> (kSymbolBits - kBucketBits)];
    for (;; symbol += kLanes) {
      const unsigned lanes = count_lanes(start.data() + symbol, value);
      if (lanes < kLanes) [[likely]]
        return symbol + lanes - 1;
    }
  }

 private:
  /// Returns how many of eight ascending numbers are at most `value`.
  [[nodiscard]] TERRACE_LAZ_INLINE static unsigned count_lanes(const std::uint16_t* at,
                                                               std::uint32_t value) {
#if defined(__SSE2__)
    const __m128i begins = _mm_loadu_si128(reinterpret_cast<const __m128i*>(at));
    const __m128i above = _mm_subs_epu16(begins, _mm_set1_epi16(static_cast<short>(value)));
    const int mask = _mm_movemask_epi8(_mm_cmpeq_epi16(above, _mm_setzero_si128()));
    // The bit after the lanes is always clear.
    return static_cast<unsigned>(std::countr_zero(~static_cast<std::uint32_t>(mask) | 0x10000)) / 2;
#else
    unsigned lanes = 0;
    for (unsigned lane = 0; lane < kLanes; ++lane) lanes += at[lane] <= value ? 1 : 0;
    return lanes;
#endif
  }
};

/// Initialised models to copy, of all symbols or of 2, 4, ..., 256.
template <unsigned Capacity>
inline constexpr std::array<SymbolModel<Capacity>, 1> kInitial{
    SymbolModel<Capacity>::initial(Capacity)};
template <>
inline constexpr std::array<SymbolModel<256>, 8> kInitial<256>{
    SymbolModel<256>::initial(2),   SymbolModel<256>::initial(4),  SymbolModel<256>::initial(8),
    SymbolModel<256>::initial(16),  SymbolModel<256>::initial(32), SymbolModel<256>::initial(64),
    SymbolModel<256>::initial(128), SymbolModel<256>::initial(256)};

template <unsigned Capacity>
void SymbolModel<Capacity>::begin(ChunkNumber chunk, unsigned symbols) {
  *this = kInitial<Capacity>[Capacity == 256 ? std::bit_width(symbols) - 2 : 0];
  initialised_in = chunk;
}

inline constexpr unsigned kBitBits = 13;

/// A model of bits.
struct BitModel {
  ChunkNumber initialised_in;
  std::uint32_t countdown, cycle;
  std::uint32_t zeros, total;
  std::uint32_t zero;  ///< share of the interval for 0, in units of 2^-kBitBits

  void begin(ChunkNumber chunk) {
    initialised_in = chunk;
    zeros = 1;
    total = 2;
    zero = 1u << (kBitBits - 1);
    cycle = countdown = 4;
  }

  void update() {
    total += cycle;
    if (total > 1u << kBitBits) {
      total = (total + 1) >> 1;
      zeros = (zeros + 1) >> 1;
      if (zeros == total) ++total;
    }
    zero = (zeros * (0x80000000u / total)) >> 18;
    cycle = std::min((5 * cycle) >> 2, 64u);
    countdown = cycle;
  }
};

}  // namespace terrace::stream::laz
