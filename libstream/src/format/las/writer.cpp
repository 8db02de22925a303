// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "format/las/header.hpp"
#include "format/las/lattice.hpp"
#include "format/las/layout.hpp"
#include "format/writers.hpp"
#include "io/bytes.hpp"
#include "io/number.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/laz.hpp"
#include "terrace/stream/sink.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kReturns = 15;  ///< that the header counts

std::string text_of(double value) {
  std::string text;
  append_number(text, value);
  return text;
}

void append_text_field(std::string& out, std::string_view text, std::size_t bytes) {
  out.append(text.substr(0, bytes));
  out.append(bytes - std::min(bytes, text.size()), '\0');
}

void append_vlr(std::string& out, std::string_view user, std::uint16_t id, std::string_view data) {
  append_little_endian(out, std::uint16_t{0});
  append_text_field(out, user, 16);
  append_little_endian(out, id);
  append_little_endian(out, static_cast<std::uint16_t>(data.size()));
  append_text_field(out, {}, 32);
  out.append(data);
}

/// The chunks of LAZ, encoded as their points come.
class LazChunks {
 public:
  explicit LazChunks(const laz::Vlr& vlr) : vlr_(vlr), encoder_(vlr) {}

  /// Appends the records, and to `out` the chunks that they fill.
  void append(std::string_view records, std::vector<std::byte>& out) {
    const std::size_t whole = vlr_.chunk_size * vlr_.record_length();
    while (!records.empty()) {
      const std::string_view part = records.substr(0, whole - pending_.size());
      pending_ += part;
      records.remove_prefix(part.size());
      if (pending_.size() == whole) encode(out);
    }
  }
  /// Appends the last chunk and the table, and returns the table's place from the first chunk on.
  std::uint64_t finish(std::vector<std::byte>& out) {
    if (!pending_.empty()) encode(out);
    const std::vector<std::byte> table = laz::write_chunk_table(chunks_, vlr_);
    out.insert(out.end(), table.begin(), table.end());
    return bytes_;
  }

 private:
  void encode(std::vector<std::byte>& out) {
    const std::size_t before = out.size();
    encoder_.encode_chunk(std::as_bytes(std::span(pending_)), out);
    chunks_.push_back({.offset = bytes_,
                       .bytes = out.size() - before,
                       .points = pending_.size() / vlr_.record_length()});
    bytes_ += chunks_.back().bytes;
    pending_.clear();
  }

  laz::Vlr vlr_;
  laz::Encoder encoder_;
  std::vector<laz::Chunk> chunks_;
  std::string pending_;  ///< records of the next chunk
  std::uint64_t bytes_ = 0;
};

class LasWriter final : public PointWriter {
 public:
  LasWriter(const std::string& path, const PointHeader& header, const WriterOptions& options,
            bool compressed)
      : path_(path),
        sink_(path, options.replace, options.stop),
        attributes_(header.attributes),
        layout_(las_layout(header.attributes, path)),
        lattice_(header.lattice),
        bounds_(header.bounds) {
    for (const Channel& channel : attributes_) payload_bytes_ += size_of(channel.type);
    if (lattice_) {
      // Columns of a raster may count against the axis; files with such steps are unusual.
      for (double& step : lattice_->scale) step = std::abs(step);
    }
    std::string vlrs;
    if (!header.crs.wkt.empty()) {
      const std::string wkt = header.crs.wkt + '\0';
      if (wkt.size() > std::numeric_limits<std::uint16_t>::max()) {
        fail({}, "the WKT of its coordinate reference system is too long for LAS", "write PLY");
      }
      append_vlr(vlrs, kLasProjection, kLasWkt, wkt);
      ++vlr_count_;
      has_wkt_ = true;
    }
    if (!layout_.extra_bytes.empty()) {
      append_vlr(vlrs, kLasSpec, kLasExtraBytes, layout_.extra_bytes);
      ++vlr_count_;
    }
    if (compressed) {
      const laz::Vlr vlr = laz::Vlr::of(layout_.point_format, layout_.record_bytes);
      const std::vector<std::byte> data = vlr.serialise();
      append_vlr(vlrs, laz::Vlr::kUserId, laz::Vlr::kRecordId,
                 {reinterpret_cast<const char*>(data.data()), data.size()});
      ++vlr_count_;
      chunks_.emplace(vlr);
    }
    points_offset_ = kLas14HeaderBytes + vlrs.size();
    sink_.write(std::string(kLas14HeaderBytes, '\0') + vlrs);
    if (compressed) sink_.write(std::string(sizeof(std::uint64_t), '\0'));
  }

