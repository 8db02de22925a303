// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <terrace/stream/sink.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/output.hpp"
#include "cli/store_options.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/profile.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {
namespace {

class ProfileCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    surface_.define(app);
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
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    ProfileRequest request;
    request.step = step_;
    request.line = parse_line(line_);
    const stream::Store store = surface_.open(request.sampler);
    if (!line_crs_.empty()) {
      const Transformation change = transformation_to(store, line_crs_, parse_datum_shift(shift_));
      if (!change.note().empty()) common.say(change.note());
      change.reverse(request.line);
    }
    stream::Sink output(output_, may_replace(output_, common.force), stop_token());
    const ProfileOutcome outcome = write_profile(
        store, request, [&](std::string_view text) { output.write(text); }, common.context());
    output.commit();
    if (outcome.answered == 0) common.say("the line does not meet the store's data");

    Summary summary;
    summary.json = {
        {"points", outcome.points}, {"answered", outcome.answered}, {"metres", outcome.metres}};
    summary.add_cost(watch);
    summary.text = output_ + ": " + with_commas(outcome.points) + " places on " +
                   readable_number(outcome.metres, 6) + " m in " +
                   readable_seconds(watch.seconds()) + "\n";
    return summary;
  }

 private:
  SurfaceOptions surface_;
  std::string output_, line_, line_crs_, shift_;
  std::optional<double> step_;
};

}  // namespace

std::unique_ptr<Command> make_profile() { return std::make_unique<ProfileCommand>(); }

}  // namespace terrace::tools
