// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/overlay.hpp>
#include <terrace/stream/store.hpp>

#include "detail.hpp"
#include "error.hpp"
#include "mesh_output.hpp"
#include "output.hpp"
#include "smooth_option.hpp"
#include "store_mesh.hpp"
#include "units.hpp"
#include "verbs.hpp"

namespace terrace::tools {
namespace {

class MeshCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", store_, "where the points come from")->required();
    add_output(app, output_, "the file to write: .ply, .obj, .glb");
    app.add_option("--format", format_, "ply, ply-ascii, obj, glb; else by the file's ending");
    app.add_option("--level", level_, "detail outside the focuses: a number or top")
        ->capture_default_str();
    app.add_option("--region", region_,
                   "only triangles that reach inside: a box, minx,miny[,minz],maxx,maxy[,maxz], or "
                   "a GeoJSON file");
    app.add_option("--focus", focuses_, "BOX:L, all points of level L inside the box; repeatable")
        ->allow_extra_args(false);
    app.add_option(
           "--smooth", smooth_,
           "laplacian, taubin (keeps what is wide) or bilateral (keeps steps), :STEPS behind "
           "if wanted (10); with --region only inside it")
        ->type_name("METHOD");
    app.add_option("--overlay", overlay_,
                   "a file of --save-overlay: its heights in place of the store's")
        ->type_name("FILE");
    app.add_option("--save-overlay", save_overlay_,
                   "with --smooth: write the heights that changed to this file beside the store, "
                   "which stays as it is")
        ->type_name("FILE");
    app.add_option(
           "--metric", metric_,
           "euclidean, or elliptical:FILE (JSON regions as for cluster): triangles follow the "
           "ellipses inside the regions")
        ->capture_default_str()
        ->type_name("NAME");
    not_yet(app, {"--max-error", "--quality", "--max-points", "--duplicates", "--fill", "--base",
                  "--region-crs", "--to-crs"});
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    MeshOptions options{{.smoothing = parse_smoothing(smooth_)}, MetricChoice::parse(metric_)};
    const bool save = !save_overlay_.empty();
    if (save && smooth_.empty()) throw UsageError("--save-overlay needs --smooth");
    if (save && save_overlay_ == output_) {
      throw UsageError("--save-overlay and --output are the same file");
    }
    const stream::Store store = stream::Store::open(store_);
    const Detail detail = Detail::parse(store, level_, region_, focuses_);
    const bool replace = may_replace(output_, common.force);
    std::optional<stream::Overlay> overlay;
    if (!overlay_.empty()) options.heights.overlay = &overlay.emplace(open_overlay(store));
    std::optional<stream::OverlayWriter> writer;
    if (save) {
      options.heights.save =
          &writer.emplace(save_overlay_, store, store.schema().coordinates[2].name,
                          may_replace(save_overlay_, common.force));
    }
    const TriangleMesh mesh =
        mesh_of_store(store, detail, common.memory_or(machine_memory_bytes() / 2), options);
    write_mesh(output_, format_, mesh, replace);
    if (writer) writer->finish();

    Summary summary;
    summary.json = {{"vertices", mesh.positions.size()},
                    {"triangles", mesh.triangles.size()},
                    {"seconds", watch.seconds()},
                    {"peak_rss_bytes", peak_rss_bytes()}};
    summary.text = output_ + ": " + with_commas(mesh.positions.size()) + " vertices, " +
                   with_commas(mesh.triangles.size()) + " triangles in " +
                   readable_seconds(watch.seconds()) + "\n";
    if (writer) {
      summary.json["overlay_values"] = writer->values();
      summary.text += save_overlay_ + ": " + with_commas(writer->values()) + " changed heights\n";
    }
    return summary;
  }

 private:
  [[nodiscard]] stream::Overlay open_overlay(const stream::Store& store) const {
    stream::Overlay overlay = stream::Overlay::open(overlay_, store);
    const std::string& heights = store.schema().coordinates[2].name;
    if (overlay.channel() != heights) {
      throw stream::Error({.file = overlay_,
                           .where = {},
                           .cause = "has other values of '" + overlay.channel() +
                                    "', not of the heights '" + heights + "'",
                           .remedy = "name an overlay that terrace mesh has written"});
    }
    return overlay;
  }

  std::string store_, output_, format_, level_ = "0", region_, smooth_, overlay_, save_overlay_,
                                        metric_ = "euclidean";
  std::vector<std::string> focuses_;
};

}  // namespace

std::unique_ptr<Command> make_mesh() { return std::make_unique<MeshCommand>(); }

}  // namespace terrace::tools
