// SPDX-License-Identifier: GPL-3.0-or-later
// convert: a stream of points from one format to another.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/base/ordered_work.hpp>

#include "base/units.hpp"
#include "build/damage_report.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "cli/selection_options.hpp"
#include "earth/crs/definition.hpp"
#include "earth/source_crs.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/stream/source.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "terrace/terrain/point_file_crs.hpp"
#include "terrace/terrain/undeclared_voids.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class ConvertCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option(
           "INPUT", inputs_,
           "files of points or cells, one after another (rasters form a mosaic); a folder of them, "
           "@FILE with one name per line, or a quoted pattern; - is standard input")
        ->required();
    add_output(app, output_, "the file to write; - is standard output");
    add_point_format(app, format_);
    add_input_format(app, input_format_);
    selection_.define(app);
    add_skip_damaged(app, skip_damaged_);
    add_rgb_encoding(app, colours_);
    add_source_cell_size(app, cell_);
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kPointFile, output_, format_);
    const Stopwatch watch;
    stream::WriterOptions writing = point_writer_options(output_, format_, common);
    stream::SourceOptions reading{.format = input_format_,
                                  .memory_bytes = common.reading_memory(),
                                  .heights_of_colour = colours_,
                                  .cell = cell_.value_or(0),
                                  .same_crs = &terrain::same_crs,
                                  .stop = stop_token(),
                                  .blocks_ahead = 8,
                                  .threads = common.threads};
    reading.selection = selection_.selection(inputs_, reading, std::nullopt, common);
    DamageReport damage;
    if (skip_damaged_) reading.on_damage = damage.handler();
    const std::unique_ptr<stream::PointSource> source = stream::open_source(inputs_, reading);
    const std::uint64_t memory = common.memory_or(0);
    const std::uint64_t reading_bytes = reading_within_memory(*source, memory);
    writing.memory_bytes -= std::min(writing.memory_bytes, reading_bytes);
    const stream::SourceInfo& info = source->info();
    const auto writer = stream::open_point_writer(
        output_,
        {.attributes = info.attributes,
         .comments = {kWriterMark},
         .crs =
             [&info] {
               const LocatedSource located = with_source_crs(info);
               return crs_of_point_file(located.placement, std::nullopt, name_of(located.heights));
             },
         .units = [&info] { return units_of_point_file(with_source_crs(info).placement); },
         .lattice = lattice_of(info)},
        writing);
    writing_within_memory(*writer, output_, memory, reading_bytes);
    UndeclaredVoids voids(info);
    const unsigned threads =
        threads_within(memory - std::min(memory, reading_bytes + writer->writing_bytes()),
                       reading.block_points * (24 + info.payload_size()), common);
    convert(*source, *writer, voids, threads, common);
    if (writer->points() == 0 && selection_.selects()) {
      throw stream::Error(inputs_.front(),
                          "none of its " + examined_text(source->progress()) + "points is selected")
          .remedy("give another --where or --region");
    }
    writer->finish();
    if (writer->points() == 0) common.say(inputs_.front() + ": contains no points");
    const std::string unit_note =
        lost_height_unit(output_, *writer, with_source_crs(info).placement);
    if (!unit_note.empty()) common.say(unit_note);
    note_spooled(info, common.context());
    if (!info.note.empty()) common.say(info.note);
    if (const stream::Message note = voids.note(); !note.empty()) common.say(note);
    damage.note(common.context());

    Summary summary = summary_of(source->progress(), writer->points(), info.grid, watch);
    report_rounding(*writer, summary);
    return summary;
  }

 private:
  /// Returns the number of threads whose blocks fit into `memory` bytes besides the program itself.
  /// Each thread holds one block as read and one as encoded, both with some room to grow.
  static unsigned threads_within(std::uint64_t memory, std::uint64_t block_bytes,
                                 const CommonOptions& common) {
    const std::uint64_t available = memory - std::min(memory, kProgramMemory);
    return static_cast<unsigned>(
        std::clamp<std::uint64_t>(available / (5 * block_bytes), 1, common.threads));
  }

  /// Copies all points from the source to the writer, in order. Blocks are encoded in parallel.
  static void convert(stream::PointSource& source, stream::PointWriter& writer,
                      UndeclaredVoids& voids, unsigned threads, const CommonOptions& common) {
    ProgressMeter meter(common.progress, "points");
    std::vector<stream::PointBlock> blocks(threads);
    base::each_in_order(
        threads,
        [&](unsigned worker) -> std::optional<stream::PointBlock*> {
          check_interrupt();
          if (!source.next(blocks[worker])) return {};
          meter.update(source.progress().points, source.progress().fraction);
          return &blocks[worker];
        },
        [&](unsigned, stream::PointBlock* block) {
          voids.add(*block);
          stream::to_world(source.info(), *block);
          return writer.encode(*block);
        },
        [&](stream::PointWriter::EncodedPtr points) { writer.append(std::move(points)); });
  }

  [[nodiscard]] Summary summary_of(const stream::Progress& progress, std::uint64_t points,
                                   bool raster, const Stopwatch& watch) const {
    Summary summary;
    summary.json = {{"points", points},
                    {"nodata", progress.nodata},
                    {"empty_values", progress.empty_values},
                    {"excluded", progress.excluded},
                    {"lost", progress.lost}};
    summary.add_cost(watch);
    std::string remarks;
    if (progress.excluded > 0) {
      remarks = with_commas(progress.excluded) + (progress.excluded == 1 ? " was" : " were") +
                " not selected";
    }
    if (progress.nodata > 0 && !raster) {
      remarks +=
          (remarks.empty() ? "" : ", ") + with_commas(progress.nodata) + " lacked a coordinate";
    }
    if (progress.empty_values > 0) {
      remarks += (remarks.empty() ? "" : ", ") + counted(progress.empty_values, "attribute") +
                 " without a value are NaN";
    }
    summary.text = fmt::format("{}: {}{}, {}\n", output_, counted(points, "point"),
                               remarks.empty() ? "" : fmt::format(" ({})", remarks),
                               readable_seconds(watch.seconds()));
    return summary;
  }

  /// Returns the number of points examined, such as "1,234 ". It is empty if none were, because
  /// parts outside the region are not read.
  static std::string examined_text(const stream::Progress& progress) {
    return progress.excluded > 0 ? with_commas(progress.excluded) + ' ' : std::string();
  }

  /// The placement of a source, and what its heights refer to.
  struct LocatedSource {
    stream::Placement placement;
    Heights heights = Heights::unknown;
  };

  /// Takes the CRS from the file or from the .prj file next to it.
  static LocatedSource with_source_crs(const stream::SourceInfo& info) {
    LocatedSource located{.placement = info};
    try {
      const SourceCrs crs = crs_of_source(info);
      located = {.placement = info, .heights = crs.heights};
      located.placement.crs = crs.crs;
    } catch (const terrain::CrsDatabaseError&) {
      throw;
    } catch (const stream::Error&) {
      // The output repeats the file's own description.
    }
    return located;
  }

  std::vector<std::string> inputs_;
  std::string output_, format_, input_format_;
  SelectionOptions selection_;
  stream::HeightsOfColour colours_ = stream::HeightsOfColour::none;
  std::optional<double> cell_;
  bool skip_damaged_ = false;
};

}  // namespace

std::unique_ptr<Command> make_convert() { return std::make_unique<ConvertCommand>(); }

}  // namespace terrace::tools
