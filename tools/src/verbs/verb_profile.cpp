// SPDX-License-Identifier: GPL-3.0-or-later
// profile: the heights along a line.
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/stream/sink.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/output.hpp"
#include "cli/store_options.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "terrace/terrain/profile.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class ProfileCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    surface_.define(app);
    add_output(app, output_,
               "CSV: distance (metres along the line), x, y, height; - is standard output");
    app.add_option("--line", line_,
                   "x1,y1,x2,y2[,...] or a GeoJSON file with one LineString; segments are "
                   "straight in the store's CRS")
        ->required()
        ->type_name("LINE");
    crs_.define_input(app, "--line-crs", "the line and focuses");
    add_number(app, "--step", step_,
               "metres between rows (default: a row at each grid line, cell diagonal or triangle "
               "edge that the line crosses)",
               kPositive)
        ->type_name("METRES");
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kProfileTable, output_);
    const Stopwatch watch;
    ProfileRequest request;
    request.step = step_;
    Line line = parse_line(line_);
    request.line = std::move(line.places);
    const stream::Store store = surface_.open(request.sampler);
    const Detail detail = surface_.detail(store, crs_, common);
    request.sampler.level = detail.level;
    request.sampler.focuses = detail.focuses;
    request.to_line = crs_.from_store_to_input(store, common);
    if (!request.to_line && line.crs) {
      stream::Box3 box;
      for (const Point2& p : request.line) box.include(stream::Point3{p[0], p[1], 0});
      request.to_line = crs_.regions(store, common).to_places(*line.crs, box);
    }
    stream::Sink output(output_, may_replace(output_, common.force), stop_token());
    const ProfileOutcome outcome = write_profile(
        store, request, [&](std::string_view text) { output.write(text); }, common.context());
    output.commit();
    if (outcome.answered == 0) common.say("the line does not cross any data of the store");

    Summary summary;
    summary.json = {
        {"points", outcome.points}, {"answered", outcome.answered}, {"metres", outcome.metres}};
    summary.add_cost(watch);
    summary.text =
        fmt::format("{}: {} along {} m in {}\n", output_, counted(outcome.points, "point"),
                    readable_number(outcome.metres, 6), readable_seconds(watch.seconds()));
    surface_.report(detail, summary);
    return summary;
  }

 private:
  SurfaceOptions surface_;
  CrsOptions crs_;
  std::string output_, line_;
  std::optional<double> step_;
};

}  // namespace

std::unique_ptr<Command> make_profile() { return std::make_unique<ProfileCommand>(); }

}  // namespace terrace::tools
