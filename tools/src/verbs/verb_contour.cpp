// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <terrace/stream/sink.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/crs_options.hpp"
#include "cli/detail_options.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "terrace/terrain/contours.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class ContourCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", store_, "where the heights come from")->required();
    add_output(
        app, output_,
        "GeoJSON: lines in longitude and latitude, elev is the height; - is standard output");
    add_number(app, "--interval", interval_,
               "height from line to line, in the store's vertical unit: lines at its multiples",
               kAboveZero)
        ->required()
        ->type_name("HEIGHT");
    app.add_option("--region", region_,
                   "only what is inside: minx,miny,maxx,maxy or a GeoJSON file");
    app.add_option("--level", level_, "only points of this level and above: a number or top")
        ->capture_default_str();
    add_number(app, "--max-edge", max_edge_,
               "of points: triangles with a longer side, on the ground, are no data (default: "
               "none is too long)",
               kAboveZero)
        ->type_name("METRES");
    crs_.define_region(app);
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    ContourRequest request;
    request.interval = *interval_;  // required
    const std::optional<unsigned> level = parse_level(level_);
    request.max_edge = max_edge_;
    const stream::Store store = open_store(store_);
    if (!region_.empty()) request.region = crs_.regions(store, common)(Region::parse(region_));
    if (const std::string note = system_of(store).wgs84_note(); !note.empty()) common.say(note);
    request.level = level.value_or(store.top());
    stream::Sink output(output_, may_replace(output_, common.force), stop_token());
    const ContourOutcome outcome = write_contours(
        store, request, [&](std::string_view text) { output.write(text); }, common.context());
    output.commit();

    Summary summary;
    summary.json = {{"lines", outcome.lines},
                    {"closed", outcome.closed},
                    {"points", outcome.points},
                    {"seconds", watch.seconds()},
                    {"peak_rss_bytes", peak_rss_bytes()}};
    summary.text = output_ + ": " + with_commas(outcome.lines) + " lines, " +
                   with_commas(outcome.closed) + " of them closed, " + with_commas(outcome.points) +
                   " points in " + readable_seconds(watch.seconds()) + "\n";
    return summary;
  }

 private:
  std::string store_, output_, region_, level_ = "0";
  std::optional<double> interval_, max_edge_;
  CrsOptions crs_;
};

}  // namespace

std::unique_ptr<Command> make_contour() { return std::make_unique<ContourCommand>(); }

}  // namespace terrace::tools
