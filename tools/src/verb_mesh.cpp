// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <terrace/stream/store.hpp>

#include "crs_options.hpp"
#include "detail.hpp"
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
                   "only triangles that reach inside: minx,miny,maxx,maxy or a GeoJSON file");
    app.add_option("--focus", focuses_, "BOX:L, all points of level L inside the box; repeatable")
        ->allow_extra_args(false);
    app.add_option(
           "--smooth", smooth_,
           "laplacian, taubin (keeps what is wide) or bilateral (keeps steps), :STEPS behind "
           "if wanted (10); with --region only inside it")
        ->type_name("METHOD");
    app.add_option(
           "--metric", metric_,
           "euclidean, or elliptical:FILE (JSON regions as for cluster): triangles follow the "
           "ellipses inside the regions")
        ->capture_default_str()
        ->type_name("NAME");
    not_yet(app, {"--max-error", "--quality", "--max-points", "--duplicates", "--fill", "--overlay",
                  "--base"});
    crs_.define(app);
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    const MeshOptions options{parse_smoothing(smooth_), MetricChoice::parse(metric_)};
    const stream::Store store = stream::Store::open(store_);
    const Detail detail = Detail::parse(store, level_, region_, focuses_, crs_.regions(store));
    const PlaceConversion places = crs_.places(store);
    const bool replace = may_replace(output_, common.force);
    TriangleMesh mesh =
        mesh_of_store(store, detail, common.memory_or(machine_memory_bytes() / 2), options);
    places(mesh.positions);
    write_mesh(output_, format_, mesh, replace);

    Summary summary;
    summary.json = {{"vertices", mesh.positions.size()},
                    {"triangles", mesh.triangles.size()},
                    {"seconds", watch.seconds()},
                    {"peak_rss_bytes", peak_rss_bytes()}};
    summary.text = output_ + ": " + with_commas(mesh.positions.size()) + " vertices, " +
                   with_commas(mesh.triangles.size()) + " triangles in " +
                   readable_seconds(watch.seconds()) + "\n";
    return summary;
  }

 private:
  std::string store_, output_, format_, level_ = "0", region_, smooth_, metric_ = "euclidean";
  std::vector<std::string> focuses_;
  CrsOptions crs_;
};

}  // namespace

std::unique_ptr<Command> make_mesh() { return std::make_unique<MeshCommand>(); }

}  // namespace terrace::tools
