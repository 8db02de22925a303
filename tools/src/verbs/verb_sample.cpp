// SPDX-License-Identifier: GPL-3.0-or-later
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/stream/sink.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "cli/store_options.hpp"
#include "sample/sample_run.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class SampleCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    surface_.define(app);
    app.add_option(
           "--points", points_,
           "CSV of places, one per line; columns by name (x,y; lon,lat; longitude,latitude; "
           "easting,northing), otherwise the first two; - is standard input")
        ->capture_default_str()
        ->type_name("FILE");
    app.add_option("-o,--output", output_,
                   "the lines, each followed by height, gradient (rise per run), slope and aspect "
                   "(degrees; aspect clockwise from north, downhill); empty where there is "
                   "no data")
        ->capture_default_str()
        ->type_name("FILE");
    crs_.define(app, "--points-crs", "the places and focuses");
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kSampleTable, output_);
    check_input_name(outputs::kPlaceTable, points_);
    const Stopwatch watch;
    SamplerOptions options;
    const stream::Store store = surface_.open(options);
    const Detail detail = surface_.detail(store, crs_, common);
    options.level = detail.level;
    options.focuses = detail.focuses;
    const PlaceConversions conversions = conversions_for(store, common);
    PlaceFile places(points_, stop_token());
    stream::Sink output(output_, may_replace(output_, common.force), stop_token());
    const SampleCounts counts = answer_places(
        store, options, places, conversions, [&](std::string_view text) { output.write(text); },
        common.context());
    output.commit();
    if (counts.points > 0 && counts.answered == 0) {
      common.say(
          "no point has a height: are their coordinates in the CRS of the store? Else give "
          "--points-crs");
    }

    Summary summary;
    summary.json = {{"points", counts.points},
                    {"answered", counts.answered},
                    {"seconds", watch.seconds()},
                    {"points_per_second", static_cast<double>(counts.points) / watch.seconds()},
                    {"peak_rss_bytes", peak_rss_bytes()}};
    summary.text =
        fmt::format("{}, {} of them without a height, in {}, {}\n", counted(counts.points, "point"),
                    with_commas(counts.points - counts.answered), readable_seconds(watch.seconds()),
                    readable_rate(static_cast<double>(counts.points) / watch.seconds()));
    surface_.report(detail, summary);
    return summary;
  }

 private:
  /// Returns the conversions of the places to the store's CRS and to that of the output.
  [[nodiscard]] PlaceConversions conversions_for(const stream::Store& store,
                                                 const CommonOptions& common) const {
    PlaceConversions conversions;
    const std::optional<Transformation> input = crs_.from_store_to_input(store, common);
    if (input) {
      conversions.most_latitude = input->to().most_latitude();
      conversions.to_store = [input](std::span<Point2> places) { input->reverse(places); };
    } else if (const auto system =
                   CoordinateSystem::of(store.schema().crs, store.path().string())) {
      conversions.most_latitude = system->most_latitude();
    }
    if (const auto output = crs_.from_input_to_output(store, common, input)) {
      conversions.writes_degrees = output->to().is_geographic();
      conversions.to_written = [output](std::span<Point2> places) { output->forward(places); };
    }
    return conversions;
  }

  SurfaceOptions surface_;
  CrsOptions crs_;
  std::string points_ = "-", output_ = "-";
};

}  // namespace

std::unique_ptr<Command> make_sample() { return std::make_unique<SampleCommand>(); }

}  // namespace terrace::tools
