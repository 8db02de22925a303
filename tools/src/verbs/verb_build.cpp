// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/core.h>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <CLI/CLI.hpp>
#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/selection_options.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "terrace/terrain/scan_surface.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Points that the trial run of --dry-run reads before it extrapolates.
constexpr std::uint64_t kTrialPoints = 1'000'000;

/// Makes freed memory return to the system at once, if the C library supports it. Otherwise a
/// thread keeps the blocks of points that it freed while other threads allocate more. While points
/// are sorted, that was a third of the peak resident set.
void return_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
#endif
}

class BuildCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("INPUT", request_.inputs,
                   "rasters (several form a mosaic) or point files; a folder of them, @FILE with "
                   "one name per line, or a quoted pattern; - is standard input")
        ->required();
    add_output(app, output_, "the store to write");
    add_input_format(app, request_.input_format);
    app.add_option("--entities", entities_,
                   "what to read and cluster: points; triangles of a mesh (OBJ, OFF, PLY, STL), "
                   "for 'terrace mesh'; segments of lines (GeoJSON) or their polylines of up to 4 "
                   "vertices, for 'terrace points -o x.geojson'")
        ->check(CLI::IsMember({"points", "triangles", "segments", "polylines"}))
        ->capture_default_str();
    app.add_option("--crs", crs_,
                   "EPSG:n, EPSG:n+m with the vertical CRS, or a file with WKT (.prj); overrides "
                   "the source's CRS");
    app.add_option("--towgs84", shift_,
                   "dx,dy,dz[,rx,ry,rz,ds]: metres, arc-seconds and ppm (position vector) from "
                   "the CRS's datum to WGS 84");
    app.add_option("--vertical", request_.vertical, "reference of the heights")
        ->check(CLI::IsMember({"ellipsoidal", "orthometric"}));
    selection_.define(app);
    app.add_option("--band", request_.band, "band of rasters, from 1")->check(CLI::Range(1, 65535));
    add_skip_damaged(app, request_.skip_damaged);
    add_rgb_encoding(app, request_.heights_of_colour);
    add_source_cell_size(app, request_.cell);
    define_clustering(app);
    app.add_option(
           "--order", order_,
           "order of points: stream keeps the input order, spatial sorts nearby points together "
           "(through a temporary file next to the store), auto sorts only if needed")
        ->check(CLI::IsMember({"auto", "stream", "spatial"}))
        ->capture_default_str();
    app.add_flag("--surface", surface_,
                 "also store a surface, so that surfaces of any detail do not tear: the triangles "
                 "of the input or, without faces, the surface that 'terrace surface' restores; all "
                 "points are held in memory");
    app.add_option("--surface-from", surface_from_,
                   "with --surface: input demands its triangles, restored ignores them")
        ->check(CLI::IsMember({"input", "restored"}));
    app.add_flag("--append", request_.append,
                 "add the points to the store, which exists; clusters as the store records");
    app.add_flag("--dry-run", dry_run_,
                 "only estimate points, disk space and time from a trial run");
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kStore, output_);
    request_.store = output_;
    request_.replace = common.force;
    request_.effort = *effort_of(effort_);
    request_.entities = *stream::entities_named(entities_);  // validated by the option
    if (!crs_.empty()) request_.crs = crs_named(crs_);
    request_.datum_shift = parse_datum_shift(shift_);
    if (block_ < 2 || block_ > 1'000'000) {
      throw UsageError(fmt::format("--block must be between 2 and 1000000, not {}", block_));
    }
    request_.block_points = block_;
    if (facility_cost_) {
      if (request_.k > 0) throw UsageError("give either -k or --facility-cost");
      request_.facility_cost = *facility_cost_;
    }
    request_.metric = MetricChoice::parse(metric_);
    request_.strategy = parse_strategy(strategy_);
    if (outlier_price_) request_.outlier_price = *outlier_price_;
    for (const std::string& channel : channels_)
      request_.channels.push_back(parse_channel(channel));
    request_.selection =
        selection_.selection(request_.inputs, source_options(), request_.datum_shift, common);
    request_.seed = common.seed;
    request_.order = order_ == "stream"    ? stream::Order::stream
                     : order_ == "spatial" ? stream::Order::spatial
                                           : stream::Order::automatic;
    if (surface_ && request_.entities != stream::Entities::points) {
      throw UsageError("--surface is for points: --entities " + entities_ + " excludes it");
    }
    if (request_.append && dry_run_) throw UsageError("--append excludes --dry-run");
    if (!surface_from_.empty() && !surface_) {
      throw UsageError("--surface-from is for --surface");
    }
    std::error_code ignored;
    if (!common.force && !request_.append && std::filesystem::exists(request_.store, ignored)) {
      throw stream::Error(output_, "exists already")
          .remedy("name another output, or give --force to replace it");
    }
    return dry_run_ ? estimate(common) : build(common);
  }

 private:
  /// Adds the options of the clusters in each block.
  void define_clustering(CLI::App& app) {
    app.add_option("--block", block_, "maximum number of points clustered together")
        ->capture_default_str();
    add_number(app, "--facility-cost", facility_cost_,
               "times the diagonal of a block: larger makes larger clusters", kFactor)
        ->default_str("3");
    app.add_option("-k", request_.k,
                   "k-median: the top level is the K points with the least sum of distances to "
                   "all others; levels are finer, and the store larger")
        ->check(CLI::Range(std::size_t{1}, kMaxMedians))
        ->type_name("K");
    app.add_option("--effort", effort_, "how long to search for good clusters")
        ->check(CLI::IsMember({"fast", "default", "fine", "full"}))
        ->capture_default_str();
    add_number(app, "--z-weight", request_.z_weight, "weight of heights in distances",
               kFactorOrZero);
    app.add_option(
           "--metric", metric_,
           "euclidean, squared, minkowski:P or elliptical:FILE (JSON: boxes with semi-axes)")
        ->capture_default_str()
        ->type_name("METRIC");
    app.add_option("--channel", channels_,
                   "ATTRIBUTE:WEIGHT, repeatable: adds the attribute to distances, one unit as "
                   "WEIGHT metres; much slower")
        ->type_name("NAME:W");
    add_number(app, "--outlier-price", outlier_price_,
               "times the diagonal of a block: points that cost less to leave out do not shape "
               "clusters; they stay in the store with outlier = 1",
               kFactor);
    app.add_option("--strategy", strategy_,
                   "search for clusters: automatic, or one of the thesis's slower local searches")
        ->type_name("NAME")
        ->capture_default_str();
    app.add_option("--batch", request_.batch,
                   "local searches: candidates evaluated at once, of which the best is used")
        ->check(CLI::Range(1U, 4294967295U))
        ->capture_default_str();
    app.add_option("--search-threads", request_.search_threads,
                   "local searches: threads that share the work on one block")
        ->check(CLI::Range(1U, 1024U))
        ->capture_default_str();
  }

  /// Returns the singular of the store's entities, such as "point".
  [[nodiscard]] std::string entity() const { return entities_.substr(0, entities_.size() - 1); }

  /// Builds the store and returns its summary.
  Summary build(const CommonOptions& common) {
    const Stopwatch watch;
    return_freed_memory();
    if (surface_) {
      request_.surface = [context = common.context()](const stream::Store& store,
                                                      const stream::ClusterOrder& order,
                                                      const InputTriangles& triangles) {
        return surface_to_store(store, order, context, triangles);
      };
      request_.surface_origin = surface_from_ == "input"      ? SurfaceOrigin::input
                                : surface_from_ == "restored" ? SurfaceOrigin::restored
                                                              : SurfaceOrigin::automatic;
    }
    const BuildOutcome outcome = build_store(request_, common.context());
    const double seconds = watch.seconds();
    const double rate = static_cast<double>(outcome.points) / seconds;
    Summary summary;
    summary.json = {{"points", outcome.points},
                    {"nodata", outcome.nodata},
                    {"excluded", outcome.excluded},
                    {"lost", outcome.lost},
                    {"outliers", outcome.outliers},
                    {"empty_values", outcome.empty_values},
                    {"withheld", outcome.withheld},
                    {"seconds", seconds},
                    {"points_per_second", rate},
                    {"peak_rss_bytes", peak_rss_bytes()},
                    {"store_points", outcome.store_points},
                    {"store_bytes", outcome.store_bytes},
                    {"levels", outcome.top + 1},
                    {"reordered", outcome.order.reordered},
                    {"spread", outcome.order.spread},
                    {"temporary_bytes", outcome.order.temporary_bytes}};
    const std::string outliers =
        std::isfinite(request_.outlier_price)
            ? fmt::format("{} of them{} marked: outlier = 1\n", with_commas(outcome.outliers),
                          outcome.outliers == 1 ? " is" : " are")
            : std::string();
    std::string exclusions;
    if (outcome.nodata > 0) {
      exclusions = outcome.raster ? counted(outcome.nodata, "cell") + " without data"
                                  : with_commas(outcome.nodata) + " without a coordinate";
    }
    if (outcome.excluded > 0) {
      exclusions += (exclusions.empty() ? "" : " and ") +
                    counted(outcome.excluded, "point", "that was", "that were") + " not selected";
    }
    if (outcome.known > 0) {
      summary.json["known"] = outcome.known;
      exclusions += (exclusions.empty() ? "" : " and ") +
                    counted(outcome.known, "cell", "that the store has", "that the store has");
    }
    if (!exclusions.empty()) exclusions = fmt::format(" ({} left out)", exclusions);
    summary.text = fmt::format(
        "{}{} in {}, {}\n{}{}: {}{}, {}, peak memory {}\n", counted(outcome.points, entity()),
        exclusions, readable_seconds(seconds), readable_rate(rate), outliers, output_,
        request_.append ? counted(outcome.store_points, entity()) + ", " : std::string(),
        counted(outcome.top + 1, "level"), readable_bytes(outcome.store_bytes),
        readable_bytes(peak_rss_bytes()));
    if (outcome.surface) {
      summary.json["surface"] = {{"vertices", outcome.surface->vertices},
                                 {"triangles", outcome.surface->triangles},
                                 {"bytes", outcome.surface->bytes},
                                 {"input_triangles", outcome.input_triangles}};
      summary.text += fmt::format("surface: {}, {}{}, {} of the store\n",
                                  counted(outcome.surface->vertices, "vertex"),
                                  counted(outcome.surface->triangles, "triangle"),
                                  outcome.input_triangles > 0 ? " of the input" : "",
                                  readable_bytes(outcome.surface->bytes));
    }
    return summary;
  }

  /// Returns the options for opening the inputs before the build.
  [[nodiscard]] stream::SourceOptions source_options() const {
    return {.format = request_.input_format,
            .entities = request_.entities,
            .band = request_.band,
            .heights_of_colour = request_.heights_of_colour,
            .cell = request_.cell.value_or(0),
            .crs = request_.crs,
            .same_crs = &terrain::same_crs,
            .stop = stop_token()};
  }

  /// Builds a store of the first points, removes it and extrapolates its size and time.
  Summary estimate(const CommonOptions& common) {
    if (std::find(request_.inputs.begin(), request_.inputs.end(), "-") != request_.inputs.end()) {
      throw UsageError("--dry-run reads its input before the build does: name files instead of -");
    }
    stream::SourceOptions options = source_options();
    options.memory_bytes = common.reading_memory();
    options.selection = request_.selection;
    const auto source = stream::open_source(request_.inputs, options);
    const stream::SourceInfo& info = source->info();
    request_.most_points = kTrialPoints;
    const Stopwatch watch;
    Context context = common.context();
    context.progress = nullptr;
    context.note = nullptr;
    const BuildOutcome trial = build_store(request_, context);
    const double seconds = watch.seconds();

    // How many points have data is unknown before they are read, so assume the share of the trial.
    const double valid_share =
        static_cast<double>(trial.points) /
        static_cast<double>(std::max<std::uint64_t>(1, trial.points + trial.nodata));
    double points = info.points ? static_cast<double>(*info.points) * valid_share : -1.0;
    const bool read_all = trial.points < kTrialPoints;
    if (read_all) points = static_cast<double>(trial.points);
    return summary_of_estimate(trial, points, seconds);
  }

  /// Extrapolates from a trial run to `points`, which is negative if their number is unknown.
  [[nodiscard]] Summary summary_of_estimate(const BuildOutcome& trial, double points,
                                            double seconds) const {
    const double scale = points / static_cast<double>(trial.points);
    Summary summary;
    if (points < 0) {
      summary.json = {{"points", nullptr},
                      {"store_bytes", nullptr},
                      {"seconds", nullptr},
                      {"temporary_bytes", nullptr}};
      summary.text = fmt::format(
          "the number of points is unknown until the end of the input; a million take {} and {}\n",
          readable_seconds(seconds), readable_bytes(trial.store_bytes));
    } else {
      const auto bytes = static_cast<std::uint64_t>(static_cast<double>(trial.store_bytes) * scale);
      const auto temporary =
          static_cast<std::uint64_t>(static_cast<double>(trial.order.temporary_bytes) * scale);
      summary.json = {{"points", static_cast<std::uint64_t>(points)},
                      {"store_bytes", bytes},
                      {"seconds", seconds * scale},
                      {"temporary_bytes", temporary}};
      summary.text = fmt::format(
          "about {}, {} of disk{}, {}; nothing was written\n",
          counted(static_cast<std::uint64_t>(points), entity()), readable_bytes(bytes),
          temporary > 0 ? fmt::format(" and {} more while it runs", readable_bytes(temporary))
                        : std::string(),
          readable_seconds(seconds * scale));
    }
    return summary;
  }

  BuildRequest request_;
  SelectionOptions selection_;
  std::string output_, crs_, shift_, effort_ = "default", metric_ = "euclidean", order_ = "auto",
                                     strategy_ = "automatic", entities_ = "points";
  std::vector<std::string> channels_;
  std::optional<double> outlier_price_, facility_cost_;
  std::uint64_t block_ = 10000;
  bool dry_run_ = false, surface_ = false;
  std::string surface_from_;
};

}  // namespace

std::unique_ptr<Command> make_build() { return std::make_unique<BuildCommand>(); }

}  // namespace terrace::tools
