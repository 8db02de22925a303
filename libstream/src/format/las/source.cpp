// SPDX-License-Identifier: Apache-2.0
#include <cassert>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "format/chain.hpp"
#include "format/copc/hierarchy.hpp"
#include "format/formats.hpp"
#include "format/las/header.hpp"
#include "format/las/laz_records.hpp"
#include "format/las/record_reader.hpp"
#include "format/las/stream.hpp"
#include "format/record_source.hpp"
#include "io/peek.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

class LasOpener {
 public:
  LasOpener(const std::string& file, const SourceOptions& options)
      : file_(file), options_(options) {}

  /// first: what the first of several files says; coordinates are moved onto its lattice.
  RecordStream open(const SourceInfo* first) {
    auto input = std::make_unique<Input>(file_, options_.stop);
    std::vector<std::string> comments;
    header_ = read_las_header(*input, file_, comments, options_.on_damage);
    stream_ = las_stream(header_, input->name(), std::move(comments));
    stream_.input = std::move(input);
    SourceInfo& info = stream_.info;
    info.format = header_.compressed ? "laz" : "las";
    info.files = {file_};
    info.crs =
        options_.crs ? *options_.crs : las_crs(header_, stream_.input->name(), info.comments);
    if (first != nullptr) move_onto(*first, stream_);
    state_bounds();
    open_records();
    return std::move(stream_);
  }

 private:
  /// Points may have been moved onto the lattice of the first of several files.
  void state_bounds() {
    const std::optional<Lattice> lattice = lattice_of(stream_.info);
    if (!lattice || !has_bounds()) return;
    Box3& box = stream_.info.stated_bounds.emplace();
    for (const Point3& corner : {header_.bounds.min, header_.bounds.max}) {
      Point3 stored;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        stored[axis] = (corner[axis] - lattice->offset[axis]) / lattice->scale[axis];
      }
      box.include(stored);
    }
  }

  /// Writers leave the header's box at 0 if they do not fill it in.
  [[nodiscard]] bool has_bounds() const {
    return !header_.bounds.empty() && header_.bounds.min != header_.bounds.max;
  }

  /// Those that the selection needs, as far as the file can tell.
  void open_records() {
    const Selection& wanted = options_.selection;
    stream_.info.points = stream_.points;
    open_nodes();
    if (stream_.info.octree) return;
    if (wanted.resolution > 0) {
      throw Error({.file = stream_.input->name(),
                   .where = {},
                   .cause = "its points lie in no octree that could be read down to a resolution",
                   .remedy = "name a COPC file, not piped, or EPT, or leave `resolution` out"});
    }
    if (wanted.region && lies_outside(*wanted.region)) stream_.info.points = 0;
    if (header_.compressed) {
      stream_.records = open_laz_records(*stream_.input, file_, header_, options_);
    } else {
      stream_.records = std::make_unique<PlainRecords>(*stream_.input, header_.record_bytes,
                                                       header_.points, options_.on_damage);
    }
  }

  /// COPC, unless it comes from a pipe, is read node by node. Where its hierarchy is damaged, as by
  /// programs that copy its VLRs to files of other points, it is a LAZ file like others.
  void open_nodes() {
    const bool is_copc = header_.compressed && header_.minor == 4 && !header_.vlrs.empty() &&
                         header_.vlrs.front().is(kCopcUser, kCopcInfo);
    if (!is_copc || !is_seekable(file_)) return;
    const Selection& wanted = options_.selection;
    try {
      std::unique_ptr<ByteSource> bytes = open_file(file_);
      Octree octree = read_copc_hierarchy(*bytes, header_.vlrs.front().data, header_.points_offset,
                                          header_.points);
      octree.keep(wanted.region, wanted.resolution, header_.scale);
      stream_.records = open_laz_nodes(std::move(bytes), header_, octree, options_);
      stream_.info.points = octree.points();
      stream_.info.octree = octree.info();
      stream_.info.format = "copc";
    } catch (const Error& error) {
      if (wanted.resolution > 0) throw;
      stream_.info.comments.push_back("read in the order of the file: " + error.parts().cause);
    }
  }

  /// Whether the header says that no point is in the region. Steps of the lattice make up for the
  /// rounding of its box.
  [[nodiscard]] bool lies_outside(const Box3& region) const {
    const Box3& box = header_.bounds;
    if (!has_bounds()) return false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (box.min[axis] - header_.scale[axis] > region.max[axis] ||
          box.max[axis] + header_.scale[axis] < region.min[axis]) {
        return true;
      }
    }
    return false;
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

std::unique_ptr<PointSource> open_one_las(const std::string& file, const SourceOptions& options,
                                          const SourceInfo* first) {
  assert(options.block_points > 0);
  return source_of_records(LasOpener(file, options).open(first), options.block_points);
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
