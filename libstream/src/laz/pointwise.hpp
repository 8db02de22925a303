// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "laz/items.hpp"
#include "laz/layout.hpp"

/// Pointwise chunks, point formats 0 to 5: the first record uncoded, then one stream with all items
/// of all further points. These are the items of version 2, which LASzip has written since 2011.

namespace terrace::stream::laz {

/// LASzip's tables of contexts for each number of returns n and return r, indexed by the lower 6
/// bits of the byte that holds them, n * 8 + r.
struct Returns10 {
  std::array<std::uint8_t, 64> map, level;

  static constexpr Returns10 make() {
    constexpr const char* kMap[8] = {"FEDCBA98", "E0136AA9", "D1247BBA", "C3458CCB",
                                     "B6789DDC", "AABCDEED", "9ABCDEFE", "89ABCDEF"};
    Returns10 tables{};
    for (int n = 0; n < 8; ++n) {
      for (int r = 0; r < 8; ++r) {
        const auto at = static_cast<std::size_t>(n * 8 + r);
        const char digit = kMap[n][r];
        tables.map[at] = static_cast<std::uint8_t>(digit <= '9' ? digit - '0' : digit - 'A' + 10);
        tables.level[at] = static_cast<std::uint8_t>(n > r ? n - r : r - n);
      }
    }
    return tables;
  }
};
inline constexpr Returns10 kReturns10 = Returns10::make();

/// The first 20 bytes of all records of formats 0 to 5: the part that both versions code.
struct Point10 {
  /// Offsets in the record.
  static constexpr std::size_t kX = 0, kY = 4, kZ = 8, kIntensity = 12, kReturns = 14,
                               kClassification = 15, kScanAngle = 16, kUserData = 17, kSource = 18;

  SymbolModel<64> changed;  ///< a bit for each part that can be omitted
  /// Indexed by the byte of the previous point.
  std::array<SymbolModel<256>, 256> returns, classification, user_data;
  IntegerModels<16, 1> source;

  /// Codes the byte at `at` if it changed.
  template <class Coder, class Models>
  TERRACE_LAZ_INLINE static unsigned code_byte(Coder& coder, bool changed, Models& models,
                                               std::size_t at, const std::uint8_t* last,
                                               typename Coder::Record record) {
    unsigned byte = last[at];
    if (changed) byte = coder.symbol(models[byte], input_value<Coder, std::uint8_t>(record + at));
    put<Coder>(record + at, low_byte(byte));
    return byte;
  }
  /// Codes the 16 bits at `at` if they changed.
  template <class Coder, class Models>
  TERRACE_LAZ_INLINE static void code_short(Coder& coder, bool changed, Models& models,
                                            std::size_t at, const std::uint8_t* last,
                                            typename Coder::Record record) {
    auto value = load<std::uint16_t>(last + at);
    if (changed) {
      value = static_cast<std::uint16_t>(
          models.code(coder, value, input_value<Coder, std::uint16_t>(record + at), 0));
    }
    put<Coder>(record + at, value);
  }
};

/// The point of version 2, whose coordinates depend on the returns.
struct Point10V2 : Point10 {
  std::array<SymbolModel<256>, 2> scan_angle;  ///< by scan direction
  IntegerModels<16, 4> intensity;
  IntegerModels<32, 2> x;
  IntegerModels<32, 22> y;
  IntegerModels<32, 20> z;
  std::array<Median5, 16> x_steps, y_steps;
  std::array<std::uint16_t, 16> last_intensity;
  std::array<std::int32_t, 8> last_z;

  void begin() {
    for (Median5& steps : x_steps) steps.begin();
    for (Median5& steps : y_steps) steps.begin();
    last_intensity = {};
    last_z = {};
  }

