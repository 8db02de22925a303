// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/point_table.hpp"

#include <array>
#include <memory>
#include <utility>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "earth/world.hpp"
#include "tables/column_value.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/stream/raster.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;

std::vector<double> PointTable::column(const std::string& name) const {
  std::string known;
  for (std::size_t c = 0; c < attributes.size(); ++c) {
    const stream::Channel& channel = info.attributes[c];
    known += (known.empty() ? "" : ", ") + channel.name;
    if (channel.name != name) continue;
    std::vector<double> values(size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = value_at(attributes[c], i) * channel.scale + channel.offset;
    }
    return values;
  }
  throw UsageError("the points have no column '" + name + "'" +
                   (known.empty() ? ": they have none but x, y and z" : "; there are: " + known));
}

void PointTable::drop(const std::string& name) {
  for (std::size_t c = attributes.size(); c > 0; --c) {
    if (info.attributes[c - 1].name != name) continue;
    const auto at = static_cast<std::ptrdiff_t>(c - 1);
    info.attributes.erase(info.attributes.begin() + at);
    attributes.erase(attributes.begin() + at);
  }
}

std::uint64_t reading_within_memory(const stream::PointSource& source, std::uint64_t memory_bytes) {
  // The program itself and the blocks that are read ahead.
  constexpr std::uint64_t kBeside = std::uint64_t{24} << 20;
  const std::uint64_t reading = source.reading_bytes();
  if (reading == 0 || kBeside + reading <= memory_bytes) return reading;
  throw stream::Error(
      {.file = source.info().files.front(),
       .where = {},
       .cause = "reading it needs " + std::to_string(((kBeside + reading) >> 20) + 1) +
                "M of memory, --memory allows " + std::to_string(memory_bytes >> 20) + "M",
       .remedy = "raise --memory, or rewrite large strips and tiles as small "
                 "tiles: gdal_translate -co TILED=YES"});
}

PointTable read_point_table(const std::string& file, const std::string& format,
                            std::uint64_t memory_bytes, const CommonOptions& common) {
  const std::array<std::string, 1> files{file};
  const std::unique_ptr<stream::PointSource> source =
      stream::open_source(files, {.format = format, .stop = stop_token()});
  const std::uint64_t reading = reading_within_memory(*source, memory_bytes);
  PointTable table;
  table.info = source->info();
  table.attributes.resize(table.info.attributes.size());
  std::size_t bytes_per_point = sizeof(stream::Point3);
  for (std::size_t c = 0; c < table.attributes.size(); ++c) {
    table.attributes[c].type = table.info.attributes[c].type;
    bytes_per_point += stream::size_of(table.attributes[c].type);
  }
  ProgressMeter meter(common.progress, "points");
  stream::PointBlock block;
  while (source->next(block)) {
    check_interrupt();
    stream::to_world(table.info, block);
    // A vector that grows is there twice for a moment.
    if (2 * bytes_per_point * (table.size() + block.size()) > memory_bytes - reading) {
      throw stream::Error({.file = file,
                           .where = {},
                           .cause = "has more points than " + readable_bytes(memory_bytes) +
                                    " can hold (" + with_commas(table.size()) + " so far)",
                           .remedy = "raise --memory, or build a store, which takes points of any "
                                     "number"});
    }
    table.positions.insert(table.positions.end(), block.positions.begin(), block.positions.end());
    for (std::size_t c = 0; c < table.attributes.size(); ++c) {
      std::vector<std::byte>& bytes = table.attributes[c].bytes;
      bytes.insert(bytes.end(), block.attributes[c].bytes.begin(), block.attributes[c].bytes.end());
    }
    const stream::Progress progress = source->progress();
    meter.update(progress.points, progress.fraction);
  }
  table.nodata = source->progress().nodata;
  if (table.positions.empty()) {
    throw stream::Error({.file = file,
                         .where = {},
                         .cause = "there is not one point in it",
                         .remedy = "there is nothing to cluster"});
  }
  return table;
}

GroundFrame GroundFrame::of(const PointTable& table, double z_weight) {
  stream::Box3 box;
  for (const stream::Point3& p : table.positions) box.include(p);
  // The positions are in the CRS already.
  Placement placement;
  placement.crs = table.info.crs;
  placement.coordinates[0].unit = table.info.coordinates[0].unit;
  placement.coordinates[2].unit = table.info.coordinates[2].unit;
  const Ground ground(placement, z_weight);
  const GroundMap map = ground.map(box);
  GroundFrame frame;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    frame.origin[axis] = 0.5 * box.min[axis] + 0.5 * box.max[axis];
    frame.scale[axis] = map[4 * axis];
  }
  frame.assumption = ground.assumption();
  return frame;
}

}  // namespace terrace::tools
