// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "laz/items.hpp"
#include "laz/layout.hpp"
#include "terrace/stream/laz.hpp"

/// Layered chunks, point formats 6 to 10: each attribute has a separate stream, so that it can be
/// skipped. The first layer holds everything on which the others depend: returns, scanner channel,
/// and which of them change. Points pass through one layer after another in runs of a few hundred.

namespace terrace::stream::laz {

/// LASzip's tables of contexts for each number of returns n and return r, indexed by the byte that
/// holds them, n * 16 + r.
struct Returns14 {
  std::array<std::uint8_t, 256> map, level;

  static constexpr Returns14 make() {
    constexpr const char* kMap[16] = {
        "0123453445555555", "1013333333333333", "2124444444433333", "3345444444444444",
        "4344544444444444", "5344454444444444", "3344445444444444", "4344444544444444",
        "4344444454444444", "5344444445444444", "5344444444544444", "5334444444455444",
        "5334444444455544", "5334444444445554", "5334444444444555", "5334444444444455"};
    Returns14 tables{};
    for (int n = 0; n < 16; ++n) {
      for (int r = 0; r < 16; ++r) {
        const auto at = static_cast<std::size_t>(n * 16 + r);
        tables.map[at] = static_cast<std::uint8_t>(kMap[n][r] - '0');
        tables.level[at] = static_cast<std::uint8_t>(std::min(7, n > r ? n - r : r - n));
      }
    }
    return tables;
  }
};
inline constexpr Returns14 kReturns14 = Returns14::make();

/// The layers of a chunk, in the order of their bytes.
enum Layer : std::size_t {
  kXyLayer,
  kZLayer,
  kClassificationLayer,
  kFlagsLayer,
  kIntensityLayer,
  kScanAngleLayer,
  kUserDataLayer,
  kSourceLayer,
  kTimeLayer,
  kItemLayers,  ///< first layer of the items after the point
};

inline std::size_t layer_count(const RecordLayout& layout) {
  return kItemLayers + (layout.rgb != 0 ? 1 : 0) + (layout.nir != 0 ? 1 : 0) +
         (layout.wave_packet != 0 ? 1 : 0) + layout.extra_bytes;
}

/// Models of the points of one scanner channel.
struct Channel14 {
  std::array<SymbolModel<128>, 8> changed;
  SymbolModel<3> channel;
  std::array<SymbolModel<16>, 16> return_count, return_number;
  SymbolModel<13> return_step;
  IntegerModels<32, 2> x;
  IntegerModels<32, 22> y;
  std::array<Median5, 12> x_steps, y_steps;
  bool time_changed;

  IntegerModels<32, 20> z;
  std::array<std::int32_t, 8> last_z;
  std::array<SymbolModel<256>, 64> classification, user_data;
  std::array<SymbolModel<64>, 64> flags;
  IntegerModels<16, 4> intensity;
  std::array<std::uint16_t, 8> last_intensity;
  IntegerModels<16, 2> scan_angle;
  IntegerModels<16, 1> source;
  GpsTime<true> time;

  // The items after the point; the channel whose models they use is not always the point's.
  Rgb rgb;
  Rgb::Value last_rgb;
  SymbolModel<4> nir_changed;
  std::array<SymbolModel<256>, 2> nir;
  std::uint16_t last_nir;
  WavePacket wave_packet;
  std::array<std::uint8_t, WavePacket::kSize> last_wave_packet;
};

/// Models and state of layered chunks in either direction.
template <class Coder>
class Layered {
 public:
  using Record = typename Coder::Record;

  explicit Layered(const RecordLayout& layout)
      : coders(layer_count(layout)),
        layout_(layout),
        channels_(make_zeroed<Channel14>(kChannels)),
        extra_(make_zeroed<SymbolModel<256>>(kChannels * layout.extra_bytes)),
        last_extra_(kChannels * layout.extra_bytes),
        last_(kChannels * layout.length) {}

  struct LayerCoder {
    Coder coder;
    /// In decoding, whether the layer exists and is selected. In encoding, whether it must exist.
    bool used = false;
  };
  std::vector<LayerCoder> coders;

