// SPDX-License-Identifier: Apache-2.0
#include "format/las/fields.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "io/bytes.hpp"
#include "io/distinct_names.hpp"
#include "io/number.hpp"

namespace terrace::stream {
namespace {

constexpr std::array<std::size_t, kLastLasPointFormat + 1> kRecordBytes{20, 28, 26, 34, 57, 63,
                                                                        30, 36, 38, 59, 67};

/// Collects consecutive fields.
struct FieldList {
  std::vector<LasField> fields{};
  std::size_t offset = 12;  ///< of the next field: first after the coordinates

  void add(Channel channel) {
    const std::size_t bytes = size_of(channel.type);
    fields.push_back({.channel = std::move(channel), .offset = offset});
    offset += bytes;
  }
  void add(const char* name, ScalarType type) { add(Channel{.name = name, .type = type}); }
  /// Adds the parts of the next byte, beginning at its lowest bit.
  void add_bits(std::initializer_list<std::pair<const char*, unsigned>> parts) {
    unsigned shift = 0;
    for (const auto& [name, bits] : parts) {
      fields.push_back({.channel = {.name = name, .type = ScalarType::u8},
                        .offset = offset,
                        .shift = shift,
                        .bits = bits});
      shift += bits;
    }
    ++offset;
  }
};

/// The types in the specification's table of extra bytes, which counts from 1.
constexpr std::array kExtraTypes{ScalarType::u8,  ScalarType::i8,  ScalarType::u16, ScalarType::i16,
                                 ScalarType::u32, ScalarType::i32, ScalarType::u64, ScalarType::i64,
                                 ScalarType::f32, ScalarType::f64};

/// Returns the text up to a NUL, with control characters replaced so that headers can contain it.
std::string plain_text(std::string_view text) {
  std::string out(text.substr(0, text.find('\0')));
  for (char& c : out) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '_';
  }
  return out;
}

/// A description of extra bytes: a row of the VLR.
class ExtraBytes {
 public:
  explicit ExtraBytes(const char* row) : row_(row) {
    const std::size_t type = static_cast<unsigned char>(row[2]);
    options_ = static_cast<unsigned char>(row[3]);
    name_ = plain_text({row + 4, 32});
    // Types above 10 are the deprecated arrays of two or three; type 0 is undocumented bytes.
    undocumented_ = type == 0 || type > 3 * kExtraTypes.size();
    count_ = undocumented_ ? options_ : 1 + (type - 1) / kExtraTypes.size();
    if (!undocumented_) type_ = kExtraTypes[(type - 1) % kExtraTypes.size()];
  }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::size_t bytes() const { return count_ * size_of(type_); }

  /// Returns the i-th of count() channels.
  [[nodiscard]] Channel channel(std::size_t i, std::vector<std::string>& comments) const {
    Channel channel{.name = undocumented_ || count_ > 1 ? fmt::format("{}_{}", name_, i) : name_,
                    .type = type_};
    if (has(kScale)) channel.scale = load_little_endian<double>(row_ + 112 + 8 * i);
    if (has(kOffset)) channel.offset = load_little_endian<double>(row_ + 136 + 8 * i);
    if (!std::isfinite(channel.scale) || channel.scale == 0 || !std::isfinite(channel.offset)) {
      comments.push_back("extra bytes " + name_ + ": an impossible scale or offset is ignored");
      channel.scale = 1.0;
      channel.offset = 0.0;
    }
    if (has(kNodata)) {
      comments.push_back(fmt::format("extra bytes {}: {} means no data", name_, nodata(i)));
    }
    return channel;
  }

 private:
  enum Option : unsigned { kNodata = 1, kScale = 8, kOffset = 16 };

  /// Undocumented bytes have a count in place of options.
  [[nodiscard]] bool has(Option option) const { return !undocumented_ && (options_ & option) != 0; }

  /// The value is widened to eight bytes, as an integer of the same signedness or a double.
  [[nodiscard]] std::string nodata(std::size_t i) const {
    std::string value;
    const char* const at = row_ + 40 + 8 * i;
    if (type_ == ScalarType::f32 || type_ == ScalarType::f64) {
      append_number(value, load_little_endian<double>(at));
    } else if (type_ == ScalarType::u64) {
      append_number(value, load_little_endian<std::uint64_t>(at));
    } else {
      append_number(value, load_little_endian<std::int64_t>(at));
    }
    return value;
  }

