// SPDX-License-Identifier: Apache-2.0
#include "format/record_source.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "format/common_placement.hpp"
#include "format/packed_column.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

bool is_wide_integer(ScalarType type) { return type == ScalarType::i64 || type == ScalarType::u64; }

/// Copies fields of records to payloads. Fields that are adjacent in both are copied together,
/// because a pass over the records costs the same however few bytes it copies.
class PayloadUnpacker {
 public:
  PayloadUnpacker(std::span<const LasField> fields, std::size_t payload_bytes)
      : payload_bytes_(payload_bytes) {
    std::size_t target = 0;
    for (std::size_t i = 0; i < fields.size();) {
      if (fields[i].bits > 0) {
        add_bits(fields, i, target);
      } else {
        add_values(fields, i, target);
      }
    }
  }

  void unpack(std::string_view rows, std::size_t stride, std::byte* payload) const {
    PackedColumn column{.rows = nullptr,
                        .stride = stride,
                        .count = rows.size() / stride,
                        .type = ScalarType::u8,
                        .swap = kForeign};
    for (const Values& values : values_) {
      column.rows = rows.data() + values.offset;
      column.type = values.type;
      decode_values(column, payload + values.target, payload_bytes_);
    }
    for (const Bits& bits : bits_) {
      column.rows = rows.data() + bits.offset;
      bits.unpack(column, bits.parts, payload + bits.target, payload_bytes_);
    }
  }

 private:
  static constexpr bool kForeign = std::endian::native == std::endian::big;
  using Parts = std::array<std::byte, 8>;
  using PartsOfBytes = std::array<Parts, 256>;
  struct Values {
    std::size_t offset = 0, target = 0;
    ScalarType type = ScalarType::u8;
  };
  struct Bits {
    std::size_t offset = 0, target = 0;
    void (*unpack)(const PackedColumn& bytes, const PartsOfBytes& parts, std::byte* target,
                   std::size_t target_stride) = nullptr;
    PartsOfBytes parts{};
  };

  /// Adds consecutive fields as few wide numbers, of which the last two may overlap.
  void add_values(std::span<const LasField> fields, std::size_t& i, std::size_t& target) {
    const std::size_t first = i, offset = fields[i].offset;
    std::size_t bytes = 0;
    do {
      bytes += size_of(fields[i++].channel.type);
    } while (!kForeign && i < fields.size() && fields[i].bits == 0 &&
             fields[i].offset == offset + bytes);
    if (kForeign) {
      values_.push_back({offset, target, fields[first].channel.type});
    } else {
      const ScalarType type = bytes >= 8   ? ScalarType::u64
                              : bytes >= 4 ? ScalarType::u32
                              : bytes >= 2 ? ScalarType::u16
                                           : ScalarType::u8;
      const std::size_t width = size_of(type);
      for (std::size_t at = 0; at < bytes; at += width) {
        const std::size_t begin = std::min(at, bytes - width);
        values_.push_back({offset + begin, target + begin, type});
      }
    }
    target += bytes;
  }

  /// Adds fields that are bits of one byte.
  void add_bits(std::span<const LasField> fields, std::size_t& i, std::size_t& target) {
    constexpr std::array<decltype(Bits::unpack), 9> kUnpack{
        nullptr,         &unpack_bits<1>, &unpack_bits<2>, &unpack_bits<3>, &unpack_bits<4>,
        &unpack_bits<5>, &unpack_bits<6>, &unpack_bits<7>, &unpack_bits<8>};
    Bits& bits = bits_.emplace_back();
    bits.offset = fields[i].offset;
    bits.target = target;
    std::size_t count = 0;
    for (; i < fields.size() && fields[i].bits > 0 && fields[i].offset == bits.offset &&
           count < bits.parts[0].size();
         ++i, ++count) {
      const unsigned mask = (1U << fields[i].bits) - 1;
      for (unsigned byte = 0; byte < 256; ++byte) {
        bits.parts[byte][count] = static_cast<std::byte>((byte >> fields[i].shift) & mask);
      }
    }
    bits.unpack = kUnpack[count];
    target += count;
  }
  template <std::size_t kCount>
  static void unpack_bits(const PackedColumn& bytes, const PartsOfBytes& parts, std::byte* target,
                          std::size_t target_stride) {
    const char* at = bytes.rows;
    for (std::size_t i = 0; i < bytes.count; ++i, at += bytes.stride, target += target_stride) {
      std::memcpy(target, parts[static_cast<unsigned char>(*at)].data(), kCount);
    }
  }

