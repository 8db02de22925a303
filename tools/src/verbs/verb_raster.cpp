// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/output.hpp"
#include "cli/store_options.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "terrace/terrain/raster.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class RasterCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    surface_.define(app);
    add_output(app, output_,
               "the Cloud Optimized GeoTIFF to write: " + endings_of(outputs::kRasterFile));
    app.add_option("--value", value_,
                   "height; slope in degrees; aspect in degrees clockwise from north, downhill; "
                   "hillshade, 1 to 255")
        ->capture_default_str()
        ->type_name("NAME");
    add_number(app, "--cell", cell_,
               "width and height of a cell in units of the output's CRS; cells start at its "
               "multiples, so that rasters with the same cell size align (default: the raster's "
               "own cells; for points, coarser levels and another CRS, about as many cells as "
               "there are points)",
               kPositive)
        ->type_name("SIZE");
    app.add_option("--align", align_, "use all cells of this raster, in its CRS")
        ->type_name("FILE")
        ->excludes("--cell");
    app.add_option("--region", region_,
                   "only inside this area: minx,miny,maxx,maxy or a GeoJSON file");
    crs_.define(app);
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kRasterFile, output_);
    const Stopwatch watch;
    RasterRequest request;
    request.value = parse_raster_value(value_);
    request.cell = cell_;
    request.align = align_;
    const stream::Store store = surface_.open(request.sampler);
    const Detail detail = surface_.detail(store, crs_, common, region_);
    request.sampler.level = detail.level;
    request.sampler.focuses = detail.focuses;
    request.region = detail.region;
    request.to = crs_.from_store_to_output(store, common);
    request.output = output_;
    request.replace = may_replace(output_, common.force);
    const RasterOutcome outcome = write_raster(store, request, common.context());

    Summary summary;
    summary.json = {{"columns", outcome.columns},
                    {"rows", outcome.rows},
                    {"cells", outcome.columns * outcome.rows},
                    {"nodata", outcome.columns * outcome.rows - outcome.cells_with_data}};
    summary.add_cost(watch);
    summary.text =
        fmt::format("{}: {} x {} cells, {} without data, in {}\n", output_,
                    with_commas(outcome.columns), with_commas(outcome.rows),
                    with_commas(outcome.columns * outcome.rows - outcome.cells_with_data),
                    readable_seconds(watch.seconds()));
    surface_.report(detail, summary);
    return summary;
  }

 private:
  SurfaceOptions surface_;
  std::string output_, value_ = "height", region_, align_;
  std::optional<double> cell_;
  CrsOptions crs_;
};

}  // namespace

std::unique_ptr<Command> make_raster() { return std::make_unique<RasterCommand>(); }

}  // namespace terrace::tools
