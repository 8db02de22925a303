// SPDX-License-Identifier: Apache-2.0
#include "format/las/record_encoder.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include <fmt/core.h>

#include "format/geotiff/keys.hpp"
#include "format/geotiff/tags.hpp"
#include "format/las/header.hpp"
#include "format/las/layout.hpp"
#include "io/bytes.hpp"
#include "io/number.hpp"
#include "terrace/stream/error.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

std::string text_of(double value) {
  std::string text;
  append_number(text, value);
  return text;
}

void append_text_field(std::string& out, std::string_view text, std::size_t bytes) {
  out.append(text.substr(0, bytes));
  out.append(bytes - std::min(bytes, text.size()), '\0');
}

/// True if the value fits into the bits of the field.
template <class Value>
bool fits(Value value, const LasField& field) {
  if constexpr (std::is_floating_point_v<Value>) {
    return true;
  } else {
    return field.bits == 0 || (value >= 0 && static_cast<std::uint64_t>(value) >> field.bits == 0);
  }
}

}  // namespace

void LasSums::include(const LasSums& other) {
  points += other.points;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lowest[axis] = std::min(lowest[axis], other.lowest[axis]);
    highest[axis] = std::max(highest[axis], other.highest[axis]);
  }
  for (std::size_t i = 0; i < kReturns; ++i) returns[i] += other.returns[i];
  rounding = std::max(rounding, other.rounding);
}

/// Encoded records and their summary.
struct LasRecords::Records final : PointWriter::Encoded {
  std::uint64_t first = 0;  ///< number of the first point, for messages
  std::string bytes;
  LasSums sums;
  /// Points that take() must pack: those that came before the lattice was known, and those with a
  /// fault, whose message needs the number of the point.
  std::optional<PointBlock> unpacked;
};

LasRecords::LasRecords(const std::string& path, const PointHeader& header, LasFormats formats)
    : path_(path),
      attributes_(header.attributes),
      layout_(las_layout(header.attributes, path, formats)),
      crs_(header.crs ? header.crs() : Crs{}),
      bounds_(header.bounds),
      has_lattice_(header.lattice.has_value()),
      lattice_(header.lattice.value_or(Lattice{})) {
  for (const Channel& channel : attributes_) payload_bytes_ += size_of(channel.type);
  // A raster's rows or columns may run against an axis, but negative steps are unusual in files.
  for (double& step : lattice_.scale) step = std::abs(step);
}

LasRecords::~LasRecords() = default;

PointWriter::EncodedPtr LasRecords::encode(const PointBlock& block) const {
  auto out = spares_.take();
  out->first = 0;
  out->unpacked.reset();
  bool packed = false;
  if (has_lattice_) {
    try {
      pack(block, *out);
      packed = true;
    } catch (const Error&) {
    }
  }
  if (!packed) out->unpacked = block;
  return out;
}

std::string_view LasRecords::take(PointWriter::EncodedPtr points) {
  if (current_ != nullptr) spares_.put(std::move(current_));
  current_.reset(static_cast<Records*>(points.release()));
  Records& records = *current_;
  if (records.unpacked) {
    if (!has_lattice_) {
      lattice_ = decimal_lattice(records.unpacked->positions, bounds_, crs_.geographic);
      has_lattice_ = true;
    }
    records.first = sums_.points;
    pack(*records.unpacked, records);
  }
  sums_.include(records.sums);
  return records.bytes;
}

void LasRecords::pack(const PointBlock& block, Records& out) const {
  assert(block.payload.size() == block.size() * payload_bytes_);
  out.bytes.assign(block.size() * layout_.record_bytes, '\0');
  out.sums = {};
  out.sums.points = block.size();
  for (std::size_t axis = 0; axis < 3; ++axis) put_coordinate(block, axis, out);
  bool has_return = false, has_returns = false;
  const std::byte* values = block.payload.data();
  for (std::size_t i = 0; i < attributes_.size(); ++i) {
    put_attribute(values, attributes_[i], layout_.fields[i], out);
    has_return = has_return || layout_.fields[i].channel.name == "return_number";
    has_returns = has_returns || layout_.fields[i].channel.name == "number_of_returns";
    values += size_of(attributes_[i].type);
  }
  if (!has_return && !has_returns) set_single_returns(out.bytes);
  count_returns(out);
}