  template <class Coder>
  TERRACE_LAZ_INLINE void code(Coder& coder, const std::uint8_t* last,
                               typename Coder::Record record) {
    enum : unsigned {
      kSourceBit = 1,
      kUserDataBit = 2,
      kScanAngleBit = 4,
      kClassificationBit = 8,
      kIntensityBit = 16,
      kReturnsBit = 32
    };
    coder.reserve();
    unsigned mask = 0;
    if constexpr (!Coder::kDecoding) {
      const auto differs = [&](std::size_t at, unsigned bit) {
        return record[at] != last[at] ? bit : 0;
      };
      mask = differs(kReturns, kReturnsBit) | differs(kClassification, kClassificationBit) |
             differs(kScanAngle, kScanAngleBit) | differs(kUserData, kUserDataBit) |
             differs(kSource, kSourceBit) | differs(kSource + 1, kSourceBit);
      const std::uint16_t previous = last_intensity[kReturns10.map[record[kReturns] & 63]];
      if (load<std::uint16_t>(record + kIntensity) != previous) mask |= kIntensityBit;
    }
    mask = coder.symbol(changed, mask);

    const unsigned bits =
        code_byte(coder, (mask & kReturnsBit) != 0, returns, kReturns, last, record);
    const unsigned map = kReturns10.map[bits & 63], level = kReturns10.level[bits & 63];
    const bool single = (bits >> 3 & 7) == 1;
    if ((mask & kIntensityBit) != 0) {
      last_intensity[map] = static_cast<std::uint16_t>(intensity.code(
          coder, last_intensity[map], input_value<Coder, std::uint16_t>(record + kIntensity),
          std::min(map, 3u)));
    }
    put<Coder>(record + kIntensity, last_intensity[map]);
    code_byte(coder, (mask & kClassificationBit) != 0, classification, kClassification, last,
              record);
    unsigned angle = last[kScanAngle];
    if ((mask & kScanAngleBit) != 0) {
      const unsigned change = input_value<Coder, std::uint8_t>(record + kScanAngle) - angle;
      angle += coder.symbol(scan_angle[bits >> 6 & 1], low_byte(change));
    }
    put<Coder>(record + kScanAngle, low_byte(angle));
    code_byte(coder, (mask & kUserDataBit) != 0, user_data, kUserData, last, record);
    code_short(coder, (mask & kSourceBit) != 0, source, kSource, last, record);

    code_step(coder, x, x_steps[map], single ? 1 : 0, last + kX, record + kX);
    code_step(coder, y, y_steps[map], y_context(x.magnitude, single), last + kY, record + kY);
    last_z[level] = z.code(coder, last_z[level], input_value<Coder, std::int32_t>(record + kZ),
                           z_context((x.magnitude + y.magnitude) / 2, single));
    put<Coder>(record + kZ, last_z[level]);
  }
};

/// Models of a chunk in any of the formats; those of extra bytes are separate.
struct PointwiseV2 {
  Point10V2 point;
  GpsTime<false> gps_time;
  Rgb rgb;
  WavePacket wave_packet;

  /// Begins a chunk with its first record.
  void begin(const RecordLayout& layout, const std::uint8_t* first) {
    point.begin();
    if (layout.gps_time != 0) gps_time.begin(load<std::uint64_t>(first + layout.gps_time));
    wave_packet.begin();
  }

  /// Codes a record relative to the previous one.
  template <class Coder>
  TERRACE_LAZ_INLINE void code(Coder& coder, const RecordLayout& layout, SymbolModel<256>* extra,
                               const std::uint8_t* last, typename Coder::Record record) {
    point.code(coder, last, record);
    if (const std::size_t at = layout.gps_time; at != 0) {
      put<Coder>(record + at, gps_time.code(coder, input_value<Coder, std::uint64_t>(record + at)));
    }
    if (const std::size_t at = layout.rgb; at != 0) {
      put<Coder>(record + at, rgb.code(coder, load<Rgb::Value>(last + at),
                                       input_value<Coder, Rgb::Value>(record + at)));
    }
    if (const std::size_t at = layout.wave_packet; at != 0) {
      wave_packet.code(coder, last + at, record + at);
    }
    for (std::size_t i = 0; i < layout.extra_bytes; ++i) {
      const std::size_t at = layout.extra + i;
      if (i % 16 == 0) coder.reserve();
      const unsigned change = input_value<Coder, std::uint8_t>(record + at) - last[at];
      put<Coder>(record + at, low_byte(last[at] + coder.symbol(extra[i], low_byte(change))));
    }
  }
};

}  // namespace terrace::stream::laz
