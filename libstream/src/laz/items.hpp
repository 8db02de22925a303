// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "laz/bytes.hpp"
#include "laz/coder.hpp"
#include "laz/integer_coder.hpp"

/// The items that pointwise and layered chunks code in the same way. Each function codes a part of
/// a record with the models of its struct. Values to encode are parameters, which decoding ignores;
/// both directions return the value.

namespace terrace::stream::laz {

/// Loads a value of the record to encode; 0 in decoding.
template <class Coder, class T>
TERRACE_LAZ_INLINE T input_value(typename Coder::Record at) {
  if constexpr (Coder::kDecoding) {
    return T{};
  } else {
    return load<T>(at);
  }
}

/// Stores a decoded value.
template <class Coder, class T>
TERRACE_LAZ_INLINE void put(typename Coder::Record at, T value) {
  if constexpr (Coder::kDecoding) store(at, value);
}

TERRACE_LAZ_INLINE std::uint8_t low_byte(unsigned value) {
  return static_cast<std::uint8_t>(value);
}

/// LASzip's running median of differences: five sorted values, of which a new value replaces the
/// highest and the lowest in turn.
struct Median5 {
  std::array<std::int32_t, 5> sorted;
  bool drop_highest;

  void begin() {
    sorted = {};
    drop_highest = true;
  }
  [[nodiscard]] std::int32_t value() const { return sorted[2]; }
  TERRACE_LAZ_INLINE void add(std::int32_t x) {
    const std::int32_t* rest = sorted.data() + (drop_highest ? 0 : 1);
    const std::int32_t a = rest[0], b = rest[1], c = rest[2], d = rest[3];
    drop_highest = drop_highest ? x < sorted[2] : x <= sorted[2];
    sorted = {std::min(a, x), std::max(a, std::min(b, x)), std::max(b, std::min(c, x)),
              std::max(c, std::min(d, x)), std::max(d, x)};
  }
};

/// Return the context of a correction: of Y, given the magnitude k of X's correction; of Z, given
/// the mean of both magnitudes.
TERRACE_LAZ_INLINE unsigned y_context(unsigned k, bool single) {
  return (single ? 1 : 0) + (k < 20 ? k & ~1u : 20);
}
TERRACE_LAZ_INLINE unsigned z_context(unsigned k, bool single) {
  return (single ? 1 : 0) + (k < 18 ? k & ~1u : 18);
}

/// Codes a coordinate, predicted by the median of the previous steps.
template <class Coder, class Models, class Median>
TERRACE_LAZ_INLINE void code_step(Coder& coder, Models& models, Median& steps, unsigned context,
                                  const std::uint8_t* last, typename Coder::Record record) {
  const auto previous = load<std::uint32_t>(last);
  const std::uint32_t delta = input_value<Coder, std::uint32_t>(record) - previous;
  const std::int32_t step =
      models.code(coder, steps.value(), static_cast<std::int32_t>(delta), context);
  put<Coder>(record, previous + static_cast<std::uint32_t>(step));
  steps.add(step);
}

/// Codes GPS times, as the 64-bit patterns of the doubles: up to four alternating sequences, each
/// of which continues by multiples of a difference. Layered chunks have no symbol for an unchanged
/// time.
template <bool kLayered>
struct GpsTime {
  static constexpr unsigned kUnchanged = kLayered ? 0 : 1;  ///< symbols for an unchanged time
  static constexpr int kMaxMultiple = 500, kMinMultiple = -10;
  static constexpr unsigned kMultiples = kMaxMultiple - kMinMultiple + 1;
  /// The symbols after the multiples and "unchanged": a complete time, then the sequences 1 to 3
  /// ahead of the current one.
  static constexpr unsigned kFull = kMultiples + kUnchanged;

  SymbolModel<5 + kUnchanged> first;  ///< if a sequence has no difference yet
  SymbolModel<515 + kUnchanged> multiple;
  IntegerModels<32, 9> integers;
  std::array<std::uint64_t, 4> time;
  std::array<std::int32_t, 4> difference;
  std::array<unsigned, 4> extremes;  ///< consecutive differences out of the range of multiples
  unsigned current, newest;

  void begin(std::uint64_t time_of_first) {
    time = {time_of_first, 0, 0, 0};
    difference = {};
    extremes = {};
    current = newest = 0;
  }

