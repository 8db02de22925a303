// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <zstd.h>

#include "format/chain.hpp"
#include "format/common_placement.hpp"
#include "format/ept/metadata.hpp"
#include "format/las/header.hpp"
#include "format/las/laz_records.hpp"
#include "format/las/record_reader.hpp"
#include "format/octree.hpp"
#include "format/record_parts.hpp"
#include "format/record_source.hpp"
#include "format/registry.hpp"
#include "io/text.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

Error miscounted(std::string file, std::uint64_t points, const std::string& found) {
  return ept_fault(std::move(file), fmt::format("the hierarchy counts {}, but the file {}",
                                                counted(points, "point"), found));
}

/// Records compressed with Zstandard, in one frame or several.
class ZstdRecords final : public RecordReader {
 public:
  ZstdRecords(Input& input, std::size_t record_bytes, std::uint64_t points)
      : input_(&input), record_bytes_(record_bytes), points_(points), remaining_(points) {
    if (stream_ == nullptr) throw std::bad_alloc();
    // Compression levels above 19 need this much; a damaged frame may claim any size.
    constexpr int kLargestWindow = 25;
    ZSTD_DCtx_setParameter(stream_.get(), ZSTD_d_windowLogMax, kLargestWindow);
  }

  std::string_view read(std::uint64_t max_records) override {
    constexpr std::size_t kPieceBytes = 64u << 10;
    const std::uint64_t records = std::min<std::uint64_t>(
        {max_records, remaining_, std::max<std::size_t>(1, kPieceBytes / record_bytes_)});
    records_.resize(static_cast<std::size_t>(records) * record_bytes_);
    if (decode(records_) < records_.size()) {
      throw miscounted(input_->name(), points_, "ends earlier");
    }
    remaining_ -= records;
    std::byte more{};
    if (remaining_ == 0 && decode({&more, 1}) > 0)
      throw miscounted(input_->name(), points_, "has more");
    return {reinterpret_cast<const char*>(records_.data()), records_.size()};
  }

 private:
  struct Free {
    void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
  };

  /// Decodes to `room`. Returns the number of bytes decoded, fewer only at the end of the file.
  std::size_t decode(std::span<std::byte> room) {
    constexpr std::size_t kWindowBytes = 128u << 10;
    ZSTD_outBuffer out{.dst = room.data(), .size = room.size(), .pos = 0};
    while (out.pos < out.size) {
      const std::string_view window = input_->fill(kWindowBytes);
      ZSTD_inBuffer in{.src = window.data(), .size = window.size(), .pos = 0};
      const std::size_t before = out.pos;
      const std::size_t result = ZSTD_decompressStream(stream_.get(), &out, &in);
      if (ZSTD_isError(result) != 0) {
        throw ept_fault(input_->name(), std::string("zstandard: ") + ZSTD_getErrorName(result))
            .at_byte(input_->offset());
      }
      input_->consume(in.pos);
      if (in.pos == 0 && out.pos == before) {
        if (result > 0 && !ended_) throw ept_fault(input_->name(), "is truncated");
        break;
      }
      ended_ = result == 0;
    }
    return out.pos;
  }

  Input* input_;
  std::size_t record_bytes_;
  std::uint64_t points_, remaining_;
  std::unique_ptr<ZSTD_DStream, Free> stream_{ZSTD_createDStream()};
  std::vector<std::byte> records_;
  bool ended_ = true;  ///< not within a frame
};

/// What all nodes share.
struct EptNodes {
  std::filesystem::path folder;
  EptData data = EptData::binary;
  std::size_t record_bytes = 0;
  std::vector<OctreeNode> nodes;
  LasHeader first;
};

/// Returns the file of a node's points.
std::filesystem::path ept_node_file(const std::filesystem::path& folder, EptData data,
                                    const OctreeNode& node) {
  const char* const ending = data == EptData::laszip   ? ".laz"
                             : data == EptData::binary ? ".bin"
                                                       : ".zst";
  return folder / "ept-data" / (key_of(node) + ending);
}

/// Reads the records of one node at a time, in any encoding.
class NodeReader final : public PartReader {
 public:
  explicit NodeReader(std::shared_ptr<const EptNodes> nodes) : nodes_(std::move(nodes)) {}

  void start(std::size_t part) override {
    const OctreeNode& node = nodes_->nodes[part];
    const std::string file = ept_node_file(nodes_->folder, nodes_->data, node).string();
    records_.reset();
    constexpr std::size_t kWindowBytes = 256u << 10;
    // Binary records may begin like gzip by chance.
    input_.emplace(file, std::stop_token(), kWindowBytes, Input::Packed::as_it_is);
    switch (nodes_->data) {
      case EptData::laszip:
        open_laz(file, node);
        break;
      case EptData::binary:
        check_size(node);
        records_ = std::make_unique<PlainRecords>(*input_, nodes_->record_bytes, node.points);
        break;
      case EptData::zstandard:
        records_ = std::make_unique<ZstdRecords>(*input_, nodes_->record_bytes, node.points);
        break;
    }
  }

  std::size_t read(std::span<std::byte> room) override {
    const std::string_view rows = records_->read(room.size() / nodes_->record_bytes);
    std::copy_n(reinterpret_cast<const std::byte*>(rows.data()), rows.size(), room.data());
    return rows.size();
  }

