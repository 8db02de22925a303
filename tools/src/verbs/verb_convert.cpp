// SPDX-License-Identifier: GPL-3.0-or-later
// convert: a stream of points from one format to another.
#include <array>
#include <memory>
#include <utility>

#include <CLI/CLI.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/stream/source.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class ConvertCommand : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("input", input_, "File of points or cells; - is standard input")
        ->required()
        ->type_name("FILE");
    add_output(app, output_, "The file to write; - is standard output");
    app.add_option("--format", format_, "Of the output: xyz, csv, ply, ply-ascii (else its ending)")
        ->type_name("NAME");
    app.add_option("--input-format", input_format_, "Of the input (else its content, its ending)")
        ->type_name("NAME");
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    const bool replace = may_replace(output_, common.force);
    const std::array<std::string, 1> files{input_};
    const std::unique_ptr<stream::PointSource> source = stream::open_source(
        files, {.format = input_format_, .stop = stop_token(), .blocks_ahead = 8});
    reading_within_memory(*source, common.memory_or(0));
    const stream::SourceInfo& info = source->info();
    const auto writer = stream::open_point_writer(
        output_, {.attributes = info.attributes, .comments = {kWriterMark}},
        {.format = format_, .replace = replace, .stop = stop_token()});
    {
      ProgressMeter meter(common.progress, "points");
      stream::PointBlock block;
      while (source->next(block)) {
        check_interrupt();
        stream::to_world(info, block);
        writer->append(block);
        const stream::Progress progress = source->progress();
        meter.update(progress.points, progress.fraction);
      }
    }
    writer->finish();

    Summary summary;
    summary.json = {{"points", writer->points()},
                    {"nodata", source->progress().nodata},
                    {"seconds", watch.seconds()},
                    {"peak_rss_bytes", peak_rss_bytes()}};
    summary.text = output_ + ": " + with_commas(writer->points()) + " points, " +
                   readable_seconds(watch.seconds()) + '\n';
    return summary;
  }

 private:
  std::string input_, output_, format_, input_format_;
};

}  // namespace

std::unique_ptr<Command> make_convert() { return std::make_unique<ConvertCommand>(); }

}  // namespace terrace::tools
