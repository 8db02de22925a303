// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "laz/items.hpp"
#include "laz/layout.hpp"
#include "laz/pointwise.hpp"

/// Version 1 of the items of pointwise chunks, which LASzip wrote before 2011.

namespace terrace::stream::laz {

/// The median of the last three steps.
struct Median3 {
  std::array<std::int32_t, 3> steps;
  unsigned next;

  void begin() {
    steps = {};
    next = 0;
  }
  [[nodiscard]] std::int32_t value() const {
    const auto [low, high] = std::minmax(steps[0], steps[1]);
    return std::clamp(steps[2], low, high);
  }
  void add(std::int32_t step) {
    steps[next] = step;
    next = next == 2 ? 0 : next + 1;
  }
};

/// The point of version 1, whose coordinates are predicted by the last three steps.
struct Point10V1 : Point10 {
  IntegerModels<8, 2> scan_angle;
  IntegerModels<16, 1> intensity;
  IntegerModels<32, 1> x;
  IntegerModels<32, 20> y, z;
  Median3 x_steps, y_steps;

  void begin() {
    x_steps.begin();
    y_steps.begin();
  }

  template <class Coder>
  void code(Coder& coder, const std::uint8_t* last, typename Coder::Record record) {
    enum : unsigned {
      kSourceBit = 1,
      kUserDataBit = 2,
      kScanAngleBit = 4,
      kClassificationBit = 8,
      kReturnsBit = 16,
      kIntensityBit = 32
    };
    constexpr unsigned kLast = 19;  // last context of y and z
    coder.reserve();
    code_step(coder, x, x_steps, 0, last + kX, record + kX);
    code_step(coder, y, y_steps, std::min(x.magnitude, kLast), last + kY, record + kY);
    const unsigned k = (x.magnitude + y.magnitude) / 2;
    put<Coder>(record + kZ,
               z.code(coder, load<std::int32_t>(last + kZ),
                      input_value<Coder, std::int32_t>(record + kZ), std::min(k, kLast)));
    unsigned mask = 0;
    if constexpr (!Coder::kDecoding) {
      const auto differs = [&](std::size_t at, unsigned bit) {
        return record[at] != last[at] ? bit : 0;
      };
      mask = differs(kIntensity, kIntensityBit) | differs(kIntensity + 1, kIntensityBit) |
             differs(kReturns, kReturnsBit) | differs(kClassification, kClassificationBit) |
             differs(kScanAngle, kScanAngleBit) | differs(kUserData, kUserDataBit) |
             differs(kSource, kSourceBit) | differs(kSource + 1, kSourceBit);
    }
    mask = coder.symbol(changed, mask);
    code_short(coder, (mask & kIntensityBit) != 0, intensity, kIntensity, last, record);
    code_byte(coder, (mask & kReturnsBit) != 0, returns, kReturns, last, record);
    code_byte(coder, (mask & kClassificationBit) != 0, classification, kClassification, last,
              record);
    std::uint8_t angle = last[kScanAngle];
    if ((mask & kScanAngleBit) != 0) {
      angle = static_cast<std::uint8_t>(scan_angle.code(
          coder, angle, input_value<Coder, std::uint8_t>(record + kScanAngle), k < 3 ? 1 : 0));
    }
    put<Coder>(record + kScanAngle, angle);
    code_byte(coder, (mask & kUserDataBit) != 0, user_data, kUserData, last, record);
    code_short(coder, (mask & kSourceBit) != 0, source, kSource, last, record);
  }
};

/// Codes GPS times as one sequence of multiples of a difference.
struct GpsTimeV1 {
  static constexpr unsigned kMax = 509, kFull = 510, kSame = 511;

  SymbolModel<3> first;  ///< before the first difference: same, difference, complete time
  SymbolModel<512> multiple;
  IntegerModels<32, 6> integers;
  std::uint64_t time;
  std::int32_t difference;
  unsigned extremes;

  void begin(std::uint64_t time_of_first) {
    time = time_of_first;
    difference = 0;
    extremes = 0;
  }