 private:
  void check_size(const OctreeNode& node) const {
    const std::uint64_t bytes = input_->size().value_or(0), record = nodes_->record_bytes;
    if (bytes % record != 0 || bytes / record != node.points) {
      throw miscounted(input_->name(), node.points,
                       fmt::format("has {} in records of {}", counted(bytes, "byte"), record));
    }
  }

  void open_laz(const std::string& file, const OctreeNode& node) {
    std::vector<std::string> comments;
    const LasHeader header = read_las_header(*input_, file, comments);
    if (header.points != node.points) {
      throw miscounted(file, node.points, fmt::format("has {}", header.points));
    }
    const LasHeader& first = nodes_->first;
    if (header.point_format != first.point_format || header.record_bytes != first.record_bytes ||
        header.scale != first.scale || header.offset != first.offset) {
      throw ept_fault(file, "its point format, scale or offset differs from the other nodes")
          .at("header");
    }
    if (header.compressed) {
      records_ = open_laz_records(*input_, file, header, SourceOptions{});
    } else {
      records_ = std::make_unique<PlainRecords>(*input_, header.record_bytes, header.points);
    }
  }

  std::shared_ptr<const EptNodes> nodes_;
  std::optional<Input> input_;
  std::unique_ptr<RecordReader> records_;
};

/// One part for each node of `metadata.octree`, in its order. first: the header of one LAZ node,
/// with which all others must agree. A reader holds a window of the node's file and the memory of
/// its decoder. It refuses a file that does not have exactly as many points as the hierarchy says.
RecordParts ept_parts(const std::filesystem::path& folder, const EptMetadata& metadata,
                      const LasHeader& first) {
  RecordParts parts{.record_bytes = metadata.stream.record_bytes};
  for (const OctreeNode& node : metadata.octree.nodes) {
    // LAZ coded in layers holds all coded points of a node at once.
    const bool is_laz = metadata.data == EptData::laszip;
    parts.parts.push_back(
        {.points = node.points, .bytes = is_laz ? node.points * parts.record_bytes : 0});
  }
  const auto nodes = std::make_shared<const EptNodes>(
      EptNodes{folder, metadata.data, metadata.stream.record_bytes, metadata.octree.nodes, first});
  parts.make_reader = [nodes] { return std::make_unique<NodeReader>(nodes); };
  return parts;
}

/// Takes the record layout from the header of a node, and the CRS if ept.json has none.
LasHeader read_node_header(const std::filesystem::path& file, EptMetadata& metadata) {
  Input input(file.string());
  std::vector<std::string> comments;
  LasHeader header = read_las_header(input, file.string(), comments);
  const std::uint64_t points = metadata.points;
  metadata.stream = las_stream(header, file.string(), std::move(comments));
  metadata.stream.points = points;
  if (metadata.crs == Crs{}) {
    metadata.crs = las_crs(header, file.string(), metadata.stream.info.comments);
  }
  return header;
}

std::unique_ptr<PointSource> open_one_ept(const std::string& file, const SourceOptions& options,
                                          const Placement* placement) {
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  EptMetadata metadata = read_ept_metadata(file);
  Octree& octree = metadata.octree;
  octree.nodes = read_ept_hierarchy(folder, metadata.points);
  if (const OctreeNode* const duplicate = octree.arrange()) {
    throw ept_fault((folder / "ept-hierarchy").string(), "is listed twice")
        .at("node " + key_of(*duplicate));
  }
  LasHeader header;
  if (metadata.data == EptData::laszip && !octree.nodes.empty()) {
    header = read_node_header(ept_node_file(folder, metadata.data, octree.nodes.front()), metadata);
  }
  RecordStream& stream = metadata.stream;
  SourceInfo& info = stream.info;
  info.format = "ept";
  info.files = {file};
  info.crs = options.crs ? with_own_height_unit(*options.crs, metadata.crs) : metadata.crs;
  octree.keep(options.selection.region, options.selection.resolution, steps_of(info));
  info.points = octree.points();
  info.octree = octree.info();
  RecordParts parts = ept_parts(folder, metadata, header);
  if (options.selection.region) parts = parts_in_cubes(std::move(parts), octree, stream, file);
  stream.records = records_of_parts(std::move(parts), options);
  return source_of_records(std::move(stream), options.block_points, placement);
}

std::unique_ptr<PointSource> open_ept(std::span<const std::string> files,
                                      const SourceOptions& options) {
  assert(options.block_points > 0);
  std::optional<Placement> common;
  if (files.size() > 1) {
    std::vector<Placement> placements;
    for (const std::string& file : files) {
      placements.push_back(open_one_ept(file, options, nullptr)->info());
    }
    common = common_placement(placements, {});
  }
  return open_in_sequence(files, options,
                          [common](const std::string& file, const SourceOptions& one) {
                            return open_one_ept(file, one, common ? &*common : nullptr);
                          });
}

/// True for a JSON object with a member that only EPT has. Its names are sorted, so the member is
/// near the beginning.
bool recognise_ept(std::span<const std::byte> head) {
  std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  return text.starts_with('{') && (text.find("\"boundsConforming\"") != text.npos ||
                                   text.find("\"hierarchyType\"") != text.npos);
}

}  // namespace

const Format& ept_format() {
  static const Format format{
      .name = "ept", .endings = {}, .recognise = &recognise_ept, .open = &open_ept, .octree = true};
  return format;
}

}  // namespace terrace::stream
