// SPDX-License-Identifier: GPL-3.0-or-later
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>
#include <terrace/stream/sink.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "cli/store_options.hpp"
#include "sample/sample_run.hpp"
#include "terrace/terrain/crs.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {
namespace {

class SampleCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    surface_.define(app);
    app.add_option("--points", points_,
                   "CSV of places, one a line; columns by name (x,y; lon,lat; longitude,latitude; "
                   "easting,northing) or else the first two; - is standard input")
        ->capture_default_str()
        ->type_name("FILE");
    app.add_option("-o,--output", output_,
                   "the lines again, with height, gradient (rise per run), slope and aspect "
                   "(degrees; aspect clockwise from north, downhill) behind; empty where there is "
                   "no data")
        ->capture_default_str()
        ->type_name("FILE");
    app.add_option("--points-crs", points_crs_,
                   "the CRS of the places (EPSG:n or a WKT file; x,y is lon,lat), if it is not the "
                   "store's");
    app.add_option("--to-crs", to_crs_, "the CRS of the places in what is written");
    app.add_option(
        "--towgs84", shift_,
        "dx,dy,dz[,rx,ry,rz,ds] to WGS 84 from the datum of such a CRS, or of the store, "
        "if it is another");
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    SamplerOptions options;
    const stream::Store store = surface_.open(options);
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
    summary.text = with_commas(counts.points) + " points, " +
                   with_commas(counts.points - counts.answered) + " of them without a height, in " +
                   readable_seconds(watch.seconds()) + ", " +
                   readable_rate(static_cast<double>(counts.points) / watch.seconds()) + "\n";
    return summary;
  }

 private:
  [[nodiscard]] PlaceConversions conversions_for(const stream::Store& store,
                                                 const CommonOptions& common) const {
    PlaceConversions conversions;
    std::optional<CoordinateSystem> from;
    if (!points_crs_.empty()) {
      const Transformation change =
          transformation_to(store, points_crs_, parse_datum_shift(shift_));
      if (!change.note().empty()) common.say(change.note());
      conversions.to_store = [change](std::span<Point2> here) { change.reverse(here); };
      from = change.to();
    }
    if (!to_crs_.empty()) {
      Transformation change = transformation_to(store, to_crs_, parse_datum_shift(shift_));
      conversions.writes_degrees = change.to().is_geographic();
      if (from) change = Transformation(*from, change.to());
      if (!change.note().empty()) common.say(change.note());
      conversions.to_written = [change](std::span<Point2> here) { change.forward(here); };
    }
    return conversions;
  }

  SurfaceOptions surface_;
  std::string points_ = "-", output_ = "-", points_crs_, to_crs_, shift_;
};

}  // namespace

std::unique_ptr<Command> make_sample() { return std::make_unique<SampleCommand>(); }

}  // namespace terrace::tools