  /// Begins a chunk with its first record. The caller must begin the layers' coders.
  void begin(const std::uint8_t* first) {
    known_.fill(false);
    current_ = channel_of(first);
    for (std::size_t i = 0; i < kChannels; ++i)
      predecessors_[i] = last_.data() + i * layout_.length;
    std::memcpy(last_.data() + current_ * layout_.length, first, layout_.length);
    begin_channel(current_);
    Channel14& channel = channels_[current_];
    begin_z(channel, first);
    begin_intensity(channel, first);
    channel.time.begin(load<std::uint64_t>(first + kTime));

    item_known_.fill(false);
    item_current_ = current_;
    item_known_[current_] = true;
    if (layout_.rgb != 0) channel.last_rgb = load<Rgb::Value>(first + layout_.rgb);
    if (layout_.nir != 0) channel.last_nir = load<std::uint16_t>(first + layout_.nir);
    if (layout_.wave_packet != 0) {
      std::memcpy(channel.last_wave_packet.data(), first + layout_.wave_packet, WavePacket::kSize);
      channel.wave_packet.begin();
    }
    std::copy_n(first + layout_.extra, layout_.extra_bytes, last_extra(current_));
    if constexpr (!Coder::kDecoding) {
      for (LayerCoder& layer : coders) layer.used = false;
      coders[kXyLayer].used = coders[kZLayer].used = true;
    }
  }

  /// Codes the next `count` records.
  void code(Record records, std::size_t count) {
    for (; count > 0;) {
      const std::size_t run = std::min(count, run_.size());
      code_run(records, run);
      records += run * layout_.length;
      count -= run;
    }
    // The caller's records may not exist until the next call.
    for (std::size_t i = 0; i < kChannels; ++i) {
      std::uint8_t* stored = last_.data() + i * layout_.length;
      if (known_[i] && predecessors_[i] != stored)
        std::memcpy(stored, predecessors_[i], layout_.length);
      predecessors_[i] = stored;
    }
  }

 private:
  static constexpr std::size_t kChannels = 4;
  /// Offsets in the record.
  static constexpr std::size_t kX = 0, kY = 4, kZ = 8, kIntensity = 12, kReturns = 14, kFlags = 15,
                               kClassification = 16, kUserData = 17, kScanAngle = 18, kSource = 20,
                               kTime = 22, kSize = 30;

  /// The data of a point that the layers after the first need.
  struct Point {
    const std::uint8_t* last;  ///< the record from which it is predicted
    std::uint8_t channel;
    bool new_channel;    ///< whether the channel is new and begins with the values of `last`
    std::uint8_t level;  ///< level context of Z
    std::uint8_t z_context;
    std::uint8_t return_kind;  ///< 2 for a first return, + 1 for a last
    bool time_changed, angle_changed, source_changed;
    /// For the items after the point: the channels whose models and whose last value are used, and
    /// the one from which the last value is first copied.
    std::uint8_t item_models, item_last, item_origin;
  };

  static std::uint8_t channel_of(const std::uint8_t* record) { return record[kFlags] >> 4 & 3; }
  std::uint8_t* last_extra(std::size_t channel) {
    return last_extra_.data() + channel * layout_.extra_bytes;
  }

  /// Begins the first layer's part of a new channel; the other layers begin theirs when they reach
  /// it.
  void begin_channel(unsigned channel) {
    known_[channel] = true;
    Channel14& models = channels_[channel];
    for (Median5& steps : models.x_steps) steps.begin();
    for (Median5& steps : models.y_steps) steps.begin();
    models.time_changed = false;
  }
  static void begin_z(Channel14& models, const std::uint8_t* origin) {
    models.last_z.fill(load<std::int32_t>(origin + kZ));
  }
  static void begin_intensity(Channel14& models, const std::uint8_t* origin) {
    models.last_intensity.fill(load<std::uint16_t>(origin + kIntensity));
  }

  void code_run(Record records, std::size_t count) {
    code_xy(records, count);
    if (coded(kZLayer)) code_z(records, count);
    if (coded(kClassificationLayer)) code_classification(records, count);
    if (coded(kFlagsLayer)) code_flags(records, count);
    if (coded(kIntensityLayer)) code_intensity(records, count);
    if (coded(kScanAngleLayer)) code_scan_angle(records, count);
    if (coded(kUserDataLayer)) code_user_data(records, count);
    if (coded(kSourceLayer)) code_source(records, count);
    if (coded(kTimeLayer)) code_time(records, count);
    std::size_t layer = kItemLayers;
    if (layout_.rgb != 0) {
      if (coded(layer)) code_rgb(records, count, layer);
      ++layer;
    }
    if (layout_.nir != 0) {
      if (coded(layer)) code_nir(records, count, layer);
      ++layer;
    }
    if (layout_.wave_packet != 0) {
      if (coded(layer)) code_wave_packet(records, count, layer);
      ++layer;
    }
    for (std::size_t i = 0; i < layout_.extra_bytes; ++i, ++layer) {
      if (coded(layer)) code_extra_byte(records, count, layer, i);
    }
  }

