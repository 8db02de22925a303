// SPDX-License-Identifier: GPL-3.0-or-later
// surface: the surface that the points of a store were scanned from.
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "cli/store_options.hpp"
#include "mesh/vtk_file.hpp"
#include "scan/criterion.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/metric_choice.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "terrace/terrain/triangle_mesh.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class SurfaceCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    part_.define(app, "only points inside");
    add_output(app, output_,
               fmt::format("the file to write: {} (GLB in metres); with --tetrahedra {}",
                           endings_of(outputs::kMeshFile), endings_of(outputs::kTetrahedraFile)));
    app.add_option("--format", format_, "ply, ply-ascii, obj or glb (default: from the ending)");
    app.add_option("--criterion", criterion_,
                   "how to find the inside: poles uses the angles between circumspheres; gabriel "
                   "and edge[:FACTOR] (0.5) peel tetrahedra off the hull as in J. Skala's thesis: "
                   "gabriel may leave bridges and bury samples, edge leaves slivers with many "
                   "times the surface's area; advancing-front and alpha-wrap[:METRES] are CGAL's")
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option(
           "--metric", metric_,
           "for --criterion poles, gabriel and edge: euclidean or elliptical:FILE, an ellipsoid "
           "for samples that are denser in some directions than in others; see 'terrace cluster "
           "--help'")
        ->capture_default_str()
        ->type_name("METRIC");
    app.add_flag("--tetrahedra", tetrahedra_, "write the tetrahedra of the inside instead");
  }

  Summary run(const CommonOptions& common) override {
    format_of_output(tetrahedra_ ? outputs::kTetrahedraFile : outputs::kMeshFile, output_, format_);
    const Stopwatch watch;
    ScanSurfaceOptions options = parse_criterion(criterion_);
    set_metric(MetricChoice::parse(metric_), options);
    options.tetrahedra = tetrahedra_;
    if (tetrahedra_ && options.method) {
      throw UsageError("--tetrahedra is for --criterion poles, gabriel and edge");
    }
    const stream::Store store = open_store(part_.path, part_.where);
    const Detail detail = part_.detail(store, common);
    const PlaceConversion places = part_.crs.places(store, common);
    const stream::Naming replace = may_replace(output_, common.force);
    ScanSurface surface;
    call_library(part_.path, criterion_,
                 [&] { surface = scan_surface(store, detail, options, common.context()); });
    if (surface.mesh.triangles.empty() && surface.tetrahedra.empty()) {
      common.say(
          part_.path + ": the points enclose no volume, " +
          (surface.spanned == 0   ? "all are at one place"
           : surface.spanned == 1 ? "all are on a line"
           : surface.spanned == 3 && options.restore.shape.rule == tri::ShapeRule::published
               ? "because --criterion edge keeps no tetrahedron; give it a larger factor, as edge:2"
               : "as if all were in one plane; 'terrace mesh' "
                 "triangulates heights over x and y"));
    }
    places(surface.mesh.positions, check_interrupt);
    const MeshUnits units(store, places);
    const stream::WriterOptions writer{.format = format_, .replace = replace, .stop = stop_token()};
    MeshCoordinates coordinates;
    if (tetrahedra_) {
      write_vtk(output_, surface.mesh.positions, surface.mesh.levels, surface.tetrahedra, writer);
      stream::Box3 bounds;
      for (const stream::Point3& p : surface.mesh.positions) bounds.include(p);
      // VTK stores coordinates unchanged, as PLY does.
      coordinates = mesh_coordinates(output_, {.format = "ply"}, units, bounds);
    } else {
      coordinates = write_mesh(output_, surface.mesh, writer, units);
    }
    Summary summary = summary_of(surface, watch);
    report_coordinates(coordinates, common, summary);
    return summary;
  }

 private:
  [[nodiscard]] Summary summary_of(const ScanSurface& surface, const Stopwatch& watch) const {
    const tri::SurfaceMeasures& measures = surface.measures;
    Summary summary;
    summary.json = {{"vertices", surface.mesh.positions.size()},
                    {"area", measures.area},
                    {"volume", measures.volume},
                    {"components", measures.components},
                    {"euler_characteristic", measures.euler_characteristic},
                    {"closed", measures.closed},
                    {"open_scan", surface.open},
                    {"lids", surface.lids}};
    if (surface.samples_off) summary.json["samples_off"] = *surface.samples_off;
    summary.add_cost(watch);
    summary.text =
        fmt::format("{}: {}, ", output_, counted(surface.mesh.positions.size(), "vertex"));
    if (tetrahedra_) {
      summary.json["tetrahedra"] = surface.tetrahedra.size();
      summary.text += counted(surface.tetrahedra.size(), "tetrahedron");
    } else {
      summary.json["triangles"] = surface.mesh.triangles.size();
      summary.text += counted(surface.mesh.triangles.size(), "triangle");
      if (!surface.open && surface.lids > 0) {
        summary.text += fmt::format(" ({} over gaps of the scan)", with_commas(surface.lids));
      }
      if (!surface.mesh.triangles.empty()) {
        summary.text +=
            (measures.closed ? ", closed, " : ", open, ") + counted(measures.components, "part");
      }
    }
    if (surface.open) summary.text += ", without the faces over the gaps of the scan";
    if (surface.samples_off.value_or(0) > 0) {
      summary.text += fmt::format(", {} not on it", counted(*surface.samples_off, "sample"));
    }
    summary.text += fmt::format(" in {}\n", readable_seconds(watch.seconds()));
    return summary;
  }

  PartOptions part_;
  std::string output_, format_, criterion_ = "poles", metric_ = "euclidean";
  bool tetrahedra_ = false;
};

}  // namespace

std::unique_ptr<Command> make_surface() { return std::make_unique<SurfaceCommand>(); }

}  // namespace terrace::tools
