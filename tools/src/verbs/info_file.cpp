// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <utility>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_names.hpp"
#include "cli/terminal.hpp"
#include "earth/crs/crs_definition.hpp"
#include "earth/source_crs.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/error.hpp"
#include "verbs/info.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// The sum of a long stream of doubles: without the compensation the mean of a billion heights
/// would be off in its last digits (A. Neumaier 1974, doi:10.1002/zamm.19740540106).
class Sum {
 public:
  void add(double value) {
    const double sum = sum_ + value;
    rest_ += std::abs(sum_) >= std::abs(value) ? (sum_ - sum) + value : (value - sum) + sum_;
    sum_ = sum;
  }
  [[nodiscard]] double value() const { return sum_ + rest_; }

 private:
  double sum_ = 0, rest_ = 0;
};

struct Contents {
  std::uint64_t points = 0, nodata = 0, withheld = 0;
  stream::Box3 stored, world;
  double mean = 0;  ///< stored coordinate 2
};

Contents stream_through(stream::PointSource& source, const CommonOptions& common) {
  const stream::SourceInfo& info = source.info();
  const stream::Placement& placement = info;
  // Without rotation the box in the CRS is that of the stored box: no point need be transformed.
  const bool upright = info.world.xy[1] == 0 && info.world.xy[3] == 0;
  Contents contents;
  Sum heights;
  ProgressMeter meter(common.progress, "points");
  stream::PointBlock block;
  while (source.next(block)) {
    check_interrupt();
    for (const stream::Point3& p : block.positions) {
      contents.stored.include(p);
      heights.add(p[2]);
      if (!upright) contents.world.include(world_point(placement, p));
    }
    contents.points += block.size();
    const stream::Progress progress = source.progress();
    meter.update(progress.points, progress.fraction);
  }
  contents.nodata = source.progress().nodata;
  contents.withheld = source.progress().withheld;
  if (upright) contents.world = world_box(placement, contents.stored);
  if (contents.points > 0) contents.mean = heights.value() / static_cast<double>(contents.points);
  return contents;
}

std::uint64_t bytes_of(const std::vector<std::string>& files) {
  std::uint64_t bytes = 0;
  for (const std::string& file : files) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (!error) bytes += size;
  }
  return bytes;
}

}  // namespace

Summary info_of_file(const std::string& path, stream::HeightsOfColour colours,
                     const CommonOptions& common) {
  const std::array<std::string, 1> files{path};
  const std::unique_ptr<stream::PointSource> source =
      stream::open_source(files, {.memory_bytes = common.reading_memory(),
                                  .heights_of_colour = colours,
                                  .stop = stop_token(),
                                  .blocks_ahead = 8,
                                  .threads = common.threads});
  reading_within_memory(*source, common.memory_or(0));
  const Contents contents = stream_through(*source, common);
  const stream::SourceInfo& info = source->info();
  SourceCrs crs;
  try {
    crs = crs_of_source(info);
  } catch (const stream::Error& error) {
    // What a build would refuse is told, with the rest of the file.
    crs.crs = info.crs;
    crs.note = error.what();
  }
  const stream::Channel& z = info.coordinates[2];
  const auto real = [&z](double raw) { return raw * z.scale + z.offset; };

  Summary summary;
  summary.text_is_result = true;
  nlohmann::ordered_json& json = summary.json;
  json["format"] = info.format;
  json["version"] = nullptr;
  json["points"] = contents.points;
  json["nodata"] = contents.nodata;
  if (contents.withheld > 0) json["withheld"] = contents.withheld;
  if (info.octree) {
    json["octree"] = {{"spacing", info.octree->spacing},
                      {"depths", info.octree->depths},
                      {"nodes", info.octree->nodes}};
  }
  json["levels"] = nlohmann::ordered_json::array();
  json["bounds"] = json_of(contents.world);
  json["crs"] = json_of(crs.crs);
  json["vertical"] = crs.heights == Heights::unknown ? nlohmann::ordered_json(nullptr)
                                                     : nlohmann::ordered_json(name_of(crs.heights));
  if (info.grid) {
    json["columns"] = info.columns;
    json["rows"] = info.rows;
    json["transform"] = info.world.xy;
    json["nodata_value"] =
        info.nodata ? nlohmann::ordered_json(*info.nodata) : nlohmann::ordered_json(nullptr);
  } else if (info.world != stream::WorldTransform{}) {
    json["transform"] = info.world.xy;
  }
  json["height"] = nullptr;
  if (contents.points > 0) {
    const double low = real(contents.stored.min[2]), high = real(contents.stored.max[2]);
    json["height"] = {
        {"min", std::min(low, high)}, {"max", std::max(low, high)}, {"mean", real(contents.mean)}};
  }
  json["channels"] = nlohmann::ordered_json::array();
  for (const stream::Channel& channel : info.coordinates)
    json["channels"].push_back(json_of(channel));
  for (const stream::Channel& channel : info.attributes)
    json["channels"].push_back(json_of(channel));
  json["parameters"] = nlohmann::ordered_json::object();
  json["comments"] = info.comments;
  json["bytes"] = bytes_of(info.files);

  std::string& text = summary.text;
  text += "format:    " + info.format + ", " + readable_bytes(bytes_of(info.files)) + '\n';
  if (info.grid) {
    text += "raster:    " + std::to_string(info.columns) + " x " + std::to_string(info.rows) +
            " cells of " + text_of(z) + '\n';
    text += "cell:      " + readable_number(info.world.xy[0], 10) + ' ' +
            readable_number(info.world.xy[4], 10) + '\n';
    text += "nodata:    " + with_commas(contents.nodata) + " cells" +
            (info.nodata ? ", value " + number_text(*info.nodata) : std::string()) + '\n';
  }
  text += "points:    " + with_commas(contents.points) + '\n';
  if (info.octree) {
    text += "octree:    " + with_commas(info.octree->nodes) + " nodes of " +
            std::to_string(info.octree->depths) + " depths, the root's points " +
            readable_number(info.octree->spacing, 6) + " apart\n";
  }
  if (contents.withheld > 0) {
    text += "withheld:  " + with_commas(contents.withheld) + " of them\n";
  }
  text += "crs:       " + printable_line(text_of(crs.crs, contents.world)) + '\n';
  if (!crs.note.empty()) text += "note:      " + printable_line(with_option_names(crs.note)) + '\n';
  if (crs.heights != Heights::unknown) text += "vertical:  " + name_of(crs.heights) + '\n';
  text += "bounds:    " + text_of(contents.world) + '\n';
  if (contents.points > 0) {
    text += "heights:   " + readable_number(json["height"]["min"].get<double>(), 6) + " to " +
            readable_number(json["height"]["max"].get<double>(), 6) + ", mean " +
            readable_number(json["height"]["mean"].get<double>(), 6) + '\n';
  }
  text += "channels: ";
  for (const stream::Channel& channel : info.coordinates)
    text += ' ' + printable_line(text_of(channel)) + ',';
  for (const stream::Channel& channel : info.attributes)
    text += ' ' + printable_line(text_of(channel)) + ',';
  text.back() = '\n';
  for (const std::string& comment : info.comments)
    text += "comment:   " + printable_line(comment) + '\n';
  return summary;
}

}  // namespace terrace::tools
