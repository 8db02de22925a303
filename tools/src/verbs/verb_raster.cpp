// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/choices.hpp"
#include "cli/crs_options.hpp"
#include "cli/detail_options.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/raster.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class RasterCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", store_, "where the heights come from")->required();
    add_output(app, output_, "the Cloud Optimized GeoTIFF to write");
    app.add_option("--value", value_,
                   "height; slope in degrees; aspect in degrees clockwise from north, downhill; "
                   "hillshade, 1 to 255")
        ->capture_default_str()
        ->type_name("NAME");
    add_number(app, "--cell", cell_,
               "width and height of a cell in units of the output's CRS (default: the "
               "raster's own cells; of points and of coarser levels, about as many cells as "
               "there are points)",
               kAboveZero)
        ->type_name("SIZE");
    app.add_option("--region", region_,
                   "only what is inside: minx,miny,maxx,maxy or a GeoJSON file");
    app.add_option("--method", method_, "between samples: linear, natural or nearest")
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option("--level", level_, "only points of this level and above: a number or top")
        ->capture_default_str();
    add_number(app, "--max-edge", max_edge_,
               "of points: triangles with a longer side, on the ground, are no data (default: "
               "none is too long)",
               kAboveZero)
        ->type_name("METRES");
    crs_.define(app);
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    RasterRequest request;
    request.value = parse_raster_value(value_);
    request.sampler.method = parse_interpolation(method_);
    const std::optional<unsigned> level = parse_level(level_);
    request.sampler.max_edge = max_edge_;
    request.cell = cell_;
    if (output_ == "-") throw UsageError("a GeoTIFF cannot go to standard output; name a file");
    const stream::Store store = open_store(store_);
    request.sampler.level = level.value_or(store.top());
    if (!region_.empty()) request.region = crs_.regions(store, common)(Region::parse(region_));
    request.to = crs_.to(store, common);
    request.output = output_;
    request.replace = may_replace(output_, common.force);
    const RasterOutcome outcome = write_raster(store, request, common.context());

    Summary summary;
    summary.json = {{"columns", outcome.columns},
                    {"rows", outcome.rows},
                    {"cells", outcome.columns * outcome.rows},
                    {"nodata", outcome.columns * outcome.rows - outcome.cells_with_data},
                    {"seconds", watch.seconds()},
                    {"peak_rss_bytes", peak_rss_bytes()}};
    summary.text = output_ + ": " + with_commas(outcome.columns) + " x " +
                   with_commas(outcome.rows) + " cells, " +
                   with_commas(outcome.columns * outcome.rows - outcome.cells_with_data) +
                   " without data, in " + readable_seconds(watch.seconds()) + "\n";
    return summary;
  }

 private:
  std::string store_, output_, value_ = "height", region_, method_ = "linear", level_ = "0";
  std::optional<double> cell_, max_edge_;
  CrsOptions crs_;
};

}  // namespace

std::unique_ptr<Command> make_raster() { return std::make_unique<RasterCommand>(); }

}  // namespace terrace::tools