  template <class Coder>
  std::uint64_t code(Coder& coder, std::uint64_t value) {
    coder.reserve();
    const auto delta64 = static_cast<std::int64_t>(value - time);
    const auto delta = static_cast<std::int32_t>(delta64);
    const bool fits = delta == delta64;
    if (difference == 0) {
      const unsigned symbol = coder.symbol(first, !fits ? 2 : delta == 0 ? 0 : 1);
      if (symbol == 2) return code_full(coder, value);
      if (symbol == 1) advance(difference = integers.code(coder, 0, delta, 0));
      return time;
    }
    unsigned symbol = 0;
    if constexpr (!Coder::kDecoding) {
      symbol = !fits ? kFull : delta == 0 ? kSame : multiple_symbol(delta);
    }
    symbol = coder.symbol(multiple, symbol);
    if (symbol == kFull) return code_full(coder, value);
    if (symbol == kSame) return time;
    const unsigned context = symbol == 1   ? 1
                             : symbol == 0 ? 2
                             : symbol < 10 ? 3
                             : symbol < 50 ? 4
                                           : 5;
    const auto predicted =
        symbol == 0 ? difference / 4
                    : static_cast<std::int32_t>(symbol * static_cast<std::uint32_t>(difference));
    const std::int32_t coded = integers.code(coder, predicted, delta, context);
    if (symbol == 1) {
      difference = coded;
      extremes = 0;
    } else if ((symbol == 0 || symbol == kMax) && ++extremes > 3) {
      difference = coded;
      extremes = 0;
    }
    advance(coded);
    return time;
  }

 private:
  void advance(std::int32_t delta) { time += static_cast<std::uint64_t>(std::int64_t{delta}); }
  [[nodiscard]] unsigned multiple_symbol(std::int32_t delta) const {
    const double ratio = static_cast<float>(delta) / static_cast<float>(difference);
    return static_cast<unsigned>(std::clamp(ratio, 0.0, double{kMax}) + 0.5);
  }
  template <class Coder>
  std::uint64_t code_full(Coder& coder, std::uint64_t value) {
    const std::uint32_t low = coder.raw(32, static_cast<std::uint32_t>(value));
    time = low | std::uint64_t{coder.raw(32, static_cast<std::uint32_t>(value >> 32))} << 32;
    return time;
  }
};

/// Models of a chunk of version 1; those of extra bytes are separate.
struct PointwiseV1 {
  Point10V1 point;
  GpsTimeV1 gps_time;
  SymbolModel<64> rgb_changed;  ///< flags of low and high bytes of red, green, blue
  IntegerModels<8, 6> rgb;
  WavePacket wave_packet;
  IntegerModels<8, 1> extra_bytes;  ///< without the magnitudes, which are separate for each byte

  void begin(const RecordLayout& layout, const std::uint8_t* first) {
    point.begin();
    if (layout.gps_time != 0) gps_time.begin(load<std::uint64_t>(first + layout.gps_time));
    wave_packet.begin();
  }

  template <class Coder>
  void code(Coder& coder, const RecordLayout& layout, SymbolModel<9>* extra,
            const std::uint8_t* last, typename Coder::Record record) {
    point.code(coder, last, record);
    if (const std::size_t at = layout.gps_time; at != 0) {
      put<Coder>(record + at, gps_time.code(coder, input_value<Coder, std::uint64_t>(record + at)));
    }
    if (const std::size_t at = layout.rgb; at != 0) {
      coder.reserve();
      unsigned mask = 0;
      for (unsigned i = 0; i < 6; ++i) {
        if (input_value<Coder, std::uint8_t>(record + at + i) != last[at + i]) mask |= 1u << i;
      }
      mask = coder.symbol(rgb_changed, mask);
      for (unsigned i = 0; i < 6; ++i) {
        const std::uint8_t previous = last[at + i],
                           value = input_value<Coder, std::uint8_t>(record + at + i);
        put<Coder>(record + at + i,
                   (mask >> i & 1) != 0
                       ? low_byte(static_cast<unsigned>(rgb.code(coder, previous, value, i)))
                       : previous);
      }
    }
    if (const std::size_t at = layout.wave_packet; at != 0) {
      wave_packet.code(coder, last + at, record + at);
    }
    for (std::size_t i = 0; i < layout.extra_bytes; ++i) {
      const std::size_t at = layout.extra + i;
      if (i % 8 == 0) coder.reserve();
      put<Coder>(record + at,
                 low_byte(static_cast<unsigned>(extra_bytes.code(
                     coder, last[at], input_value<Coder, std::uint8_t>(record + at), extra[i]))));
    }
  }
};

}  // namespace terrace::stream::laz