  template <class Coder>
  TERRACE_LAZ_INLINE std::uint64_t code(Coder& coder, std::uint64_t value) {
    // How many sequences after the current one is the one that `value` continues; 4: none.
    unsigned ahead = 0;
    if constexpr (!Coder::kDecoding) {
      while (ahead < 4 && !fits(value - time[(current + ahead) & 3])) ++ahead;
    }
    for (bool switched = false;; switched = true) {
      coder.reserve();
      const std::int32_t step = difference[current];
      const auto delta = static_cast<std::int32_t>(value - time[current]);
      const bool same = kUnchanged > 0 && value == time[current];
      unsigned skip = 0;
      if (step == 0) {
        const unsigned chosen = ahead == 4  ? kUnchanged + 1
                                : ahead > 0 ? kUnchanged + 1 + ahead
                                : same      ? 0
                                            : kUnchanged;
        const unsigned symbol = coder.symbol(first, chosen);
        if (symbol < kUnchanged) return time[current];
        if (symbol == kUnchanged) {
          difference[current] = integers.code(coder, 0, delta, 0);
          extremes[current] = 0;
          return advance(difference[current]);
        }
        skip = symbol - kUnchanged - 1;
      } else {
        unsigned chosen = 0;
        if constexpr (!Coder::kDecoding) {
          chosen = ahead == 4  ? kFull
                   : ahead > 0 ? kFull + ahead
                   : same      ? kMultiples
                               : multiple_symbol(delta, step);
        }
        const unsigned symbol = coder.symbol(multiple, chosen);
        if (symbol < kMultiples) return code_multiple(coder, symbol, step, delta);
        if (symbol < kFull) return time[current];
        skip = symbol - kFull;
      }
      if (skip == 0) return code_full(coder, value);
      if constexpr (Coder::kDecoding) {
        if (switched) coder.refuse();
      }
      current = (current + skip) & 3;
      ahead = 0;
    }
  }

 private:
  static bool fits(std::uint64_t difference) {
    const auto value = static_cast<std::int64_t>(difference);
    return value == static_cast<std::int32_t>(value);
  }
  std::uint64_t advance(std::int32_t delta) {
    return time[current] += static_cast<std::uint64_t>(static_cast<std::int64_t>(delta));
  }
  /// Returns the nearest multiple, rounded as in LASzip, so that the bytes are the same.
  static unsigned multiple_symbol(std::int32_t delta, std::int32_t step) {
    const double ratio = static_cast<float>(delta) / static_cast<float>(step);
    const double bounded = std::clamp(ratio, kMinMultiple - 1.0, kMaxMultiple + 1.0);
    const int nearest = static_cast<int>(bounded >= 0 ? bounded + 0.5 : bounded - 0.5);
    const int symbol = std::clamp(nearest, kMinMultiple, kMaxMultiple);
    return static_cast<unsigned>(symbol >= 0 ? symbol : kMaxMultiple - symbol);
  }
  template <class Coder>
  TERRACE_LAZ_INLINE std::uint64_t code_multiple(Coder& coder, unsigned symbol, std::int32_t step,
                                                 std::int32_t delta) {
    const int times =
        symbol <= kMaxMultiple ? static_cast<int>(symbol) : kMaxMultiple - static_cast<int>(symbol);
    const unsigned context = times == 1              ? 1
                             : times == 0            ? 7
                             : times == kMaxMultiple ? 4
                             : times == kMinMultiple ? 6
                             : times < 0             ? 5
                             : times < 10            ? 2
                                                     : 3;
    const auto predicted = static_cast<std::int32_t>(static_cast<std::uint32_t>(times) *
                                                     static_cast<std::uint32_t>(step));
    const std::int32_t coded = integers.code(coder, predicted, delta, context);
    if (times == 1) {
      extremes[current] = 0;
    } else if (times == 0 || times == kMaxMultiple || times == kMinMultiple) {
      if (++extremes[current] > 3) {
        difference[current] = coded;
        extremes[current] = 0;
      }
    }
    return advance(coded);
  }
  template <class Coder>
  TERRACE_LAZ_INLINE std::uint64_t code_full(Coder& coder, std::uint64_t value) {
    const auto upper = static_cast<std::int32_t>(time[current] >> 32);
    const std::uint64_t high = static_cast<std::uint32_t>(
        integers.code(coder, upper, static_cast<std::int32_t>(value >> 32), 8));
    newest = (newest + 1) & 3;
    current = newest;
    time[current] = high << 32 | coder.raw(32, static_cast<std::uint32_t>(value));
    difference[current] = 0;
    extremes[current] = 0;
    return time[current];
  }
};

/// Codes colours, byte by byte: red relative to the previous point, green relative to red's change,
/// blue relative to both.
struct Rgb {
  using Value = std::array<std::uint16_t, 3>;

  SymbolModel<128> changed;  ///< flags of low and high bytes of red, green, blue; not grey
  std::array<SymbolModel<256>, 6> changes;

