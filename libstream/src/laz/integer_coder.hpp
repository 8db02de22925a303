// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "laz/coder.hpp"

namespace terrace::stream::laz {

/// Models of integers of 8, 16 or 32 bits that are coded as corrections of a prediction, modulo
/// 2^Bits. A correction's magnitude k has an adaptive model per context of the caller. Its position
/// within (2^(k-1), 2^k] or the mirror image [-2^k + 1, -2^(k-1)] has an adaptive model of its
/// upper 8 bits.
template <unsigned Bits, unsigned Contexts>
struct IntegerModels {
  std::uint32_t magnitude;  ///< k of the last coded number
  BitModel zero_or_one;     ///< the correction if k is 0
  std::array<SymbolModel<Bits + 1>, Contexts> magnitudes;
  /// Models of corrections of k bits, at index k - 1, with 2^min(k, 8) symbols. A k of 32 needs
  /// none: the correction is 2^31.
  std::array<SymbolModel<256>, (Bits < 32 ? Bits : 31)> corrections;

  /// Codes `value`, which decoding ignores, and returns it; for 8 and 16 bits as an unsigned
  /// number.
  template <class Coder>
  TERRACE_LAZ_INLINE std::int32_t code(Coder& coder, std::int32_t predicted, std::int32_t value,
                                       unsigned context) {
    return code(coder, predicted, value, magnitudes[context]);
  }

  template <class Coder>
  TERRACE_LAZ_INLINE std::int32_t code(Coder& coder, std::int32_t predicted, std::int32_t value,
                                       SymbolModel<Bits + 1>& magnitudes_of_context) {
    std::uint32_t correction = 0;  // in two's complement
    unsigned k = 0;
    if constexpr (!Coder::kDecoding) {
      correction = static_cast<std::uint32_t>(value) - static_cast<std::uint32_t>(predicted);
      if constexpr (Bits < 32) {
        // Reduced to [-2^(Bits-1), 2^(Bits-1)).
        correction = (correction + kHalf) % kRange - kHalf;
      }
      const bool positive = static_cast<std::int32_t>(correction) > 0;
      k = static_cast<unsigned>(std::bit_width(positive ? correction - 1 : 0u - correction));
    }
    k = coder.symbol(magnitudes_of_context, k);
    magnitude = k;
    if (k == 0) {
      correction = coder.bit(zero_or_one, correction);
    } else if (k == 32) {
      correction = 0x80000000;
    } else {
      const std::uint32_t half = 1u << (k - 1), offset = 2 * half - 1;
      std::uint32_t index =
          static_cast<std::int32_t>(correction) > 0 ? correction - 1 : correction + offset;
      SymbolModel<256>& upper = corrections[k - 1];
      if (k <= 8) {
        index = coder.symbol(upper, index, 2 * half);
      } else {
        const unsigned rest = k - 8;
        const std::uint32_t high = coder.symbol(upper, index >> rest) << rest;
        index = high | coder.raw(rest, index & ((1u << rest) - 1));
      }
      correction = index >= half ? index + 1 : index - offset;
    }
    std::uint32_t sum = static_cast<std::uint32_t>(predicted) + correction;
    if constexpr (Bits < 32) sum %= kRange;
    return static_cast<std::int32_t>(sum);
  }

 private:
  static constexpr std::uint32_t kRange = Bits < 32 ? 1u << (Bits % 32) : 0;
  static constexpr std::uint32_t kHalf = kRange / 2;
};

}  // namespace terrace::stream::laz
