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
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "format/chain.hpp"
#include "format/common_placement.hpp"
#include "format/ept/hierarchy.hpp"
#include "format/ept/metadata.hpp"
#include "format/ept/nodes.hpp"
#include "format/formats.hpp"
#include "format/las/header.hpp"
#include "format/las/stream.hpp"
#include "format/octree.hpp"
#include "format/record_parts.hpp"
#include "format/record_source.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

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
                                          const Placement* onto) {
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  EptMetadata metadata = read_ept_metadata(file);
  Octree& octree = metadata.octree;
  octree.nodes = read_ept_hierarchy(folder, metadata.points);
  if (const OctreeNode* const twice = octree.arrange()) {
    throw ept_fault((folder / "ept-hierarchy").string(), "is listed twice")
        .at("node " + name_of(*twice));
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
  return source_of_records(std::move(stream), options.block_points, onto);
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
  return open_in_turn(files, options, [common](const std::string& file, const SourceOptions& one) {
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
  static const Format format{.name = "ept",
                             .endings = {},
                             .recognise = &recognise_ept,
                             .open = &open_ept,
                             .octree = true};
  return format;
}

}  // namespace terrace::stream
