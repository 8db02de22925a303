// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/stream/sink.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "cli/store_options.hpp"
#include "terrace/terrain/contours.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class ContourCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    surface_.define_triangles(app);
    add_output(app, output_,
               "GeoJSON file of lines in longitude and latitude with the height as `elev`; - is "
               "standard output");
    add_number(app, "--interval", interval_,
               "contour interval in the store's vertical unit; lines are at its multiples",
               kPositive)
        ->required()
        ->type_name("HEIGHT");
    app.add_option("--region", region_,
                   "only inside this area: minx,miny,maxx,maxy or a GeoJSON file");
    app.add_flag("--own-crs", request_.own_crs,
                 "write x and y of the store's CRS, which may be unknown, instead of longitude and "
                 "latitude");
    crs_.define_input(app);
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kContourFile, output_);
    const Stopwatch watch;
    ContourRequest request = request_;
    request.interval = *interval_;  // required
    SamplerOptions sampler;
    const stream::Store store = surface_.open(sampler);
    const Detail detail = surface_.detail(store, crs_, common, region_);
    request.level = detail.level;
    request.focuses = detail.focuses;
    request.max_error = sampler.max_error;
    request.max_edge = sampler.max_edge;
    request.region = detail.region;
    stream::Sink output(output_, may_replace(output_, common.force), stop_token());
    const ContourOutcome outcome = write_contours(
        store, request, [&](std::string_view text) { output.write(text); }, common.context());
    output.commit();
    if (!request.own_crs) {
      if (const std::string note = system_of(store).wgs84_note(); !note.empty()) common.say(note);
    }

    Summary summary;
    summary.json = {
        {"lines", outcome.lines}, {"closed", outcome.closed}, {"points", outcome.points}};
    summary.add_cost(watch);
    summary.text = fmt::format("{}: {}, {} of them closed, {} in {}\n", output_,
                               counted(outcome.lines, "line"), with_commas(outcome.closed),
                               counted(outcome.points, "point"), readable_seconds(watch.seconds()));
    surface_.report(detail, summary);
    return summary;
  }

 private:
  ContourRequest request_;
  SurfaceOptions surface_;
  std::string output_, region_;
  std::optional<double> interval_;
  CrsOptions crs_;
};

}  // namespace

std::unique_ptr<Command> make_contour() { return std::make_unique<ContourCommand>(); }

}  // namespace terrace::tools