  [[nodiscard]] bool coded(std::size_t layer) const {
    return !Coder::kDecoding || coders[layer].used;
  }

  /// Codes a layer: calls code_one(coder, point, record) for each point, which returns whether the
  /// value changed.
  template <class CodeOne>
  TERRACE_LAZ_INLINE void for_each(Record records, std::size_t count, std::size_t layer,
                                   const CodeOne& code_one) {
    Coder coder = coders[layer].coder;
    bool changed = false;
    for (std::size_t i = 0; i < count; ++i) {
      coder.reserve();
      changed |= code_one(coder, run_[i], records + i * layout_.length);
    }
    coders[layer].coder = coder;
    if constexpr (!Coder::kDecoding) coders[layer].used |= changed;
  }

  /// The changes of a point that the first layer codes, as bits.
  enum Change : unsigned {
    kReturnBits = 3,  // 1: next number, 2: previous, 3: another
    kReturnCountBit = 4,
    kScanAngleBit = 8,
    kTimeBit = 16,
    kSourceBit = 32,
    kChannelBit = 64
  };

  void code_xy(Record records, std::size_t count) {
    Coder coder = coders[kXyLayer].coder;
    for (std::size_t i = 0; i < count; ++i) {
      const Record record = records + i * layout_.length;
      Point& point = run_[i];
      const std::uint8_t* last = predecessors_[current_];
      Channel14* models = &channels_[current_];
      coder.reserve();
      const unsigned mask =
          coder.symbol(models->changed[change_context(*models, last)], input_changes(record, last));
      point.new_channel = false;
      if ((mask & kChannelBit) != 0) {
        last = change_channel(coder, record, last, point);
        models = &channels_[current_];
      }
      if constexpr (Coder::kDecoding) {
        std::memcpy(record, last, kSize);
        if (layout_.length > kSize)
          std::memcpy(record + kSize, last + kSize, layout_.length - kSize);
      }
      const unsigned returns_byte = code_returns(coder, *models, mask, last, record);
      const unsigned returns = returns_byte >> 4, number = returns_byte & 15;
      const bool single = returns == 1, time_changed = (mask & kTimeBit) != 0;
      put<Coder>(record + kReturns, low_byte(returns_byte));
      put<Coder>(record + kFlags, low_byte((last[kFlags] & 0xcfu) | current_ << 4));
      const unsigned steps = 2u * kReturns14.map[returns_byte] + (time_changed ? 1 : 0);
      code_step(coder, models->x, models->x_steps[steps], single ? 1 : 0, last + kX, record + kX);
      code_step(coder, models->y, models->y_steps[steps], y_context(models->x.magnitude, single),
                last + kY, record + kY);
      models->time_changed = time_changed;

      point.last = last;
      point.channel = static_cast<std::uint8_t>(current_);
      point.level = kReturns14.level[returns_byte];
      point.z_context =
          low_byte(z_context((models->x.magnitude + models->y.magnitude) / 2, single));
      point.return_kind = low_byte((number == 1 ? 2u : 0u) + (number >= returns ? 1u : 0u));
      point.time_changed = time_changed;
      point.angle_changed = (mask & kScanAngleBit) != 0;
      point.source_changed = (mask & kSourceBit) != 0;
      place_items(point, (mask & kChannelBit) != 0);
      predecessors_[current_] = record;
    }
    coders[kXyLayer].coder = coder;
  }

  static unsigned change_context(const Channel14& models, const std::uint8_t* last) {
    const unsigned number = last[kReturns] & 15, returns = last[kReturns] >> 4;
    return (number == 1 ? 1 : 0) + (number >= returns ? 2 : 0) + (models.time_changed ? 4 : 0);
  }

