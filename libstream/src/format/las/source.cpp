// SPDX-License-Identifier: Apache-2.0
#include <cassert>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/chain.hpp"
#include "format/common_placement.hpp"
#include "format/copc/hierarchy.hpp"
#include "format/las/header.hpp"
#include "format/las/laz_records.hpp"
#include "format/las/record_reader.hpp"
#include "format/octree.hpp"
#include "format/record_parts.hpp"
#include "format/record_source.hpp"
#include "format/registry.hpp"
#include "io/peek.hpp"
#include "io/text.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

/// Opens one LAS, LAZ or COPC file as a source.
class LasOpener {
 public:
  LasOpener(const std::string& file, const SourceOptions& options)
      : file_(file), options_(options) {}

  RecordStream open() {
    auto input = std::make_unique<Input>(file_, options_.stop);
    std::vector<std::string> comments;
    header_ = read_las_header(*input, file_, comments, options_.on_damage);
    stream_ = las_stream(header_, input->name(), std::move(comments));
    stream_.input = std::move(input);
    SourceInfo& info = stream_.info;
    info.format = header_.compressed ? "laz" : "las";
    info.files = {file_};
    if (options_.crs) {
      info.crs = las_crs_overridden(header_, *options_.crs);
    } else {
      info.crs = las_crs(header_, stream_.input->name(), info.comments);
    }
    if (header_.uncounted_records > 0) {
      info.note = fmt::format(
          "{}: the header counts {}, but the bytes of {} more follow, which are left out; a writer "
          "may have been interrupted",
          stream_.input->name(), counted(header_.points, "point"), header_.uncounted_records);
      info.comments.push_back(info.note);
    }
    state_bounds();
    open_records();
    return std::move(stream_);
  }

 private:
  void state_bounds() {
    if (header_.bounds.empty()) return;
    Box3& box = stream_.info.stated_bounds.emplace();
    for (const Point3& corner : {header_.bounds.min, header_.bounds.max}) {
      Point3 stored;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        stored[axis] = (corner[axis] - header_.offset[axis]) / header_.scale[axis];
      }
      box.include(stored);
    }
  }

  /// Opens the records that the selection needs, as far as the file's structure allows.
  void open_records() {
    const Selection& selection = options_.selection;
    stream_.info.points = stream_.points;
    open_nodes();
    if (stream_.info.octree) return;
    if (selection.resolution > 0) {
      throw Error(stream_.input->name(),
                  message("it has no octree, so {resolution} does not apply"))
          .remedy(message("name a COPC file, not piped, or EPT, or leave {resolution} out"));
    }
    if (header_.compressed) {
      stream_.records = open_laz_records(*stream_.input, file_, header_, options_);
    } else {
      stream_.records = std::make_unique<PlainRecords>(*stream_.input, header_.record_bytes,
                                                       header_.points, options_.on_damage);
    }
  }

  /// Reads COPC node by node, unless it comes from a pipe. A file with a damaged hierarchy is read
  /// as a normal LAZ file: some programs copy the VLRs of COPC to files with other points.
  void open_nodes() {
    const bool is_copc = header_.compressed && header_.minor == 4 && !header_.vlrs.empty() &&
                         header_.vlrs.front().is(kCopcUser, kCopcInfo);
    if (!is_copc || !is_seekable(file_)) return;
    const Selection& selection = options_.selection;
    try {
      std::unique_ptr<ByteSource> bytes = open_file(file_);
      Octree octree = read_copc_hierarchy(*bytes, header_.vlrs.front().data, header_.points_offset,
                                          header_.points);
      octree.keep(selection.region, selection.resolution, steps_of(stream_.info));
      RecordParts parts = copc_node_parts(std::move(bytes), header_, octree);
      if (selection.region) parts = parts_in_cubes(std::move(parts), octree, stream_, file_);
      stream_.records = records_of_parts(std::move(parts), options_);
      stream_.info.points = octree.points();
      stream_.info.octree = octree.info();
      stream_.info.format = "copc";
    } catch (const Error& error) {
      if (selection.resolution > 0) throw;
      stream_.info.comments.push_back("read in the order of the file: " +
                                      error.parts().cause.text());
    }
  }

  const std::string& file_;
  const SourceOptions& options_;
  LasHeader header_;
  RecordStream stream_;
};

bool recognise_las(std::span<const std::byte> head) {
  return std::string_view(reinterpret_cast<const char*>(head.data()), head.size())
      .starts_with("LASF");
}

/// Returns the common placement according to the headers of the files, including pipes; nullopt for
/// a single file. Ignores invalid headers, which are refused when their files are opened.
std::optional<Placement> placement_of_all(std::span<const std::string> files,
                                          const std::stop_token& stop) {
  if (files.size() == 1) return std::nullopt;
  std::vector<Placement> placements;
  Box3 bounds;
  for (const std::string& file : files) {
    const std::vector<char> head = peek_head(file, kLasFirstBytes, stop);
    const std::optional<LasHeader> header = peek_las_header({head.data(), head.size()});
    if (!header) continue;
    placements.push_back(las_placement(*header));
    bounds.include(header->bounds);
  }
  if (placements.empty()) return std::nullopt;
  return common_placement(placements, bounds);
}

std::unique_ptr<PointSource> open_las(std::span<const std::string> files,
                                      const SourceOptions& options) {
  assert(options.block_points > 0);
  const std::optional<Placement> common = placement_of_all(files, options.stop);
  return open_in_sequence(files, options,
                          [common](const std::string& file, const SourceOptions& one) {
                            return source_of_records(LasOpener(file, one).open(), one.block_points,
                                                     common ? &*common : nullptr);
                          });
}

}  // namespace

const Format& las_format() {
  static const Format format{.name = "las",
                             .endings = {".las", ".laz"},
                             .streams = true,
                             .recognise = &recognise_las,
                             .open = &open_las,
                             .octree = true};
  return format;
}

}  // namespace terrace::stream