  void append(const PointBlock& block) override {
    assert(block.payload.size() == block.size() * payload_bytes_);
    if (!lattice_) lattice_ = decimal_lattice(block.positions, bounds_);
    records_.assign(block.size() * layout_.record_bytes, '\0');
    for (std::size_t axis = 0; axis < 3; ++axis) put_coordinate(block, axis);
    bool has_return = false, has_returns = false;
    const std::byte* from = block.payload.data();
    for (std::size_t i = 0; i < attributes_.size(); ++i) {
      put_attribute(from, block.size(), attributes_[i], layout_.fields[i]);
      has_return = has_return || layout_.fields[i].channel.name == "return_number";
      has_returns = has_returns || layout_.fields[i].channel.name == "number_of_returns";
      from += size_of(attributes_[i].type);
    }
    if (!has_return && !has_returns) set_single_returns();
    count_returns();
    if (chunks_) {
      coded_.clear();
      chunks_->append(records_, coded_);
      sink_.write(coded_);
    } else {
      sink_.write(records_);
    }
    points_ += block.size();
  }

  void finish() override {
    if (chunks_) {
      coded_.clear();
      const std::uint64_t first = points_offset_ + sizeof(std::uint64_t);
      std::string position;
      append_little_endian(position, first + chunks_->finish(coded_));
      sink_.write(coded_);
      sink_.write_at(points_offset_, position);
    }
    sink_.write_at(0, header_text());
    sink_.commit();
  }

  std::uint64_t points() const override { return points_; }
  double rounding() const override { return rounding_; }

 private:
  [[noreturn]] void fail(std::string where, std::string cause, std::string remedy) const {
    throw Error({.file = path_,
                 .where = std::move(where),
                 .cause = std::move(cause),
                 .remedy = std::move(remedy)});
  }

  [[nodiscard]] bool legacy() const { return layout_.point_format < 6; }

  void put_coordinate(const PointBlock& block, std::size_t axis) {
    const double scale = lattice_->scale[axis], offset = lattice_->offset[axis];
    constexpr double kLeast = std::numeric_limits<std::int32_t>::min(),
                     kMost = std::numeric_limits<std::int32_t>::max();
    char* to = records_.data() + 4 * axis;
    for (std::size_t i = 0; i < block.size(); ++i, to += layout_.record_bytes) {
      const double value = block.positions[i][axis];
      const double step = std::nearbyint((value - offset) / scale);
      if (!(step >= kLeast && step <= kMost)) {
        fail("point " + std::to_string(points_ + i),
             std::string("its ") + "xyz"[axis] + " is out of reach for 32 bits in steps of " +
                 text_of(scale),
             "write PLY, or fewer points at a time");
      }
      const auto stored = static_cast<std::int32_t>(step);
      std::memcpy(to, &stored, sizeof stored);
      const double read = step * scale + offset;
      const double moved = std::abs(read - value);
      if (moved > 0x1p-50 * (std::abs(value) + std::abs(offset))) {
        rounding_ = std::max(rounding_, moved);
      }
      least_[axis] = std::min(least_[axis], stored);
      most_[axis] = std::max(most_[axis], stored);
    }
  }

  void put_attribute(const std::byte* from, std::size_t count, const Channel& channel,
                     const LasField& field) {
    char* const to = records_.data() + field.offset;
    const bool same = channel.type == field.channel.type && channel.scale == field.channel.scale &&
                      channel.offset == field.channel.offset;
    if (same && field.bits == 0) {
      with_type(channel.type, [&](auto value) {
        for (std::size_t i = 0; i < count; ++i) {
          std::memcpy(&value, from + i * payload_bytes_, sizeof value);
          std::memcpy(to + i * layout_.record_bytes, &value, sizeof value);
        }
      });
      return;
    }
    with_type(field.channel.type, [&](auto value) {
      using Value = decltype(value);
      for (std::size_t i = 0; i < count; ++i) {
        value = converted<Value>(from + i * payload_bytes_, channel, field, points_ + i);
        char* const at = to + i * layout_.record_bytes;
        if (field.bits == 0) {
          std::memcpy(at, &value, sizeof value);
        } else {
          *at = static_cast<char>(static_cast<unsigned char>(*at) |
                                  (static_cast<unsigned>(value) << field.shift));
        }
      }
    });
  }