  /// Returns the changes of a record to encode; 0 in decoding. last: the previous record of any
  /// channel.
  TERRACE_LAZ_INLINE unsigned input_changes(Record record, const std::uint8_t* last) const {
    if constexpr (Coder::kDecoding) return 0;
    unsigned mask = 0;
    const unsigned channel = channel_of(record);
    if (channel != current_) mask |= kChannelBit;
    const std::uint8_t* previous = known_[channel] ? predecessors_[channel] : last;
    const unsigned step = (record[kReturns] - previous[kReturns]) & 15;
    mask |= step == 0 ? 0 : step == 1 ? 1 : step == 15 ? 2 : 3;
    if (record[kReturns] >> 4 != previous[kReturns] >> 4) mask |= kReturnCountBit;
    const auto differs = [&](std::size_t at, std::size_t size) {
      return std::memcmp(record + at, previous + at, size) != 0;
    };
    if (differs(kScanAngle, 2)) mask |= kScanAngleBit;
    if (differs(kTime, 8)) mask |= kTimeBit;
    if (differs(kSource, 2)) mask |= kSourceBit;
    return mask;
  }

  /// Codes the number of the point's channel, which becomes current. Returns the record from which
  /// the point is predicted: `last` if the channel is new.
  TERRACE_LAZ_INLINE const std::uint8_t* change_channel(Coder& coder, Record record,
                                                        const std::uint8_t* last, Point& point) {
    const unsigned skip = input_channel(record) - current_ - 1;
    current_ = (current_ + coder.symbol(channels_[current_].channel, skip & 3) + 1) & 3;
    if (!known_[current_]) {
      point.new_channel = true;
      predecessors_[current_] = last;
      begin_channel(current_);
    }
    return predecessors_[current_];
  }

  /// Codes number and count of returns. Returns them as one byte, like the record.
  TERRACE_LAZ_INLINE static unsigned code_returns(Coder& coder, Channel14& models, unsigned mask,
                                                  const std::uint8_t* last, Record record) {
    const unsigned input = input_returns(record);
    unsigned returns = last[kReturns] >> 4, number = last[kReturns] & 15;
    if ((mask & kReturnCountBit) != 0) {
      returns = coder.symbol(models.return_count[returns], input >> 4);
    }
    switch (mask & kReturnBits) {
      case 0:
        break;
      case 1:
        number = (number + 1) & 15;
        break;
      case 2:
        number = (number + 15) & 15;
        break;
      default:
        if ((mask & kTimeBit) != 0) {
          number = coder.symbol(models.return_number[number], input & 15);
        } else {
          const unsigned step = (input - number) & 15;
          number = (number + coder.symbol(models.return_step, step - 2) + 2) & 15;
        }
    }
    return returns << 4 | number;
  }

  /// Fields of a record to encode; 0 in decoding.
  static unsigned input_returns(Record record) {
    if constexpr (Coder::kDecoding) {
      return 0;
    } else {
      return record[kReturns];
    }
  }
  static unsigned input_channel(Record record) {
    if constexpr (Coder::kDecoding) {
      return 0;
    } else {
      return channel_of(record);
    }
  }

  /// Determines the channels whose models and last values the items after the point use. Version 3
  /// keeps two errors of the original software. If the channel does not change, it uses channel 0's
  /// models. If it changes, it reads and replaces the last value of the previous channel.
  void place_items(Point& point, bool channel_changed) {
    const bool is_fixed = layout_.version >= 4;
    const auto model_channel =
        static_cast<std::uint8_t>(is_fixed || channel_changed ? current_ : 0);
    point.item_models = point.item_last = point.item_origin = model_channel;
    if (model_channel == item_current_) return;
    const auto previous = static_cast<std::uint8_t>(item_current_);
    if (!item_known_[model_channel]) {
      point.item_origin = previous;
    } else if (!is_fixed) {
      point.item_last = previous;
    }
    item_known_[model_channel] = true;
    item_current_ = model_channel;
  }

