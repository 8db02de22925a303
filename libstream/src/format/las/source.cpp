// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "format/chain.hpp"
#include "format/copc/octree.hpp"
#include "format/formats.hpp"
#include "format/las/fields.hpp"
#include "format/las/header.hpp"
#include "format/las/laz_records.hpp"
#include "format/las/record_reader.hpp"
#include "format/packed_column.hpp"
#include "io/peek.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

/// More than this means a corrupt header.
constexpr std::size_t kMostExtraBytes = 2048;

class LasSource final : public PointSource {
 public:
  /// first: what the first of several files says; coordinates are moved onto its lattice.
  LasSource(const std::string& file, const SourceOptions& options, const SourceInfo* first)
      : input_(file, options.stop),
        header_(read_las_header(input_, file, info_.comments)),
        block_points_(options.block_points) {
    info_.format = header_.compressed ? "laz" : "las";
    info_.files = {file};
    if (options.crs) {
      info_.crs = *options.crs;
    } else {
      info_.crs = las_crs(header_, input_.name(), info_.comments);
    }
    constexpr std::array kNames{"x", "y", "z"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      info_.coordinates[axis] = {.name = kNames[axis], .type = ScalarType::i32};
    }
    info_.world.xy = {header_.scale[0], 0, header_.offset[0], 0, header_.scale[1],
                      header_.offset[1]};
    info_.coordinates[2].scale = header_.scale[2];
    info_.coordinates[2].offset = header_.offset[2];
    make_fields();
    if (first != nullptr) move_onto(*first);
    open_records(file, options);
  }

  const SourceInfo& info() const override { return info_; }

  bool next(PointBlock& block) override {
    const auto wanted = static_cast<std::size_t>(
        std::min<std::uint64_t>(block_points_, wanted_points_ - delivered_));
    block.positions.resize(wanted);
    block.payload.resize(wanted * payload_bytes_);
    for (std::size_t done = 0; done < wanted;) done += unpack(block, done, wanted - done);
    count_withheld(block);
    if (moved_) move(block);
    delivered_ += wanted;
    return wanted > 0;
  }

  Progress progress() const override {
    return {.points = delivered_,
            .nodata = 0,
            .withheld = withheld_,
            .excluded = header_.points - wanted_points_,
            .fraction = wanted_points_ == 0 ? 1.0
                                            : static_cast<double>(delivered_) /
                                                  static_cast<double>(wanted_points_)};
  }

  std::uint64_t reading_bytes() const override { return records_->held_bytes(); }

 private:
  [[noreturn]] void fail(std::string where, std::string cause, std::string remedy) const {
    throw Error({.file = input_.name(),
                 .where = std::move(where),
                 .cause = std::move(cause),
                 .remedy = std::move(remedy)});
  }

  /// Those that the selection needs, as far as the file can tell.
  void open_records(const std::string& file, const SourceOptions& options) {
    const Selection& wanted = options.selection;
    wanted_points_ = header_.points;
    open_nodes(file, options);
    if (!info_.octree) {
      if (wanted.resolution > 0) {
        fail("", "its points lie in no octree that could be read down to a resolution",
             "name a COPC file, not piped, or leave `resolution` out");
      }
      if (wanted.region && lies_outside(*wanted.region)) wanted_points_ = 0;
      if (header_.compressed) {
        records_ = open_laz_records(input_, file, header_, options);
      } else {
        records_ = std::make_unique<PlainRecords>(input_, header_.record_bytes);
      }
    }
    info_.points = wanted_points_;
  }

  /// COPC, unless it comes from a pipe, is read node by node. Where its hierarchy is damaged, as by
  /// programs that copy its VLRs to files of other points, it is a LAZ file like others.
  void open_nodes(const std::string& file, const SourceOptions& options) {
    const bool is_copc = header_.compressed && header_.minor == 4 && !header_.vlrs.empty() &&
                         header_.vlrs.front().is(kCopcUser, kCopcInfo);
    if (!is_copc || !is_seekable(file)) return;
    try {
      std::unique_ptr<ByteSource> bytes = open_file(file);
      CopcOctree octree = read_copc_octree(*bytes, header_.vlrs.front().data, header_.points_offset,
                                           header_.points);
      octree.keep(options.selection.region, options.selection.resolution, header_.scale);
      OctreeInfo facts{.spacing = octree.spacing, .nodes = octree.nodes.size()};
      std::uint64_t points = 0;
      for (const CopcNode& node : octree.nodes) {
        points += node.points;
        facts.depths = std::max(facts.depths, node.depth + 1);
      }
      records_ = open_laz_nodes(std::move(bytes), header_, octree, options);
      wanted_points_ = points;
      info_.octree = facts;
      info_.format = "copc";
    } catch (const Error& error) {
      if (options.selection.resolution > 0) throw;
      info_.comments.push_back("read in the order of the file: " + error.parts().cause);
    }
  }

