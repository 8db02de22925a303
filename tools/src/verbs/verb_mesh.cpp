// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdlib>  // defines __GLIBC__
#ifdef __GLIBC__
#include <fmt/core.h>
#include <malloc.h>
#endif

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <terrace/stream/overlay.hpp>
#include <terrace/stream/store.hpp>

#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/output.hpp"
#include "cli/store_options.hpp"
#include "terrace/terrain/bounded_mesh.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "terrace/terrain/store_view.hpp"
#include "terrace/terrain/triangle_mesh.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Keeps freed memory in the process, if the C library supports it. Meshing on several threads
/// allocates and frees blocks of similar sizes again and again. If the system takes large blocks
/// back, it has to clear each new page, which took 7 % of the meshing time. The peak does not grow.
void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int kMegabyte = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 32 * kMegabyte);  // the largest value it accepts
  mallopt(M_TRIM_THRESHOLD, 512 * kMegabyte);
  mallopt(M_TOP_PAD, kMegabyte);
#endif
}

class MeshCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    part_.define(app, "only triangles that reach inside");
    add_output(app, output_,
               "the file to write: " + endings_of(outputs::kMeshFile) + " (GLB in metres)");
    app.add_option("--format", format_, "ply, ply-ascii, obj or glb (default: from the ending)");
    part_.define_cluster(app, "the mesh of the points of --level (default: L) that it represents");
    app.add_option("--smooth", smooth_,
                   "laplacian, taubin (keeps wide features) or bilateral (keeps steps), optionally "
                   "followed by :STEPS (10); with --region only inside it")
        ->type_name("METHOD")
        ->excludes("--cluster");
    app.add_option("--overlay", overlay_,
                   "a file from --save-overlay: use its heights instead of the store's")
        ->type_name("FILE")
        ->excludes("--cluster");
    app.add_option(
           "--save-overlay", save_overlay_,
           "with --smooth: write the changed heights to this file; the store stays unchanged")
        ->type_name("FILE");
    app.add_option(
           "--metric", metric_,
           "euclidean, or elliptical:FILE (JSON regions as for cluster): triangles follow the "
           "ellipses inside the regions")
        ->capture_default_str()
        ->type_name("NAME");
    add_number(app, "--max-error", max_error_,
               "few triangles within this vertical distance of every sample, in metres, verified "
               "on the written values",
               kNonNegative)
        ->type_name("METRES");
    app.add_option("--max-points", max_points_,
                   "the mesh with the smallest error that has at most this many points")
        ->type_name("N");
    app.add_option("--quality", quality_,
                   "error-bounded mesh: greedy (Delaunay), removal (fewer triangles) or fitted "
                   "(fewer still; heights differ from the samples)")
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option(
           "--duplicates", duplicates_,
           "which of several irregular samples at one x,y counts: all (keeps each within "
           "--max-error, or fails if they differ by more), min, max, mean, first, error (fails)")
        ->default_str("all; with --max-points mean")
        ->type_name("NAME");
    app.add_option("--fill", fill_,
                   "error-bounded mesh of a raster: cells without data become holes (none), flat "
                   "at the lowest height (flat) or interpolated (interpolate)")
        ->capture_default_str()
        ->type_name("NAME");
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kMeshFile, output_, format_);
    if (save_overlay_ == output_) {
      throw UsageError("--save-overlay and --output are the same file");
    }
    if (!save_overlay_.empty()) check_output_name(outputs::kOverlayFile, save_overlay_);
    return max_error_ || !max_points_.empty() ? write_bounded(common) : write_detail(common);
  }

 private:
  /// Writes the mesh with few triangles within --max-error or of --max-points.
  Summary write_bounded(const CommonOptions& common) const {
    const Stopwatch watch;
    BoundedMeshOptions options = bounded_options();
    const std::string duplicates = duplicates_choice();
    const stream::Store store = open_store(part_.path, part_.where);
    options.region = part_.detail(store, common).region;
    options.places = part_.crs.places(store, common);
    options.writer = {
        .format = format_, .replace = may_replace(output_, common.force), .stop = stop_token()};
    keep_freed_memory();
    const BoundedMeshResult result = write_bounded_mesh(store, options, common.context());
    Summary summary;
    summary.json = {{"vertices", result.vertices},
                    {"triangles", result.triangles},
                    {"max_error", result.max_error},
                    {"rms_error", result.rms_error},
                    {"samples", result.samples},
                    {"covered", result.samples - result.uncovered},
                    {"uncovered", result.uncovered},
                    {"duplicates", result.duplicates},
                    {"seconds", watch.seconds()},
                    {"reading_seconds", result.reading_seconds},
                    {"meshing_seconds", result.meshing_seconds},
                    {"peak_rss_bytes", peak_rss_bytes()}};
    report_coordinates(result.coordinates, common, summary);
    const bool all_covered = result.uncovered == 0;
    summary.text =
        fmt::format("{}: {}, {}, within {} m of {}{} (RMS {} m), in {}\n", output_,
                    counted(result.vertices, "vertex"), counted(result.triangles, "triangle"),
                    readable_bound(result.max_error),
                    all_covered ? "all " : with_commas(result.samples - result.uncovered) + " of ",
                    counted(result.samples, "sample"), readable_number(result.rms_error),
                    readable_seconds(watch.seconds()));
    if (!all_covered) {
      summary.text +=
          fmt::format("{} on no triangle: {}\n", counted(result.uncovered, "sample", "is", "are"),
                      why_uncovered(result, store.schema().grid, options.region.has_value()));
    }
    if (result.duplicates > 0) {
      summary.text += fmt::format(
          "{} the place of another: {}\n", counted(result.duplicates, "sample", "shares", "share"),
          duplicates == "all"
              ? "the bound holds for each of them"
              : fmt::format("the bound holds for the {} of each place (--duplicates {})",
                            adjective_of(duplicates), duplicates));
    }
    return summary;
  }

  /// Returns --duplicates, or its default.
  [[nodiscard]] std::string duplicates_choice() const {
    if (!duplicates_.empty()) return duplicates_;
    return max_points_.empty() ? "all" : "mean";
  }

  /// Returns the options that do not depend on the store. Throws UsageError if options contradict
  /// each other.
  [[nodiscard]] BoundedMeshOptions bounded_options() const {
    if ((!part_.level.empty() && part_.level != "0") || !part_.focuses.empty() ||
        !smooth_.empty() || metric_ != "euclidean" || !overlay_.empty() || !save_overlay_.empty() ||
        !part_.cluster.empty()) {
      throw UsageError(
          "--max-error and --max-points apply to all samples: they exclude --level, --focus, "
          "--cluster, --smooth, --overlay and --metric");
    }
    BoundedMeshOptions options;
    if (max_error_ && !max_points_.empty()) {
      throw UsageError("give either --max-error or --max-points, not both");
    }
    options.max_error = max_error_.value_or(0.0);
    if (!max_points_.empty()) {
      options.max_points = count_of_option("--max-points", max_points_);
      if (options.max_points < 4) throw UsageError("--max-points must be at least 4");
    }
    options.quality = parse_quality(quality_);
    options.duplicates = parse_duplicates(duplicates_choice());
    if (options.duplicates == tri::PointDuplicates::all && !max_points_.empty()) {
      throw UsageError("--duplicates all needs the bound of --max-error");
    }
    options.fill = parse_fill(fill_);
    options.path = output_;
    return options;
  }

  /// Returns the reason why samples are on no triangle, for the summary.
  static std::string why_uncovered(const BoundedMeshResult& result, bool grid, bool region) {
    if (result.triangles == 0) return "nothing spans an area";
    if (grid && region) return "they are at the region's border or next to cells without data";
    return grid ? "they are next to cells without data"
                : "the file's format rounds the border of the mesh";
  }

  /// Returns the reason why positions give no triangles, for a note.
  static std::string why_no_triangles(const std::vector<stream::Point3>& positions) {
    const bool same_position =
        std::all_of(positions.begin(), positions.end(), [&](const stream::Point3& p) {
          return p[0] == positions.front()[0] && p[1] == positions.front()[1];
        });
    return std::string("there are no triangles, because ") +
           (same_position ? "all points have the same x and y"
                          : "all points are on one line over x and y");
  }

  /// Returns whether a store holds points on the surface of a body rather than on terrain. A store
  /// with a CRS does not.
  static bool looks_like_scan(const stream::Store& store) {
    const stream::Crs& crs = store.schema().crs;
    return !store.schema().grid && crs.epsg == 0 && crs.wkt.empty() &&
           is_scan(store, StoreView<tri::PointCloud>(store).ground());
  }

  /// Returns "lowest" for "min" and so on: the sample of a place that --duplicates chooses.
  static std::string adjective_of(const std::string& duplicates) {
    return duplicates == "min" ? "lowest" : duplicates == "max" ? "highest" : duplicates;
  }

  /// Writes the mesh of a part of the store at the chosen levels.
  Summary write_detail(const CommonOptions& common) const {
    const Stopwatch watch;
    if (quality_ != "removal" || !duplicates_.empty() || fill_ != "none") {
      throw UsageError("--quality, --duplicates and --fill need --max-error or --max-points");
    }
    DetailMeshOptions options;
    options.heights.smoothing = parse_smoothing(smooth_);
    options.metric = MetricChoice::parse(metric_);
    const bool save = !save_overlay_.empty();
    if (save && smooth_.empty()) throw UsageError("--save-overlay needs --smooth");
    const stream::Store store = open_store(part_.path, part_.where);
    const Detail detail = part_.detail(store, common);
    const PlaceConversion places = part_.crs.places(store, common);
    stream::OutputGroup outputs;
    const stream::Naming replace = may_replace(output_, common.force, outputs);
    std::optional<stream::Overlay> overlay;
    if (!overlay_.empty())
      options.heights.overlay = &overlay.emplace(open_height_overlay(overlay_, store));
    std::optional<stream::OverlayWriter> writer;
    if (save) {
      options.heights.save =
          &writer.emplace(save_overlay_, store, store.schema().coordinates[2].name,
                          may_replace(save_overlay_, common.force, outputs));
    }
    TriangleMesh mesh = detail_mesh(store, detail, options, common.context());
    if (mesh.positions.empty()) throw_none_inside(store, "triangle");
    if (mesh.triangles.empty()) common.say(part_.path + ": " + why_no_triangles(mesh.positions));
    places(mesh.positions, check_interrupt);
    const MeshCoordinates coordinates =
        write_mesh(output_, mesh, {.format = format_, .replace = replace, .stop = stop_token()},
                   MeshUnits(store, places));
    if (writer) writer->finish();
    outputs.commit();
    if (looks_like_scan(store)) {
      common.say(part_.path +
                 ": most triangles are steep, as between the two sides of a body; "
                 "'terrace surface' makes the surface of a scan");
    }

    Summary summary;
    summary.json = {{"vertices", mesh.positions.size()}, {"triangles", mesh.triangles.size()}};
    summary.add_cost(watch);
    report_coordinates(coordinates, common, summary);
    summary.text =
        fmt::format("{}: {}, {} in {}\n", output_, counted(mesh.positions.size(), "vertex"),
                    counted(mesh.triangles.size(), "triangle"), readable_seconds(watch.seconds()));
    if (writer) {
      summary.json["overlay_values"] = writer->values();
      summary.text +=
          fmt::format("{}: {}\n", save_overlay_, counted(writer->values(), "changed height"));
    }
    return summary;
  }

  PartOptions part_;
  std::string output_, format_, smooth_, metric_ = "euclidean";
  std::string overlay_, save_overlay_;
  std::string max_points_, quality_ = "removal", duplicates_, fill_ = "none";
  std::optional<double> max_error_;
};

}  // namespace

std::unique_ptr<Command> make_mesh() { return std::make_unique<MeshCommand>(); }

}  // namespace terrace::tools