  void code_z(Record records, std::size_t count) {
    for_each(records, count, kZLayer,
             [this](Coder& coder, const Point& point, Record record) TERRACE_LAZ_INLINE_LAMBDA {
               Channel14& models = channels_[point.channel];
               if (point.new_channel) begin_z(models, point.last);
               std::int32_t& z = models.last_z[point.level];
               z = models.z.code(coder, z, input_value<Coder, std::int32_t>(record + kZ),
                                 point.z_context);
               put<Coder>(record + kZ, z);
               return true;
             });
  }
  void code_classification(Record records, std::size_t count) {
    for_each(records, count, kClassificationLayer,
             [this](Coder& coder, const Point& point, Record record) TERRACE_LAZ_INLINE_LAMBDA {
               const std::uint8_t previous = point.last[kClassification];
               auto& model =
                   channels_[point.channel]
                       .classification[2u * (previous & 31) + (point.return_kind == 3 ? 1 : 0)];
               const unsigned value =
                   coder.symbol(model, input_value<Coder, std::uint8_t>(record + kClassification));
               put<Coder>(record + kClassification, low_byte(value));
               return value != previous;
             });
  }
  void code_flags(Record records, std::size_t count) {
    // Classification flags, scan direction, edge of flight line, without the scanner channel
    // between them.
    const auto flag_bits = [](unsigned byte) { return (byte & 15) | (byte >> 2 & 0x30); };
    for_each(records, count, kFlagsLayer,
             [this, flag_bits](Coder& coder, const Point& point, Record record)
                 TERRACE_LAZ_INLINE_LAMBDA {
                   const unsigned previous = flag_bits(point.last[kFlags]);
                   const unsigned flags =
                       coder.symbol(channels_[point.channel].flags[previous],
                                    flag_bits(input_value<Coder, std::uint8_t>(record + kFlags)));
                   put<Coder>(record + kFlags, low_byte((flags & 15) | (flags & 0x30) << 2 |
                                                        (record[kFlags] & 0x30u)));
                   return flags != previous;
                 });
  }
  void code_intensity(Record records, std::size_t count) {
    for_each(records, count, kIntensityLayer,
             [this](Coder& coder, const Point& point, Record record) TERRACE_LAZ_INLINE_LAMBDA {
               Channel14& models = channels_[point.channel];
               if (point.new_channel) begin_intensity(models, point.last);
               std::uint16_t& intensity =
                   models.last_intensity[2u * point.return_kind + (point.time_changed ? 1 : 0)];
               const std::uint16_t previous = intensity;
               intensity = static_cast<std::uint16_t>(models.intensity.code(
                   coder, previous, input_value<Coder, std::uint16_t>(record + kIntensity),
                   point.return_kind));
               put<Coder>(record + kIntensity, intensity);
               return intensity != previous;
             });
  }
  void code_scan_angle(Record records, std::size_t count) {
    for_each(
        records, count, kScanAngleLayer,
        [this](Coder& coder, const Point& point, Record record) TERRACE_LAZ_INLINE_LAMBDA {
          auto angle = load<std::uint16_t>(point.last + kScanAngle);
          if (point.angle_changed) {
            angle = static_cast<std::uint16_t>(channels_[point.channel].scan_angle.code(
                coder, load<std::int16_t>(point.last + kScanAngle),
                input_value<Coder, std::int16_t>(record + kScanAngle), point.time_changed ? 1 : 0));
          }
          put<Coder>(record + kScanAngle, angle);
          return point.angle_changed;
        });
  }
  void code_user_data(Record records, std::size_t count) {
    for_each(records, count, kUserDataLayer,
             [this](Coder& coder, const Point& point, Record record) TERRACE_LAZ_INLINE_LAMBDA {
               const std::uint8_t previous = point.last[kUserData];
               const unsigned value =
                   coder.symbol(channels_[point.channel].user_data[previous >> 2],
                                input_value<Coder, std::uint8_t>(record + kUserData));
               put<Coder>(record + kUserData, low_byte(value));
               return value != previous;
             });
  }
  void code_source(Record records, std::size_t count) {
    for_each(records, count, kSourceLayer,
             [this](Coder& coder, const Point& point, Record record) TERRACE_LAZ_INLINE_LAMBDA {
               auto source = load<std::uint16_t>(point.last + kSource);
               if (point.source_changed) {
                 source = static_cast<std::uint16_t>(channels_[point.channel].source.code(
                     coder, source, input_value<Coder, std::uint16_t>(record + kSource), 0));
               }
               put<Coder>(record + kSource, source);
               return point.source_changed;
             });
  }
  void code_time(Record records, std::size_t count) {
    for_each(records, count, kTimeLayer,
             [this](Coder& coder, const Point& point, Record record) TERRACE_LAZ_INLINE_LAMBDA {
               GpsTime<true>& models = channels_[point.channel].time;
               if (point.new_channel) models.begin(load<std::uint64_t>(point.last + kTime));
               auto time = load<std::uint64_t>(point.last + kTime);
               if (point.time_changed) {
                 time = models.code(coder, input_value<Coder, std::uint64_t>(record + kTime));
               }
               put<Coder>(record + kTime, time);
               return point.time_changed;
             });
  }