  template <class Coder>
  TERRACE_LAZ_INLINE Value code(Coder& coder, const Value& last, const Value& value) {
    constexpr unsigned kColoured = 64;
    coder.reserve();
    unsigned mask = 0;
    if constexpr (!Coder::kDecoding) {
      for (unsigned i = 0; i < 3; ++i) {
        const unsigned differs = last[i] ^ value[i];
        mask |= ((differs & 0xff) != 0 ? 1u : 0u) << (2 * i);
        mask |= (differs > 0xff ? 2u : 0u) << (2 * i);
      }
      if (value[0] != value[1] || value[0] != value[2]) mask |= kColoured;
    }
    mask = coder.symbol(changed, mask);
    const int last_low[3] = {last[0] & 0xff, last[1] & 0xff, last[2] & 0xff};
    const int last_high[3] = {last[0] >> 8, last[1] >> 8, last[2] >> 8};
    const int red_low = code_byte(coder, mask, 0, last_low[0], 0, value[0] & 0xff);
    const int red_high = code_byte(coder, mask, 1, last_high[0], 0, value[0] >> 8);
    const std::uint16_t red = join_bytes(red_high, red_low);
    if ((mask & kColoured) == 0) return {red, red, red};
    const int low = red_low - last_low[0], high = red_high - last_high[0];
    const int green_low = code_byte(coder, mask, 2, last_low[1], low, value[1] & 0xff);
    const int blue_low = code_byte(coder, mask, 4, last_low[2], (low + green_low - last_low[1]) / 2,
                                   value[2] & 0xff);
    const int green_high = code_byte(coder, mask, 3, last_high[1], high, value[1] >> 8);
    const int blue_high = code_byte(coder, mask, 5, last_high[2],
                                    (high + green_high - last_high[1]) / 2, value[2] >> 8);
    return {red, join_bytes(green_high, green_low), join_bytes(blue_high, blue_low)};
  }

 private:
  TERRACE_LAZ_INLINE static std::uint16_t join_bytes(int high, int low) {
    return static_cast<std::uint16_t>(high << 8 | low);
  }
  /// Codes a byte whose bit in the mask is set, as the difference from `previous` + `movement`.
  template <class Coder>
  TERRACE_LAZ_INLINE int code_byte(Coder& coder, unsigned mask, unsigned bit, int previous,
                                   int movement, int byte) {
    if ((mask >> bit & 1) == 0) return previous;
    const int predicted = std::clamp(previous + movement, 0, 255);
    const unsigned change =
        coder.symbol(changes[bit], low_byte(static_cast<unsigned>(byte - predicted)));
    return (predicted + static_cast<int>(change)) & 0xff;
  }
};

/// Codes wave packets: index, position and size in the file of waveforms, and the position of the
/// return in the waveform.
struct WavePacket {
  static constexpr std::size_t kSize = 29;

  SymbolModel<256> index;
  std::array<SymbolModel<4>, 4> modes;  ///< by the previous point's
  IntegerModels<32, 1> offset_change, packet_size, return_position;
  IntegerModels<32, 3> direction;
  std::int32_t last_change;
  unsigned mode;

  void begin() {
    last_change = 0;
    mode = 0;
  }

  template <class Coder>
  TERRACE_LAZ_INLINE void code(Coder& coder, const std::uint8_t* last,
                               typename Coder::Record record) {
    coder.reserve();
    put<Coder>(record, low_byte(coder.symbol(index, input_value<Coder, std::uint8_t>(record))));
    const auto previous = load<std::uint64_t>(last + 1);
    const auto size = load<std::uint32_t>(last + 9);
    const auto offset = input_value<Coder, std::uint64_t>(record + 1);
    const auto change = static_cast<std::int64_t>(offset - previous);
    const auto change32 = static_cast<std::int32_t>(change);
    unsigned chosen = 0;
    if constexpr (!Coder::kDecoding) {
      chosen = change == 0 ? 0 : change != change32 ? 3 : change == size ? 1 : 2;
    }
    mode = coder.symbol(modes[mode], chosen);
    std::uint64_t coded = previous;
    if (mode == 1) {
      coded += size;
    } else if (mode == 2) {
      last_change = offset_change.code(coder, last_change, change32, 0);
      coded += static_cast<std::uint64_t>(static_cast<std::int64_t>(last_change));
    } else if (mode == 3) {
      const std::uint32_t low = coder.raw(32, static_cast<std::uint32_t>(offset));
      coded = low | std::uint64_t{coder.raw(32, static_cast<std::uint32_t>(offset >> 32))} << 32;
    }
    put<Coder>(record + 1, coded);
    code_part(coder, packet_size, last + 9, record + 9, 0);
    code_part(coder, return_position, last + 13, record + 13, 0);
    for (unsigned i = 0; i < 3; ++i) {
      code_part(coder, direction, last + 17 + 4 * i, record + 17 + 4 * i, i);
    }
  }

 private:
  template <class Coder, class Models>
  TERRACE_LAZ_INLINE static void code_part(Coder& coder, Models& models, const std::uint8_t* last,
                                           typename Coder::Record record, unsigned context) {
    put<Coder>(record, models.code(coder, load<std::int32_t>(last),
                                   input_value<Coder, std::int32_t>(record), context));
  }
};

}  // namespace terrace::stream::laz
