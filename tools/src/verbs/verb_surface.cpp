// SPDX-License-Identifier: GPL-3.0-or-later
// surface: the surface that the points of a store were scanned from.
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/crs_options.hpp"
#include "cli/detail_options.hpp"
#include "cli/interrupt.hpp"
#include "cli/library_call.hpp"
#include "cli/output.hpp"
#include "mesh/vtk_file.hpp"
#include "scan/surface_run.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/metric_choice.hpp"
#include "terrace/terrain/triangle_mesh.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class SurfaceCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", store_, "where the points come from")->required();
    add_output(app, output_, "the file to write: .ply, .obj, .glb; with --tetrahedra .vtk");
    app.add_option("--format", format_, "ply, ply-ascii, obj, glb; else by the file's ending");
    app.add_option("--level", level_, "detail outside the focuses: a number or top")
        ->default_str("0; with --focus top");
    app.add_option(
        "--region", region_,
        "only points inside: a box, minx,miny[,minz],maxx,maxy[,maxz], or a GeoJSON file");
    app.add_option("--focus", focuses_, "BOX:L, all points of level L inside the box; repeatable")
        ->allow_extra_args(false);
    app.add_option("--criterion", criterion_,
                   "what lies on the surface: gabriel; edge[:FACTOR], facets whose edges are short "
                   "beside the others (0.5), which does not restore scans yet: pieces or the hull; "
                   "or CGAL's advancing-front, alpha-wrap[:METRES]")
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option(
           "--metric", metric_,
           "of --criterion gabriel and edge: euclidean or elliptical:FILE, an ellipsoid for "
           "samples that are denser in some directions than in others; see 'terrace cluster "
           "--help'")
        ->capture_default_str()
        ->type_name("METRIC");
    app.add_flag("--tetrahedra", tetrahedra_, "write the tetrahedra inside instead");
    crs_.define(app);
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    SurfaceCriterion criterion = parse_criterion(criterion_);
    criterion.restore.metric = surface_metric(MetricChoice::parse(metric_), criterion);
    const bool vtk = output_.ends_with(".vtk");
    if (tetrahedra_ != vtk) throw UsageError("--tetrahedra and an output named .vtk go together");
    const stream::Store store = open_store(store_);
    const Detail detail =
        parse_detail(store, level_, region_, focuses_, crs_.regions(store, common));
    const PlaceConversion places = crs_.places(store, common);
    const bool replace = may_replace(output_, common.force);
    SurfaceOutcome outcome;
    call_library(store_, criterion_, [&] {
      outcome = surface_of_store(store, detail, criterion, tetrahedra_, common.memory_or(0));
    });
    places(outcome.mesh.positions);
    const stream::WriterOptions writer{.format = format_, .replace = replace, .stop = stop_token()};
    if (tetrahedra_) {
      write_vtk(output_, outcome.mesh.positions, outcome.mesh.levels, outcome.tetrahedra, writer);
    } else {
      write_mesh(output_, outcome.mesh, writer);
    }
    return summary_of(outcome, watch);
  }

 private:
  [[nodiscard]] Summary summary_of(const SurfaceOutcome& outcome, const Stopwatch& watch) const {
    const tri::SurfaceMeasures& measures = outcome.measures;
    Summary summary;
    summary.json = {{"vertices", outcome.mesh.positions.size()},
                    {"area", measures.area},
                    {"volume", measures.volume},
                    {"components", measures.components},
                    {"euler_characteristic", measures.euler_characteristic},
                    {"closed", measures.closed},
                    {"seconds", watch.seconds()},
                    {"peak_rss_bytes", peak_rss_bytes()}};
    summary.text = output_ + ": " + with_commas(outcome.mesh.positions.size()) + " vertices, ";
    if (tetrahedra_) {
      summary.json["tetrahedra"] = outcome.tetrahedra.size();
      summary.text += with_commas(outcome.tetrahedra.size()) + " tetrahedra";
    } else {
      summary.json["triangles"] = outcome.mesh.triangles.size();
      summary.text += with_commas(outcome.mesh.triangles.size()) + " triangles, " +
                      (measures.closed ? "closed, " : "open, ") + with_commas(measures.components) +
                      (measures.components == 1 ? " component" : " components");
    }
    summary.text += " in " + readable_seconds(watch.seconds()) + "\n";
    return summary;
  }

  std::string store_, output_, format_, level_, region_, criterion_ = "gabriel",
                                                         metric_ = "euclidean";
  std::vector<std::string> focuses_;
  bool tetrahedra_ = false;
  CrsOptions crs_;
};

}  // namespace

std::unique_ptr<Command> make_surface() { return std::make_unique<SurfaceCommand>(); }

}  // namespace terrace::tools