void LasRecords::put_coordinate(const PointBlock& block, std::size_t axis, Records& out) const {
  const double scale = lattice_.scale[axis], offset = lattice_.offset[axis];
  constexpr double kMin = std::numeric_limits<std::int32_t>::min(),
                   kMax = std::numeric_limits<std::int32_t>::max();
  // Adding and subtracting it rounds numbers below 2^51 to the nearest integer, ties to even.
  constexpr double kToInteger = 0x1.8p52;
  std::int32_t lowest = INT32_MAX, highest = INT32_MIN;
  double rounding = 0;
  char* target = out.bytes.data() + 4 * axis;
  for (std::size_t i = 0; i < block.size(); ++i, target += layout_.record_bytes) {
    const double value = block.positions[i][axis];
    const double step = ((value - offset) / scale + kToInteger) - kToInteger;
    if (!(step >= kMin && step <= kMax)) {
      throw Error(path_, fmt::format("its {} is out of range for 32 bits in steps of {}",
                                     "xyz"[axis], text_of(scale)))
          .at(fmt::format("point {}", out.first + i))
          .remedy("write PLY, or build a store and write its points, whose bounds are known");
    }
    const auto stored = static_cast<std::int32_t>(step);
    std::memcpy(target, &stored, sizeof stored);
    const double read = step * scale + offset;
    const double error = std::abs(read - value);
    if (error > 0x1p-50 * (std::abs(value) + std::abs(offset))) {
      rounding = std::max(rounding, error);
    }
    lowest = std::min(lowest, stored);
    highest = std::max(highest, stored);
  }
  out.sums.lowest[axis] = lowest;
  out.sums.highest[axis] = highest;
  out.sums.rounding = std::max(out.sums.rounding, rounding);
}

void LasRecords::put_attribute(const std::byte* values, const Channel& channel,
                               const LasField& field, Records& out) const {
  const auto count = static_cast<std::size_t>(out.sums.points);
  char* const target = out.bytes.data() + field.offset;
  const bool same = channel.type == field.channel.type && channel.scale == field.channel.scale &&
                    channel.offset == field.channel.offset;
  if (same && field.bits == 0) {
    with_type(channel.type, [&](auto value) {
      for (std::size_t i = 0; i < count; ++i) {
        std::memcpy(&value, values + i * payload_bytes_, sizeof value);
        std::memcpy(target + i * layout_.record_bytes, &value, sizeof value);
      }
    });
    return;
  }
  with_type(field.channel.type, [&](auto value) {
    using Value = decltype(value);
    // A rank represents all angles that round to it.
    const double exact = channel.name == "scan_angle_rank" ? 0.5 : 1e-6;
    for (std::size_t i = 0; i < count; ++i) {
      if (same) std::memcpy(&value, values + i * payload_bytes_, sizeof value);
      if (!same || !fits(value, field)) {
        value = convert<Value>(values + i * payload_bytes_, channel, field, exact, out.first + i);
      }
      char* const at = target + i * layout_.record_bytes;
      if (field.bits == 0) {
        std::memcpy(at, &value, sizeof value);
      } else {
        *at = static_cast<char>(static_cast<unsigned char>(*at) |
                                (static_cast<unsigned>(value) << field.shift));
      }
    }
  });
}

/// Converts a value to the type of the field. exact: the tolerance, in steps of the field.
template <class Value>
Value LasRecords::convert(const std::byte* values, const Channel& channel, const LasField& field,
                          double exact, std::uint64_t point) const {
  const double scaled = to_double(channel.type, values) * channel.scale + channel.offset;
  if constexpr (std::is_floating_point_v<Value>) {
    return static_cast<Value>(scaled);
  } else {
    const double step = (scaled - field.channel.offset) / field.channel.scale;
    const double rounded = std::nearbyint(step);
    const double max_value = field.bits == 0
                                 ? static_cast<double>(std::numeric_limits<Value>::max())
                                 : static_cast<double>((1U << field.bits) - 1);
    if (!(rounded >= static_cast<double>(std::numeric_limits<Value>::min()) &&
          rounded <= max_value && std::abs(step - rounded) <= exact)) {
      throw Error(path_, fmt::format("{} does not fit into the field {} of LAS", text_of(scaled),
                                     field.channel.name))
          .at(fmt::format("point {}", point))
          .remedy("rename the column, so that it becomes extra bytes");
    }
    return static_cast<Value>(rounded);
  }
}

/// Makes every point the only return of its pulse, for points without attributes for returns.
void LasRecords::set_single_returns(std::string& records) const {
  for (std::size_t at = 14; at < records.size(); at += layout_.record_bytes) {
    records[at] = legacy() ? '\x09' : '\x11';
  }
}

void LasRecords::count_returns(Records& out) const {
  const unsigned mask = legacy() ? 7U : 15U;
  for (std::size_t at = 14; at < out.bytes.size(); at += layout_.record_bytes) {
    const unsigned number = static_cast<unsigned char>(out.bytes[at]) & mask;
    if (number > 0) ++out.sums.returns[number - 1];
  }
}