  /// A value of another type as the field has it.
  template <class Value>
  Value converted(const std::byte* from, const Channel& channel, const LasField& field,
                  std::uint64_t point) const {
    const double real = to_double(channel.type, from) * channel.scale + channel.offset;
    if constexpr (std::is_floating_point_v<Value>) {
      return static_cast<Value>(real);
    } else {
      const double step = (real - field.channel.offset) / field.channel.scale;
      const double whole = std::nearbyint(step);
      const double most = field.bits == 0 ? static_cast<double>(std::numeric_limits<Value>::max())
                                          : static_cast<double>((1U << field.bits) - 1);
      if (!(whole >= static_cast<double>(std::numeric_limits<Value>::min()) && whole <= most &&
            std::abs(step - whole) <= 1e-6)) {
        fail("point " + std::to_string(point),
             text_of(real) + " is no value that the field " + field.channel.name +
                 " of LAS can have",
             "rename the column: it becomes extra bytes then");
      }
      return static_cast<Value>(whole);
    }
  }

  /// What says nothing of returns is the only one.
  void set_single_returns() {
    for (std::size_t at = 14; at < records_.size(); at += layout_.record_bytes) {
      records_[at] = legacy() ? '\x09' : '\x11';
    }
  }

  void count_returns() {
    const unsigned mask = legacy() ? 7U : 15U;
    for (std::size_t at = 14; at < records_.size(); at += layout_.record_bytes) {
      const unsigned number = static_cast<unsigned char>(records_[at]) & mask;
      if (number > 0) ++returns_[number - 1];
    }
  }

  [[nodiscard]] std::string header_text() const {
    bool adjusted_time = false;
    for (const Channel& channel : attributes_) {
      adjusted_time =
          adjusted_time || (channel.name == "gps_time" && channel.unit == kAdjustedGpsTime);
    }
    const Lattice lattice = lattice_.value_or(Lattice{});
    std::string out = "LASF";
    append_little_endian(out, std::uint16_t{0});
    append_little_endian(out, static_cast<std::uint16_t>((adjusted_time ? 1U : 0U) |
                                                         (has_wkt_ || !legacy() ? 16U : 0U)));
    append_text_field(out, {}, 16);  // GUID
    out += "\x01\x04";
    append_text_field(out, "EXTRACTION", 32);
    append_text_field(out, "terrace", 32);
    append_text_field(out, {}, 4);  // the day, which would make files differ
    append_little_endian(out, static_cast<std::uint16_t>(kLas14HeaderBytes));
    append_little_endian(out, static_cast<std::uint32_t>(points_offset_));
    append_little_endian(out, vlr_count_);
    out += static_cast<char>(layout_.point_format | (chunks_ ? 0x80U : 0U));
    append_little_endian(out, static_cast<std::uint16_t>(layout_.record_bytes));
    // Programs older than LAS 1.4 read these of the old point formats.
    const bool old = legacy() && points_ <= std::numeric_limits<std::uint32_t>::max();
    append_little_endian(out, static_cast<std::uint32_t>(old ? points_ : 0));
    for (std::size_t i = 0; i < 5; ++i) {
      append_little_endian(out, static_cast<std::uint32_t>(old ? returns_[i] : 0));
    }
    for (const double scale : lattice.scale) append_little_endian(out, scale);
    for (const double offset : lattice.offset) append_little_endian(out, offset);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const std::int32_t bound : {most_[axis], least_[axis]}) {
        append_little_endian(
            out, points_ == 0 ? 0.0 : bound * lattice.scale[axis] + lattice.offset[axis]);
      }
    }
    append_little_endian(out, std::uint64_t{0});  // waveforms
    append_little_endian(out, std::uint64_t{0});  // EVLRs
    append_little_endian(out, std::uint32_t{0});
    append_little_endian(out, points_);
    for (const std::uint64_t count : returns_) append_little_endian(out, count);
    assert(out.size() == kLas14HeaderBytes);
    return out;
  }

  std::string path_;
  Sink sink_;
  std::vector<Channel> attributes_;
  LasLayout layout_;
  std::optional<Lattice> lattice_;
  std::optional<Box3> bounds_;
  std::size_t payload_bytes_ = 0;
  std::uint32_t vlr_count_ = 0;
  bool has_wkt_ = false;
  std::uint64_t points_offset_ = 0, points_ = 0;
  std::string records_;
  std::optional<LazChunks> chunks_;  ///< of LAZ
  std::vector<std::byte> coded_;
  std::array<std::int32_t, 3> least_{INT32_MAX, INT32_MAX, INT32_MAX},
      most_{INT32_MIN, INT32_MIN, INT32_MIN};
  std::array<std::uint64_t, kReturns> returns_{};
  double rounding_ = 0.0;
};

}  // namespace

std::unique_ptr<PointWriter> open_las_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options) {
  return std::make_unique<LasWriter>(path, header, options, /*compressed=*/false);
}

std::unique_ptr<PointWriter> open_laz_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options) {
  return std::make_unique<LasWriter>(path, header, options, /*compressed=*/true);
}

}  // namespace terrace::stream