  const char* row_;
  std::string name_;
  unsigned options_ = 0;
  bool undocumented_ = false;
  std::size_t count_ = 0;
  ScalarType type_ = ScalarType::u8;
};

}  // namespace

std::size_t las_record_bytes(unsigned point_format) { return kRecordBytes[point_format]; }

std::vector<LasField> las_fields(unsigned point_format, bool adjusted_time) {
  const unsigned f = point_format;
  const bool legacy = f < 6;
  FieldList list;
  list.add("intensity", ScalarType::u16);
  if (legacy) {
    list.add_bits({{"return_number", 3},
                   {"number_of_returns", 3},
                   {"scan_direction_flag", 1},
                   {"edge_of_flight_line", 1}});
    list.add_bits({{"classification", 5}, {"synthetic", 1}, {"key_point", 1}, {"withheld", 1}});
    list.add(Channel{.name = "scan_angle_rank", .type = ScalarType::i8, .unit = "degree"});
    list.add("user_data", ScalarType::u8);
  } else {
    list.add_bits({{"return_number", 4}, {"number_of_returns", 4}});
    list.add_bits({{"synthetic", 1},
                   {"key_point", 1},
                   {"withheld", 1},
                   {"overlap", 1},
                   {"scanner_channel", 2},
                   {"scan_direction_flag", 1},
                   {"edge_of_flight_line", 1}});
    list.add("classification", ScalarType::u8);
    list.add("user_data", ScalarType::u8);
    list.add(
        Channel{.name = "scan_angle", .type = ScalarType::i16, .scale = 0.006, .unit = "degree"});
  }
  list.add("point_source_id", ScalarType::u16);
  if (f != 0 && f != 2) {
    list.add(Channel{.name = "gps_time",
                     .type = ScalarType::f64,
                     .unit = adjusted_time ? kAdjustedGpsTime : kGpsWeekTime});
  }
  if (f == 2 || f == 3 || f == 5 || f == 7 || f == 8 || f == 10) {
    for (const char* name : {"red", "green", "blue"}) list.add(name, ScalarType::u16);
  }
  if (f == 8 || f == 10) list.add("nir", ScalarType::u16);
  if (f == 4 || f == 5 || f == 9 || f == 10) {
    list.add("wavepacket_index", ScalarType::u8);
    list.add("wavepacket_offset", ScalarType::u64);
    list.add("wavepacket_size", ScalarType::u32);
    for (const char* name : {"return_point_wave_location", "x_t", "y_t", "z_t"}) {
      list.add(name, ScalarType::f32);
    }
  }
  return list.fields;
}

std::vector<LasField> las_extra_fields(const std::string& descriptions, std::size_t first,
                                       std::size_t record_bytes,
                                       std::span<const LasField> other_fields,
                                       std::vector<std::string>& comments) {
  FieldList list{.fields = {}, .offset = first};
  DistinctNames distinct;
  for (const LasField& field : other_fields) distinct.add(field.channel.name);
  const auto add = [&](Channel channel) {
    channel.name = distinct.add(channel.name.empty() ? "extra" : channel.name);
    list.add(std::move(channel));
  };
  for (std::size_t at = 0; at + kLasExtraBytesDescription <= descriptions.size();
       at += kLasExtraBytesDescription) {
    const ExtraBytes extra(descriptions.data() + at);
    if (extra.bytes() > record_bytes - list.offset) {
      comments.push_back("extra bytes " + extra.name() + " do not fit into the records");
      break;
    }
    for (std::size_t i = 0; i < extra.count(); ++i) add(extra.channel(i, comments));
  }
  const std::size_t undescribed = record_bytes - list.offset;
  for (std::size_t i = 0; i < undescribed; ++i) {
    add({.name = fmt::format("extra_{}", i), .type = ScalarType::u8});
  }
  return list.fields;
}

}  // namespace terrace::stream
