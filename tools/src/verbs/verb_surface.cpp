// SPDX-License-Identifier: GPL-3.0-or-later
// surface: the surface that the points of a store were scanned from.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
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
    part_.define_cluster(app,
                         "the surface of the points of --level (default: L) that it represents");
    add_output(app, output_,
               fmt::format("the file to write: {} (GLB in metres); with --tetrahedra {}",
                           endings_of(outputs::kMeshFile), endings_of(outputs::kTetrahedraFile)));
    app.add_option("--format", format_, "ply, ply-ascii, obj or glb (default: from the ending)");
    criterion_option_ =
        app.add_option(
               "--criterion", criterion_,
               "restore the surface even if the store has one ('terrace build --surface'); how to "
               "find the inside: poles uses the angles between circumspheres; gabriel "
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
    add_number(app, "--max-error", max_error_,
               "few triangles within this distance of the full surface, in metres, measured from "
               "all its vertices and from about as many places on the triangles",
               kNonNegative)
        ->type_name("METRES");
    app.add_option("--max-points", max_points_,
                   "at most this many points, as far as the surface keeps its parts and holes")
        ->type_name("N");
    app.add_flag("--tetrahedra", tetrahedra_, "write the tetrahedra of the inside instead");
    app.add_option("--smooth", smooth_,
                   "remove noise: taubin (keeps the volume, rounds edges) or bilateral (keeps "
                   "edges), optionally followed by :STEPS (10)")
        ->type_name("METHOD");
    add_number(app, "--smooth-limit", smooth_limit_,
               "with --smooth: no vertex moves farther than this from its sample (default: the "
               "median length of the triangles' sides)",
               kNonNegative)
        ->type_name("METRES");
    app.add_flag("--normals", normals_,
                 "write a normal for each vertex, the mean over its triangles by their angles");
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(tetrahedra_ ? outputs::kTetrahedraFile : outputs::kMeshFile, output_,
                      format_);
    const Stopwatch watch;
    ScanSurfaceOptions options = parse_criterion(criterion_);
    set_metric(MetricChoice::parse(metric_), options);
    set_smoothing(options);
    options.stored = criterion_option_->count() == 0;
    options.tetrahedra = tetrahedra_;
    options.max_error = max_error_;
    if (!max_points_.empty()) options.max_points = count_of_option("--max-points", max_points_);
    if (tetrahedra_ && options.method) {
      throw UsageError("--tetrahedra is for --criterion poles, gabriel and edge");
    }
    if (tetrahedra_ && (options.smoothing || normals_)) {
      throw UsageError("--tetrahedra excludes --smooth and --normals");
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
      if (normals_) set_normals(surface.mesh, output_, writer, units, common.context().threads);
      coordinates = write_mesh(output_, surface.mesh, writer, units);
    }
    Summary summary = summary_of(surface, watch);
    report_coordinates(coordinates, common, summary);
    return summary;
  }

 private:
  void set_smoothing(ScanSurfaceOptions& options) const {
    options.smoothing = parse_surface_smoothing(smooth_);
    if (!smooth_limit_) return;
    if (!options.smoothing) throw UsageError("--smooth-limit needs --smooth");
    options.smoothing->limit = smooth_limit_;
  }

  static void add_moves(const tri::SurfaceMoves& moves, Summary& summary) {
    summary.json["moves"] = {{"mean", moves.mean},
                             {"largest", moves.largest},
                             {"limit", moves.limit},
                             {"limited", moves.limited}};
    summary.text += fmt::format(
        "smoothed: vertices moved by {} m, at most {} m; {} stopped at the limit of {} m\n",
        readable_number(moves.mean, 3), readable_number(moves.largest, 3),
        with_commas(moves.limited), readable_number(moves.limit, 3));
  }

  /// Adds how far the surface is from the full one.
  static void add_simplification(const SimplifiedFrom& full, Summary& summary) {
    summary.json["full_vertices"] = full.vertices;
    summary.json["full_triangles"] = full.triangles;
    summary.json["full_volume"] = full.volume;
    summary.json["max_error"] = full.max_distance;
    summary.text +=
        fmt::format(", within {} m of the full surface with {}", readable_bound(full.max_distance),
                    counted(full.vertices, "vertex"));
  }

  [[nodiscard]] Summary summary_of(const ScanSurface& surface, const Stopwatch& watch) const {
    const tri::SurfaceMeasures& measures = surface.measures;
    Summary summary;
    summary.json = {{"vertices", surface.mesh.positions.size()},
                    {"area", measures.area},
                    {"volume", measures.volume},
                    {"components", measures.components},
                    {"euler_characteristic", measures.euler_characteristic},
                    {"closed", measures.closed},
                    {"stored", surface.stored},
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
      // How many of them a simplified surface has is unknown.
      if (!surface.open && surface.lids > 0 && !surface.simplified) {
        summary.text += fmt::format(" ({} over gaps of the scan)", with_commas(surface.lids));
      }
      if (!surface.mesh.triangles.empty()) {
        summary.text +=
            (measures.closed ? ", closed, " : ", open, ") + counted(measures.components, "part");
      }
    }
    if (surface.simplified) add_simplification(*surface.simplified, summary);
    if (surface.stored) {
      summary.text += ", from the stored surface";
    } else if (surface.open) {
      summary.text += ", without the faces over the gaps of the scan";
    }
    if (surface.samples_off.value_or(0) > 0) {
      summary.text += fmt::format(", {} not on it", counted(*surface.samples_off, "sample"));
    }
    summary.text += fmt::format(" in {}\n", readable_seconds(watch.seconds()));
    if (surface.moves) add_moves(*surface.moves, summary);
    return summary;
  }

  PartOptions part_;
  CLI::Option* criterion_option_ = nullptr;
  std::string output_, format_, criterion_ = "poles", metric_ = "euclidean", smooth_, max_points_;
  std::optional<double> smooth_limit_, max_error_;
  bool tetrahedra_ = false, normals_ = false;
};

}  // namespace

std::unique_ptr<Command> make_surface() { return std::make_unique<SurfaceCommand>(); }

}  // namespace terrace::tools
