// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <terrace/stream/sink.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/choices.hpp"
#include "cli/crs_options.hpp"
#include "cli/detail_options.hpp"
#include "cli/interrupt.hpp"
#include "cli/line_option.hpp"
#include "cli/output.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/profile.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class ProfileCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", store_, "where the heights come from")->required();
    add_output(app, output_,
               "CSV: distance (metres along the line), x, y, height; - is standard output");
    app.add_option("--line", line_, "x1,y1,x2,y2[,...] or a GeoJSON file with one LineString")
        ->required()
        ->type_name("LINE");
    app.add_option("--line-crs", line_crs_,
                   "the CRS of the line's places (EPSG:n or a WKT file; x,y is lon,lat), if it is "
                   "not the store's; between them the line is straight in the store's");
    app.add_option(
        "--towgs84", shift_,
        "dx,dy,dz[,rx,ry,rz,ds] to WGS 84 from the datum of --line-crs, or of the store, "
        "if it is another");
    add_number(app, "--step", step_,
               "metres from row to row (default: a row wherever the line crosses the lattice "
               "or a diagonal of it, or an edge of the triangulated points)",
               kAboveZero)
        ->type_name("METRES");
    app.add_option("--method", method_, "linear, natural or nearest")
        ->capture_default_str()
        ->type_name("NAME");
    add_number(app, "--max-edge", max_edge_,
               "of irregular points and coarser levels: triangles with a longer side (metres on "
               "the ground) are no data, as over water and in shadows (default: none)",
               kAboveZero)
        ->type_name("METRES");
    app.add_option("--level", level_, "only points of this level and above: a number or top")
        ->capture_default_str();
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    ProfileRequest request;
    request.sampler.method = parse_interpolation(method_);
    request.sampler.max_edge = max_edge_;
    const std::optional<unsigned> level = parse_level(level_);
    request.step = step_;
    request.line = parse_line(line_);
    const stream::Store store = open_store(store_);
    if (!line_crs_.empty()) {
      const Transformation change = transformation_to(store, line_crs_, parse_datum_shift(shift_));
      if (!change.note().empty()) common.say(change.note());
      change.reverse(request.line);
    }
    request.sampler.level = level.value_or(store.top());
    stream::Sink output(output_, may_replace(output_, common.force), stop_token());
    const ProfileOutcome outcome = write_profile(
        store, request, [&](std::string_view text) { output.write(text); }, common.context());
    output.commit();
    if (outcome.answered == 0) common.say("the line does not meet the store's data");

    Summary summary;
    summary.json = {{"points", outcome.points},
                    {"answered", outcome.answered},
                    {"metres", outcome.metres},
                    {"seconds", watch.seconds()},
                    {"peak_rss_bytes", peak_rss_bytes()}};
    summary.text = output_ + ": " + with_commas(outcome.points) + " places on " +
                   readable_number(outcome.metres, 6) + " m in " +
                   readable_seconds(watch.seconds()) + "\n";
    return summary;
  }

 private:
  std::string store_, output_, line_, line_crs_, shift_, method_ = "linear", level_ = "0";
  std::optional<double> step_, max_edge_;
};

}  // namespace

std::unique_ptr<Command> make_profile() { return std::make_unique<ProfileCommand>(); }

}  // namespace terrace::tools
