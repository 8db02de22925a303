// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/stream/overlay.hpp>
#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/sink.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/output.hpp"
#include "cli/selection_options.hpp"
#include "cli/store_options.hpp"
#include "earth/whole_turns.hpp"
#include "tables/point_table.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/detail_lines.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/detail_points.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/near_points.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "terrace/terrain/point_file_crs.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class PointsCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    part_.define(app, "only points inside");
    add_output(app, output_,
               "the file to write: .xyz, .csv, .ply, .las, .laz, .copc.laz, and .geojson for the "
               "lines of build --entities; - is standard output");
    app.add_option(
        "--format", format_,
        "xyz, csv, ply, ply-ascii, las, laz, copc or geojson (default: from the ending)");
    app.add_option("--near", near_,
                   "X,Y[,Z] in the store's CRS: the points near this place, nearest first, with "
                   "their distance in metres on the ground; without Z, heights do not count")
        ->excludes("--region")
        ->excludes("--focus");
    app.add_option("-k", count_, "with --near: the number of points")
        ->check(CLI::Range(1U, 4294967295U))
        ->type_name("K")
        ->needs("--near");
    app.add_option("--within", radius_, "with --near: all points up to this distance, in metres")
        ->needs("--near")
        ->excludes("-k");
    part_.define_cluster(app, "the points of --level (default: L) that it represents")
        ->excludes("--near");
    app.add_option("--overlay", overlay_,
                   "a file from mesh --save-overlay: use its heights instead of the store's")
        ->type_name("FILE")
        ->excludes("--near")
        ->excludes("--cluster");
  }

  Summary run(const CommonOptions& common) override {
    const std::string_view format = format_of_output(outputs::kPointOrLineFile, output_, format_);
    const Stopwatch watch;
    const stream::Store store = open_store(part_.path, part_.where);
    const Detail detail = part_.detail(store, common);
    if (!near_.empty()) return write_near_points(store, detail, watch, common);
    if (format == "geojson") {
      return write_lines(store, detail, watch, common);
    }
    std::optional<stream::Overlay> overlay;
    if (!overlay_.empty()) overlay.emplace(open_height_overlay(overlay_, store));
    const std::optional<Transformation> to = part_.crs.from_store_to_output(store, common);
    const auto writer =
        stream::open_point_writer(output_, header_of(store, store.schema().attributes, to),
                                  point_writer_options(output_, format_, common));
    writing_within_memory(*writer, output_, common.memory_or(0));
    report_lost_unit(*writer, store, to, common);
    const std::uint64_t replaced = write_points(store, detail, *writer, conversion_to(to),
                                                overlay ? &*overlay : nullptr, common.context());
    const std::uint64_t points = writer->points();
    if (points == 0) refuse_empty_selection(store, detail);
    writer->finish();

    Summary summary;
    summary.json = {{"vertices", points}, {"triangles", 0}};
    summary.add_cost(watch);
    summary.text = fmt::format("{}: {} in {}\n", output_, counted(points, "point"),
                               readable_seconds(watch.seconds()));
    report_rounding(*writer, summary);
    if (overlay) {
      summary.json["overlay_values"] = replaced;
      summary.text += fmt::format("{} from {}\n", counted(replaced, "height"), overlay_);
    }
    return summary;
  }

 private:
  /// Throws stream::Error if the options select no point of a store that has points.
  void refuse_empty_selection(const stream::Store& store, const Detail& detail) const {
    if (store.whole().points() == 0) return;
    if (detail.region) throw_none_inside(store);
    throw stream::Error(part_.path, fmt::format("no point is selected; all of the store's have {}",
                                                extent_text(store.whole())))
        .remedy("give another --where, --focus or --cluster");
  }

  static PlaceConversion conversion_to(const std::optional<Transformation>& to) {
    return to ? PlaceConversion(*to) : PlaceConversion();
  }

  /// Returns the CRS of the output if it is not the store's.
  static std::optional<stream::Crs> crs_of(const std::optional<Transformation>& to) {
    return to ? std::optional(to->to().crs()) : std::nullopt;
  }

  /// Prints a note if the file's format cannot record the unit of heights.
  void report_lost_unit(const stream::PointWriter& writer, const stream::Store& store,
                        const std::optional<Transformation>& to,
                        const CommonOptions& common) const {
    const std::string note = lost_height_unit(output_, writer, store.schema(), crs_of(to));
    if (!note.empty()) common.say(note);
  }

  /// Returns the header of a point file. Points in another CRS have neither the store's lattice nor
  /// its bounds.
  static stream::PointHeader header_of(const stream::Store& store,
                                       std::vector<stream::Channel> attributes,
                                       const std::optional<Transformation>& to) {
    stream::PointHeader header{
        .attributes = std::move(attributes),
        .comments = {kWriterMark},
        .crs =
            [&store, other = crs_of(to)] {
              return crs_of_point_file(store.schema(), other, store.schema().vertical);
            },
        .units = [&store,
                  other = crs_of(to)] { return units_of_point_file(store.schema(), other); }};
    if (!to) {
      header.lattice = lattice_of(store.schema());
      header.bounds = world_box(store.schema(), store.whole().bounds());
    }
    return header;
  }

  /// Writes the lines of a store of segments or polylines as GeoJSON.
  Summary write_lines(const stream::Store& store, const Detail& detail, const Stopwatch& watch,
                      const CommonOptions& common) const {
    if (!holds_lines(store.schema()) || !overlay_.empty()) {
      throw UsageError(
          "GeoJSON is for the lines of a store of segments or polylines, without --overlay; name "
          "another ending, e.g. .csv");
    }
    LineSet lines = detail_lines(store, detail, common.context());
    if (lines.lines.empty()) refuse_empty_selection(store, detail);
    const std::optional<Transformation> to = part_.crs.from_store_to_output(store, common);
    conversion_to(to)(lines.vertices, check_interrupt);
    stream::Sink file(output_, may_replace(output_, common.force), stop_token());
    write_geojson(lines, to ? to->to().crs() : store.schema().crs,
                  [&](std::string_view text) { file.write(text); });
    file.commit();
    Summary summary;
    summary.json = {{"lines", lines.lines.size()}, {"vertices", lines.vertices.size()}};
    summary.add_cost(watch);
    summary.text =
        fmt::format("{}: {} of {} in {}\n", output_, counted(lines.lines.size(), "line"),
                    counted(lines.vertices.size(), "vertex"), readable_seconds(watch.seconds()));
    return summary;
  }

  /// Writes the points near --near, nearest first, with their distances.
  Summary write_near_points(const stream::Store& store, const Detail& detail,
                            const Stopwatch& watch, const CommonOptions& common) const {
    const std::vector<double> xyz = parse_numbers(near_, "--near");
    if (xyz.size() != 2 && xyz.size() != 3) throw UsageError("--near needs X,Y or X,Y,Z");
    if (!count_ && !radius_) throw UsageError("--near needs -k or --within");
    NearPlace place{.xy = WholeTurns(store.schema(), store.whole().bounds())({xyz[0], xyz[1]})};
    if (xyz.size() == 3) place.z = xyz[2];
    stream::StoreQuery query(store);
    const std::vector<stream::FoundPoint> selected =
        count_ ? nearest_points(query, place, *count_, detail.level)
               : points_within(query, place, *radius_, detail.level);
    if (selected.empty() && store.whole().points() > 0) {
      throw stream::Error(part_.path,
                          "no point is selected " +
                              (radius_ ? "within " + plain_number(*radius_) + " m of " : "near ") +
                              near_)
          .remedy(radius_ ? "raise --within" : "give another --where");
    }
    const stream::Box3 box = world_box(store.schema(), store.whole().bounds());
    const auto& [x, y] = place.xy;
    if (!(x >= box.min[0] && x <= box.max[0] && y >= box.min[1] && y <= box.max[1])) {
      common.say(
          fmt::format("{} is outside the store: in its CRS X is from {} to {}, Y from {} to {}",
                      near_, plain_number(box.min[0]), plain_number(box.max[0]),
                      plain_number(box.min[1]), plain_number(box.max[1])));
    }
    std::vector<stream::Channel> attributes = store.schema().attributes;
    attributes.push_back({.name = "distance", .unit = "metre"});
    const std::optional<Transformation> to = part_.crs.from_store_to_output(store, common);
    const auto writer =
        stream::open_point_writer(output_, header_of(store, std::move(attributes), to),
                                  point_writer_options(output_, format_, common));
    writing_within_memory(*writer, output_, common.memory_or(0));
    report_lost_unit(*writer, store, to, common);
    write_found_points(query, selected, *writer, conversion_to(to));
    writer->finish();
    Summary summary;
    summary.json = {{"vertices", selected.size()}, {"triangles", 0}};
    summary.add_cost(watch);
    summary.text = output_ + ": " + counted(selected.size(), "point");
    if (!selected.empty()) {
      summary.json["nearest_metres"] = selected.front().distance;
      summary.json["farthest_metres"] = selected.back().distance;
      summary.text += fmt::format(", {} to {} m away", readable_number(selected.front().distance),
                                  readable_number(selected.back().distance));
    }
    summary.text += fmt::format(", in {}\n", readable_seconds(watch.seconds()));
    report_rounding(*writer, summary);
    return summary;
  }

  PartOptions part_;
  std::string output_, format_, overlay_, near_;
  std::optional<std::size_t> count_;
  std::optional<double> radius_;
};

}  // namespace

std::unique_ptr<Command> make_points() { return std::make_unique<PointsCommand>(); }

}  // namespace terrace::tools
