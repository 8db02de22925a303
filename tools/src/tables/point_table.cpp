// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/point_table.hpp"

#include <array>
#include <memory>
#include <utility>

#include <fmt/core.h>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/stream/raster.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/undeclared_voids.hpp"

namespace terrace::tools {

using namespace terrain;

std::vector<double> PointTable::column(const std::string& name) const {
  std::string names;
  for (std::size_t c = 0; c < info.attributes.size(); ++c) {
    const stream::Channel& channel = info.attributes[c];
    names += (names.empty() ? "" : ", ") + channel.name;
    if (channel.name != name) continue;
    std::vector<double> values(size());
    const std::byte* at = payload.data() + info.attribute_offset(c);
    for (double& value : values) {
      value = stream::to_double(channel.type, at) * channel.scale + channel.offset;
      at += info.payload_size();
    }
    return values;
  }
  throw UsageError(fmt::format(
      "the points have no column '{}'{}", name,
      names.empty() ? ": they have only x, y and z" : fmt::format("; there are: {}", names)));
}

void writing_within_memory(const stream::PointWriter& writer, const std::string& file,
                           std::uint64_t memory_bytes, std::uint64_t reading) {
  const std::uint64_t writing = writer.writing_bytes();
  const std::uint64_t needed = kProgramMemory + reading + writing;
  if (writing == 0 || needed <= memory_bytes) return;
  throw stream::Error(file, fmt::format("writing it needs {}M of memory, --memory allows {}M",
                                        (needed >> 20) + 1, memory_bytes >> 20))
      .remedy("raise --memory, or write another format");
}

std::uint64_t reading_within_memory(const stream::PointSource& source, std::uint64_t memory_bytes) {
  const std::uint64_t reading = source.reading_bytes();
  if (reading == 0 || kProgramMemory + reading <= memory_bytes) return reading;
  throw stream::Error(source.info().files.front(),
                      fmt::format("reading it needs {}M of memory, --memory allows {}M",
                                  ((kProgramMemory + reading) >> 20) + 1, memory_bytes >> 20))
      .remedy(source.info().grid ? "raise --memory, or rewrite large strips and tiles as small "
                                   "tiles: gdal_translate -co TILED=YES"
                                 : "raise --memory");
}

void for_each_block(stream::PointSource& source, const CommonOptions& common,
                    const std::function<void(stream::PointBlock&)>& take) {
  ProgressMeter meter(common.progress, "points");
  stream::PointBlock block;
  while (source.next(block)) {
    check_interrupt();
    take(block);
    const stream::Progress progress = source.progress();
    meter.update(progress.points, progress.fraction);
  }
}

PointTable read_point_table(const std::string& file, const std::string& format,
                            std::uint64_t memory_bytes, const CommonOptions& common,
                            stream::Entities entities) {
  const std::array<std::string, 1> files{file};
  const std::unique_ptr<stream::PointSource> source =
      stream::open_source(files, {.format = format,
                                  .entities = entities,
                                  .memory_bytes = common.reading_memory(/*parts=*/4),
                                  .stop = stop_token()});
  const std::uint64_t reading = reading_within_memory(*source, memory_bytes);
  PointTable table;
  table.info = source->info();
  const std::size_t bytes_per_point = sizeof(stream::Point3) + table.info.payload_size();
  const std::uint64_t fixed = kProgramMemory + reading;
  const std::uint64_t max_points = (memory_bytes - std::min(memory_bytes, fixed)) / bytes_per_point;
  // Rasters, PLY and meshes may have fewer points than announced.
  if (!table.info.grid && table.info.points && *table.info.points <= max_points) {
    table.positions.reserve(*table.info.points);
    table.payload.reserve(*table.info.points * table.info.payload_size());
  }
  UndeclaredVoids voids(source->info());
  for_each_block(*source, common, [&](stream::PointBlock& block) {
    voids.add(block);
    stream::to_world(table.info, block);
    // A growing vector briefly exists twice.
    const std::size_t count = table.size() + block.size();
    const bool grows = count > table.positions.capacity();
    if (count > (grows ? max_points / 2 : max_points)) {
      throw stream::Error(file,
                          fmt::format("has more points than {} can hold ({} so far)",
                                      readable_bytes(memory_bytes), with_commas(table.size())))
          .remedy("raise --memory, or build a store, which takes points of any number");
    }
    table.positions.insert(table.positions.end(), block.positions.begin(), block.positions.end());
    table.payload.insert(table.payload.end(), block.payload.begin(), block.payload.end());
  });
  table.nodata = source->progress().nodata;
  if (const stream::Message note = voids.note(); !note.empty()) common.say(note);
  if (table.nodata > 0 && !table.info.grid) {
    common.context().say(counted(table.nodata, "point") +
                         " without a coordinate are left out: point numbers do not count them");
  }
  if (table.positions.empty()) {
    throw stream::Error(file, "it contains no points").remedy("check the file");
  }
  return table;
}

GroundFrame GroundFrame::of(const PointTable& table, double z_weight) {
  stream::Box3 box;
  for (const stream::Point3& p : table.positions) box.include(p);
  // The positions are already in the CRS.
  stream::Placement placement;
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