  void code_rgb(Record records, std::size_t count, std::size_t layer) {
    for_each(records, count, layer,
             [this](Coder& coder, const Point& point, Record record) TERRACE_LAZ_INLINE_LAMBDA {
               Channel14& models = channels_[point.item_models];
               models.last_rgb = channels_[point.item_origin].last_rgb;
               Rgb::Value& last = channels_[point.item_last].last_rgb;
               const Rgb::Value value = models.rgb.code(
                   coder, last, input_value<Coder, Rgb::Value>(record + layout_.rgb));
               put<Coder>(record + layout_.rgb, value);
               const bool changed = value != last;
               last = value;
               return changed;
             });
  }
  void code_nir(Record records, std::size_t count, std::size_t layer) {
    for_each(records, count, layer,
             [this](Coder& coder, const Point& point, Record record) TERRACE_LAZ_INLINE_LAMBDA {
               Channel14& models = channels_[point.item_models];
               models.last_nir = channels_[point.item_origin].last_nir;
               std::uint16_t& last = channels_[point.item_last].last_nir;
               const unsigned previous = last,
                              value = input_value<Coder, std::uint16_t>(record + layout_.nir);
               const unsigned differs = previous ^ value;
               unsigned mask = ((differs & 0xff) != 0 ? 1u : 0u) | (differs > 0xff ? 2u : 0u);
               mask = coder.symbol(models.nir_changed, mask);
               unsigned low = previous, high = previous >> 8;
               if ((mask & 1) != 0) low += coder.symbol(models.nir[0], low_byte(value - previous));
               if ((mask & 2) != 0) {
                 high += coder.symbol(models.nir[1], low_byte((value >> 8) - high));
               }
               last = static_cast<std::uint16_t>(low_byte(low) | low_byte(high) << 8);
               put<Coder>(record + layout_.nir, last);
               return mask != 0;
             });
  }
  void code_wave_packet(Record records, std::size_t count, std::size_t layer) {
    for_each(records, count, layer,
             [this](Coder& coder, const Point& point, Record record) TERRACE_LAZ_INLINE_LAMBDA {
               Channel14& models = channels_[point.item_models];
               if (point.item_origin != point.item_models) {
                 models.last_wave_packet = channels_[point.item_origin].last_wave_packet;
                 models.wave_packet.begin();
               }
               auto& last = channels_[point.item_last].last_wave_packet;
               models.wave_packet.code(coder, last.data(), record + layout_.wave_packet);
               const bool changed =
                   std::memcmp(last.data(), record + layout_.wave_packet, last.size()) != 0;
               std::memcpy(last.data(), record + layout_.wave_packet, last.size());
               return changed;
             });
  }
  void code_extra_byte(Record records, std::size_t count, std::size_t layer, std::size_t index) {
    const std::size_t at = layout_.extra + index;
    for_each(records, count, layer,
             [this, at, index](Coder& coder, const Point& point, Record record)
                 TERRACE_LAZ_INLINE_LAMBDA {
                   last_extra(point.item_models)[index] = last_extra(point.item_origin)[index];
                   std::uint8_t& last = last_extra(point.item_last)[index];
                   const unsigned change = input_value<Coder, std::uint8_t>(record + at) - last;
                   const unsigned coded = coder.symbol(
                       extra_[point.item_models * layout_.extra_bytes + index], low_byte(change));
                   last = low_byte(last + coded);
                   put<Coder>(record + at, last);
                   return coded != 0;
                 });
  }

  RecordLayout layout_;
  Zeroed<Channel14> channels_;
  Zeroed<SymbolModel<256>> extra_;        ///< by channel and byte
  std::vector<std::uint8_t> last_extra_;  ///< likewise
  std::vector<std::uint8_t> last_;        ///< the last record by channel, kept between calls
  std::array<const std::uint8_t*, kChannels> predecessors_{};  ///< the last record of each
  std::array<bool, kChannels> known_{}, item_known_{};
  unsigned current_ = 0, item_current_ = 0;
  std::array<Point, 256> run_{};
};

}  // namespace terrace::stream::laz