  std::size_t payload_bytes_;
  std::vector<Values> values_;
  std::vector<Bits> bits_;
};

/// Unpacks records into blocks of points.
class RecordSource final : public PointSource {
 public:
  RecordSource(RecordStream stream, std::size_t block_points, const Placement* placement)
      : stream_(std::move(stream)),
        block_points_(block_points),
        payload_bytes_(stream_.info.payload_size()),
        payload_(stream_.fields, payload_bytes_),
        selected_points_(*stream_.info.points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ScalarType& type = stream_.info.coordinates[axis].type;
      types_[axis] = type;
      needs_check_ = needs_check_ || size_of(type) == 8 || type == ScalarType::f32;
      check_reach(axis);
      // Coordinates are doubles in memory; check() refuses integers that these cannot hold.
      if (is_wide_integer(type)) type = ScalarType::f64;
    }
    if (placement != nullptr) move_to(*placement);
    for (std::size_t i = 0; i < stream_.fields.size(); ++i) {
      const Channel& channel = stream_.fields[i].channel;
      if (channel.name == "withheld" && channel.type == ScalarType::u8) withheld_attribute_ = i;
    }
  }

  const SourceInfo& info() const override { return stream_.info; }

  bool next(PointBlock& block) override {
    const auto max_records = static_cast<std::size_t>(std::min<std::uint64_t>(
        block_points_, selected_points_ - delivered_ - stream_.records->lost()));
    block.positions.resize(max_records);
    block.payload.resize(max_records * payload_bytes_);
    std::size_t count = 0;
    for (std::size_t unpacked = 1; count < max_records && unpacked > 0; count += unpacked) {
      unpacked = unpack(block, count, max_records - count);
    }
    block.positions.resize(count);
    block.payload.resize(count * payload_bytes_);
    if (withheld_attribute_) count_withheld(block);
    if (needs_check_) check(block);
    if (move_) move(block);
    delivered_ += count;
    return count > 0;
  }

  Progress progress() const override {
    return {.points = delivered_,
            .nodata = 0,
            .withheld = withheld_,
            .excluded = stream_.points - selected_points_,
            .lost = stream_.records->lost(),
            .fraction = selected_points_ == 0
                            ? 1.0
                            : static_cast<double>(delivered_ + stream_.records->lost()) /
                                  static_cast<double>(selected_points_)};
  }

  std::uint64_t reading_bytes() const override { return stream_.records->held_bytes(); }

 private:
  [[nodiscard]] std::string file() const {
    return stream_.input ? stream_.input->name() : stream_.info.files.front();
  }
  [[nodiscard]] Error fault(std::size_t point, std::string cause) const {
    return Error(file(), std::move(cause)).at(fmt::format("point {}", delivered_ + point));
  }

  /// Unpacks some of the next `max_records` records to the points from `first` on; returns how
  /// many.
  std::size_t unpack(PointBlock& block, std::size_t first, std::size_t max_records) {
    const std::string_view rows = stream_.records->read(max_records);
    if (rows.empty()) return 0;
    const std::size_t stride = stream_.record_bytes, count = rows.size() / stride;
    PackedColumn column{.rows = nullptr,
                        .stride = stride,
                        .count = count,
                        .type = ScalarType::i32,
                        .swap = std::endian::native == std::endian::big};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      column.rows = rows.data() + stream_.coordinate_offsets[axis];
      column.type = types_[axis];
      decode_coordinate(column, block.positions.data() + first, axis);
    }
    payload_.unpack(rows, stride, block.payload.data() + first * payload_bytes_);
    return count;
  }

  void count_withheld(const PointBlock& block) {
    const auto marks = stream_.info.view<std::uint8_t>(block.payload, *withheld_attribute_);
    for (std::size_t i = 0; i < marks.size(); ++i) withheld_ += marks[i] != 0 ? 1 : 0;
  }

  /// Returns the scale and offset from stored coordinates to the CRS.
  [[nodiscard]] std::array<double, 2> scale_and_offset(std::size_t axis) const {
    const std::array<double, 6>& xy = stream_.info.world.xy;
    const Channel& z = stream_.info.coordinates[2];
    return axis == 0   ? std::array{xy[0], xy[2]}
           : axis == 1 ? std::array{xy[4], xy[5]}
                       : std::array{z.scale, z.offset};
  }

  /// Throws: Error if some integer of the type gives a coordinate that is not finite.
  void check_reach(std::size_t axis) const {
    const ScalarType type = types_[axis];
    if (type == ScalarType::f32 || type == ScalarType::f64) return;
    const auto [scale, offset] = scale_and_offset(axis);
    if (std::isfinite(std::ldexp(std::abs(scale), 8 * static_cast<int>(size_of(type))) +
                      std::abs(offset))) {
      return;
    }
    throw Error(file(),
                fmt::format("the scale and the offset of {} give coordinates that are not finite",
                            "xyz"[axis]))
        .at("header")
        .remedy("the header is wrong: export the file again");
  }

  void check(const PointBlock& block) const {
    for (std::size_t i = 0; i < block.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double value = block.positions[i][axis];
        const double limit =
            is_wide_integer(types_[axis]) ? 0x1p53 : std::numeric_limits<double>::max();
        const auto [scale, offset] = scale_and_offset(axis);
        if (!(std::abs(value) <= limit) || !std::isfinite(value * scale + offset)) {
          throw fault(i,
                      fmt::format("its {} is not a number that can be kept exactly", "xyz"[axis]))
              .remedy("the file is damaged: download it again");
        }
      }
    }
  }

  void move_to(const Placement& placement) {
    SourceInfo& info = stream_.info;
    if (info.world == placement.world && info.coordinates == placement.coordinates) return;
    try {
      move_ = move_between(info, placement);
    } catch (const std::domain_error& axis) {
      throw Error(file(), fmt::format("{} is not on the lattice of the other files: its scale or "
                                      "the fraction of its offset differs",
                                      axis.what()))
          .remedy("name files instead of pipes, or read it separately");
    }
    info.world = placement.world;
    info.coordinates = placement.coordinates;
    if (placement.coordinates[0].type == ScalarType::f64) {
      info.note =
          "the files' coordinate steps have no common 32-bit lattice: coordinates are kept as "
          "doubles";
    }
    if (!info.stated_bounds) return;
    Box3 box;
    box.include(move_point(info.stated_bounds->min));
    box.include(move_point(info.stated_bounds->max));
    info.stated_bounds = box;
  }
  [[nodiscard]] Point3 move_point(const Point3& stored) const {
    Point3 point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      point[axis] = stored[axis] * move_->factor[axis] + move_->shift[axis];
    }
    return point;
  }
  void move(PointBlock& block) const {
    constexpr double kInt = std::numeric_limits<std::int32_t>::max();
    const double limit = stream_.info.coordinates[0].type == ScalarType::i32
                             ? kInt
                             : std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < block.size(); ++i) {
      Point3& point = block.positions[i];
      point = move_point(point);
      for (const double value : point) {
        if (value < -limit - 1 || value > limit) {
          throw fault(i, "is out of range of the lattice chosen from the headers of all files")
              .remedy(
                  "its header states wrong bounds: export the file again, or read it separately");
        }
      }
    }
  }

  RecordStream stream_;
  std::size_t block_points_, payload_bytes_;
  PayloadUnpacker payload_;
  std::array<ScalarType, 3> types_{};  ///< of the coordinates in the records
  std::optional<Move> move_;           ///< to the placement of all files
  bool needs_check_ = false;           ///< coordinates could be out of range
  std::optional<std::size_t> withheld_attribute_;
  std::uint64_t selected_points_ = 0, delivered_ = 0, withheld_ = 0;
};

}  // namespace

std::unique_ptr<PointSource> source_of_records(RecordStream stream, std::size_t block_points,
                                               const Placement* placement) {
  return std::make_unique<RecordSource>(std::move(stream), block_points, placement);
}

}  // namespace terrace::stream
