// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/unpack.hpp"

#include <bit>
#include <cstring>

#include <tiff.h>

#include "with_type.hpp"

namespace terrace::stream {
namespace {

/// Converts small floats to single precision, which has every value; subnormals become normal.
template <unsigned kExponentBits, unsigned kMantissaBits>
float widen(std::uint32_t bits) {
  constexpr std::uint32_t kMantissaMask = (1u << kMantissaBits) - 1;
  constexpr std::uint32_t kExponentMask = (1u << kExponentBits) - 1;
  constexpr std::uint32_t kBias = kExponentMask >> 1;
  const std::uint32_t sign = (bits >> (kExponentBits + kMantissaBits)) << 31;
  std::uint32_t exponent = (bits >> kMantissaBits) & kExponentMask;
  std::uint32_t mantissa = bits & kMantissaMask;
  if (exponent == kExponentMask) {  // infinity, NaN
    return std::bit_cast<float>(sign | 0x7f800000u | (mantissa << (23 - kMantissaBits)));
  }
  if (exponent == 0) {
    if (mantissa == 0) return std::bit_cast<float>(sign);
    exponent = 1;
    while ((mantissa >> kMantissaBits) == 0) {
      mantissa <<= 1;
      --exponent;  // may wrap around below zero; the sum below is right modulo 2^32
    }
    mantissa &= kMantissaMask;
  }
  return std::bit_cast<float>(sign | ((exponent + 127 - kBias) << 23) |
                              (mantissa << (23 - kMantissaBits)));
}

std::uint32_t native_24(const std::byte* from) {
  const auto byte = [&](int i) { return std::to_integer<std::uint32_t>(from[i]); };
  if constexpr (std::endian::native == std::endian::little) {
    return byte(0) | byte(1) << 8 | byte(2) << 16;
  } else {
    return byte(2) | byte(1) << 8 | byte(0) << 16;
  }
}

/// `bits` bits beginning at bit `position`, counted from the highest bit of the first byte.
std::uint32_t bits_at(const std::byte* from, std::uint64_t position, unsigned bits) {
  std::uint64_t value = 0;
  const std::uint64_t first = position / 8, last = (position + bits - 1) / 8;
  for (std::uint64_t i = first; i <= last; ++i) {
    value = value << 8 | std::to_integer<std::uint64_t>(from[i]);
  }
  const std::uint64_t below = 8 * (last + 1) - (position + bits);
  return static_cast<std::uint32_t>((value >> below) & ((std::uint64_t{1} << bits) - 1));
}

}  // namespace

float float_from_16(std::uint16_t bits) { return widen<5, 10>(bits); }
float float_from_24(std::uint32_t bits) { return widen<7, 16>(bits); }

bool is_native(const PackedSamples& packed) { return packed.bits == 8 * size_of(packed.type); }

void unpack_samples(const PackedSamples& packed, const std::byte* from, std::size_t first,
                    std::size_t step, std::size_t count, std::byte* out) {
  const bool is_float = packed.sample_format == SAMPLEFORMAT_IEEEFP;
  with_type(packed.type, [&](auto sample) {
    using T = decltype(sample);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t number = first + i * step;
      T value{};
      if (is_float && packed.bits == 16) {
        std::uint16_t half = 0;
        std::memcpy(&half, from + 2 * number, sizeof half);
        value = static_cast<T>(float_from_16(half));
      } else if (is_float) {
        value = static_cast<T>(float_from_24(native_24(from + 3 * number)));
      } else {
        const std::uint32_t raw = bits_at(from, std::uint64_t{number} * packed.bits, packed.bits);
        if (packed.sample_format == SAMPLEFORMAT_INT) {  // the highest bit is the sign
          const unsigned unused = 32 - packed.bits;
          value = static_cast<T>(static_cast<std::int32_t>(raw << unused) >> unused);
        } else {
          value = static_cast<T>(raw);
        }
      }
      std::memcpy(out + i * sizeof(T), &value, sizeof(T));
    }
  });
}

}  // namespace terrace::stream