  /// Whether the header says that no point is in the region. Its box is not relied on where it is
  /// empty, as writers leave it at 0; steps of the lattice make up for its rounding.
  [[nodiscard]] bool lies_outside(const Box3& region) const {
    const Box3& box = header_.bounds;
    if (box.empty() || box.min == box.max) return false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (box.min[axis] - header_.scale[axis] > region.max[axis] ||
          box.max[axis] + header_.scale[axis] < region.min[axis]) {
        return true;
      }
    }
    return false;
  }

  void make_fields() {
    fields_ = las_fields(header_.point_format, header_.adjusted_time);
    const std::size_t standard = las_record_bytes(header_.point_format);
    if (header_.record_bytes - standard > kMostExtraBytes) {
      fail("header",
           "its records have " + std::to_string(header_.record_bytes - standard) +
               " extra bytes; up to " + std::to_string(kMostExtraBytes) + " are read",
           "the file is damaged or its header is wrong");
    }
    std::string descriptions;
    for (const LasVlr& record : header_.vlrs) {
      if (record.is(kLasSpec, kLasExtraBytes)) descriptions += record.data;
    }
    const std::vector<LasField> extra =
        las_extra_fields(descriptions, standard, header_.record_bytes, fields_, info_.comments);
    fields_.insert(fields_.end(), extra.begin(), extra.end());
    for (const LasField& field : fields_) {
      if (field.channel.name == "withheld") withheld_attribute_ = info_.attributes.size();
      info_.attributes.push_back(field.channel);
    }
    payload_bytes_ = info_.payload_size();
  }

  /// Prepares moving the coordinates onto the lattice of the first file. Throws: Error unless the
  /// scales are equal and the offsets differ by whole steps.
  void move_onto(const SourceInfo& first) {
    const Lattice to = *lattice_of(first), from = *lattice_of(info_);
    if (to == from) return;
    // Offsets are doubles, which resolve a millimetre of projected coordinates to a millionth.
    constexpr double kSameStep = 1e-4;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double steps = (from.offset[axis] - to.offset[axis]) / to.scale[axis];
      shift_[axis] = std::round(steps);
      if (to.scale[axis] != from.scale[axis] || !(std::abs(steps - shift_[axis]) <= kSameStep)) {
        fail("",
             std::string("its ") + "xyz"[axis] + " lies on another lattice than that of " +
                 first.files.front() + ": its scale or the fraction of its offset differs",
             "write it anew with that scale and offset, e.g. with las2las -rescale -reoffset");
      }
    }
    moved_ = true;
    info_.world = first.world;
    info_.coordinates = first.coordinates;
  }

  void count_withheld(const PointBlock& block) {
    const auto marks = info_.view<std::uint8_t>(block.payload, withheld_attribute_);
    for (std::size_t i = 0; i < marks.size(); ++i) withheld_ += marks[i];
  }

  void move(PointBlock& block) const {
    constexpr double kLeast = std::numeric_limits<std::int32_t>::min(),
                     kMost = std::numeric_limits<std::int32_t>::max();
    for (std::size_t i = 0; i < block.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double& value = block.positions[i][axis];
        value += shift_[axis];
        if (value < kLeast || value > kMost) {
          fail("point " + std::to_string(delivered_ + i),
               "is out of reach for the scale and offset of the first file",
               "name a file in the middle of all first, or read them on their own");
        }
      }
    }
  }

  /// Unpacks some of the next `wanted` records to the points from `done` on; returns how many.
  std::size_t unpack(PointBlock& block, std::size_t done, std::size_t wanted) {
    const std::string_view rows = records_->read(wanted);
    const std::size_t stride = header_.record_bytes, count = rows.size() / stride;
    PackedColumn column{.rows = rows.data(),
                        .stride = stride,
                        .count = count,
                        .type = ScalarType::i32,
                        .swap = std::endian::native == std::endian::big};
    for (std::size_t axis = 0; axis < 3; ++axis, column.rows += 4) {
      decode_coordinate(column, block.positions.data() + done, axis);
    }
    std::byte* to = block.payload.data() + done * payload_bytes_;
    for (const LasField& field : fields_) {
      column.rows = rows.data() + field.offset;
      column.type = field.channel.type;
      if (field.bits == 0) {
        decode_values(column, to, payload_bytes_);
      } else {
        decode_bits(column, field, to);
      }
      to += size_of(field.channel.type);
    }
    return count;
  }

  void decode_bits(const PackedColumn& column, const LasField& field, std::byte* to) const {
    const unsigned mask = (1U << field.bits) - 1;
    const char* at = column.rows;
    for (std::size_t i = 0; i < column.count; ++i, at += column.stride, to += payload_bytes_) {
      *to = static_cast<std::byte>((static_cast<unsigned char>(*at) >> field.shift) & mask);
    }
  }

  Input input_;
  SourceInfo info_;
  LasHeader header_;
  std::size_t block_points_;
  std::vector<LasField> fields_;
  std::size_t payload_bytes_ = 0;
  std::unique_ptr<RecordReader> records_;
  std::size_t withheld_attribute_ = 0;
  std::uint64_t wanted_points_ = 0, delivered_ = 0, withheld_ = 0;
  bool moved_ = false;
  Point3 shift_{};  ///< in steps of the lattice
};

bool recognise_las(std::span<const std::byte> head) {
  return std::string_view(reinterpret_cast<const char*>(head.data()), head.size())
      .starts_with("LASF");
}

std::unique_ptr<PointSource> open_one_las(const std::string& file, const SourceOptions& options,
                                          const SourceInfo* first) {
  assert(options.block_points > 0);
  return std::make_unique<LasSource>(file, options, first);
}

std::unique_ptr<PointSource> open_las(std::span<const std::string> files,
                                      const SourceOptions& options) {
  return open_in_turn(files, options, &open_one_las);
}

}  // namespace

const Format& las_format() {
  static const Format format{.name = "las",
                             .endings = {".las", ".laz"},
                             .streams = true,
                             .recognise = &recognise_las,
                             .open = &open_las};
  return format;
}

}  // namespace terrace::stream