std::string las_header_text(const LasRecords& records, const LasFile& file) {
  bool adjusted_time = false;
  for (const Channel& channel : records.attributes()) {
    adjusted_time =
        adjusted_time || (channel.name == "gps_time" && channel.unit == kAdjustedGpsTime);
  }
  const Lattice& lattice = records.lattice();
  const LasSums& sums = records.sums();
  std::string out = "LASF";
  append_little_endian(out, std::uint16_t{0});
  append_little_endian(out,
                       static_cast<std::uint16_t>((adjusted_time ? 1U : 0U) |
                                                  (file.has_wkt || !records.legacy() ? 16U : 0U)));
  append_text_field(out, {}, 16);  // GUID
  out += "\x01\x04";
  append_text_field(out, "EXTRACTION", 32);
  append_text_field(out, "terrace", 32);
  append_text_field(out, {}, 4);  // the date, which would make files differ
  append_little_endian(out, static_cast<std::uint16_t>(kLas14HeaderBytes));
  append_little_endian(out, static_cast<std::uint32_t>(file.points_offset));
  append_little_endian(out, file.vlrs);
  out += static_cast<char>(records.layout().point_format | (file.compressed ? 0x80U : 0U));
  append_little_endian(out, static_cast<std::uint16_t>(records.layout().record_bytes));
  // Programs older than LAS 1.4 read these fields for the old point formats.
  const bool old = records.legacy() && sums.points <= std::numeric_limits<std::uint32_t>::max();
  append_little_endian(out, static_cast<std::uint32_t>(old ? sums.points : 0));
  for (std::size_t i = 0; i < 5; ++i) {
    append_little_endian(out, static_cast<std::uint32_t>(old ? sums.returns[i] : 0));
  }
  for (const double scale : lattice.scale) append_little_endian(out, scale);
  for (const double offset : lattice.offset) append_little_endian(out, offset);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const std::int32_t bound : {sums.highest[axis], sums.lowest[axis]}) {
      append_little_endian(
          out, sums.points == 0 ? 0.0 : bound * lattice.scale[axis] + lattice.offset[axis]);
    }
  }
  append_little_endian(out, std::uint64_t{0});  // waveforms
  append_little_endian(out, file.evlr_offset);
  append_little_endian(out, file.evlrs);
  append_little_endian(out, sums.points);
  for (const std::uint64_t count : sums.returns) append_little_endian(out, count);
  assert(out.size() == kLas14HeaderBytes);
  return out;
}

void append_vlr(std::string& out, std::string_view user, std::uint16_t id, std::string_view data) {
  append_little_endian(out, std::uint16_t{0});
  append_text_field(out, user, 16);
  append_little_endian(out, id);
  append_little_endian(out, static_cast<std::uint16_t>(data.size()));
  append_text_field(out, {}, 32);
  out.append(data);
}

std::string evlr_head(std::string_view user, std::uint16_t id, std::uint64_t bytes) {
  std::string out;
  append_little_endian(out, std::uint16_t{0});
  append_text_field(out, user, 16);
  append_little_endian(out, id);
  append_little_endian(out, bytes);
  append_text_field(out, {}, 32);
  return out;
}

namespace {

/// Appends the GeoKeys of a CRS without WKT, such as only units. Point formats from 6 on require
/// WKT; readers that insist on it see no CRS, as they would without the keys.
void append_geo_keys(std::string& out, const Crs& crs, LasFile& file) {
  const GeoKeyDirectory keys = keys_of(crs, std::nullopt);
  if (keys.empty()) return;
  const auto append = [&](std::uint32_t id, std::string_view data) {
    append_vlr(out, kLasProjection, static_cast<std::uint16_t>(id), data);
    ++file.vlrs;
  };
  std::string shorts, doubles;
  for (const std::uint16_t value : keys.shorts()) append_little_endian(shorts, value);
  for (const double value : keys.doubles()) append_little_endian(doubles, value);
  append(kGeoKeyDirectory, shorts);
  if (!doubles.empty()) append(kGeoDoubleParams, doubles);
  if (!keys.ascii().empty()) append(kGeoAsciiParams, keys.ascii());
}

}  // namespace

void append_vlrs(std::string& out, const Crs& crs, const LasLayout& layout, const std::string& path,
                 LasFile& file) {
  if (!crs.wkt.empty()) {
    const std::string wkt = crs.wkt + '\0';
    if (wkt.size() > std::numeric_limits<std::uint16_t>::max()) {
      throw Error(path, "the WKT of its coordinate reference system is too long for LAS")
          .remedy("write PLY");
    }
    append_vlr(out, kLasProjection, kLasWkt, wkt);
    ++file.vlrs;
    file.has_wkt = true;
  } else {
    append_geo_keys(out, crs, file);
  }
  if (!layout.extra_bytes.empty()) {
    append_vlr(out, kLasSpec, kLasExtraBytes, layout.extra_bytes);
    ++file.vlrs;
  }
}

}  // namespace terrace::stream
