// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/selection_options.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/tile_check.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Adds a problem to the JSON list and to the text of the summary.
void add_problem(const stream::Problem& problem, nlohmann::ordered_json& list, std::string& text) {
  list.push_back({{"file", problem.file}, {"offset", problem.offset}, {"what", problem.what}});
  text += fmt::format("{}: byte {}: {}\n", problem.file, problem.offset, problem.what);
}

class VerifyCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("PATH", path_, "the store, or the folder of tiles, to check")->required();
    app.add_option(
        "--store", store_,
        "the store that the tiles were made from: heights are checked against all its samples");
    add_where(app, where_);
    add_number(app, "--max-error", max_error_,
               "error bound of the deepest zoom in metres, doubled at each zoom above (default: "
               "from layer.json)",
               kPositive)
        ->type_name("METRES");
    app.add_option("--vertical", vertical_,
                   "reference of the store's heights: ellipsoidal; orthometric, as for `terrace "
                   "tile`; ignore treats them as ellipsoidal");
    app.add_option("--geoid", geoid_, "the geoid grid that the tiles were made with")
        ->type_name("FILE");
  }

  Summary run(const CommonOptions& common) override {
    if (is_tile_folder(path_)) return verify_tiles(common);
    if (!store_.empty() || has_store_options()) {
      throw UsageError(
          "--store, --where, --max-error, --vertical and --geoid are for tile sets, and " + path_ +
          " is not one");
    }
    if (!stream::Store::exists(path_)) {
      throw stream::Error(path_, "there is neither a store nor a tile set here")
          .remedy("give a folder written by terrace build or terrace tile");
    }
    return verify_store(common);
  }

 private:
  [[nodiscard]] bool has_store_options() const {
    return !where_.empty() || max_error_ || !vertical_.empty() || !geoid_.empty();
  }

  [[nodiscard]] Summary verify_store(const CommonOptions& common) const {
    const Stopwatch watch;
    const stream::Store store = open_store(path_);
    Summary summary;
    nlohmann::ordered_json problems = nlohmann::ordered_json::array();
    const bool ok = store.verify(
        [&](const stream::Problem& problem) { add_problem(problem, problems, summary.text); },
        common.threads);
    std::uint64_t clusters = 0;
    for (const stream::LevelInfo& level : store.levels()) clusters += level.clusters;
    summary.json = {
        {"ok", ok}, {"problems", problems}, {"clusters", clusters}, {"points", store.points()}};
    summary.text += fmt::format("{}{} in {}, {}, checked in {}\n",
                                ok ? "sound: " : "damaged: ", counted(store.points(), "point"),
                                counted(clusters, "cluster"), readable_bytes(store.bytes()),
                                readable_seconds(watch.seconds()));
    summary.exit_code = ok ? 0 : 1;
    return summary;
  }

  [[nodiscard]] Summary verify_tiles(const CommonOptions& common) const {
    const Stopwatch watch;
    if (store_.empty() && has_store_options()) {
      throw UsageError("--where, --max-error, --vertical and --geoid need --store");
    }
    std::optional<stream::Store> store;
    if (!store_.empty()) store.emplace(open_store(store_, where_));
    const TileCheckResult result = check_tiles({.folder = path_,
                                                .max_error = max_error_,
                                                .store = store ? &*store : nullptr,
                                                .vertical = parse_height_reference(vertical_),
                                                .geoid = geoid_},
                                               common.context());

    Summary summary;
    nlohmann::ordered_json problems = nlohmann::ordered_json::array();
    for (const stream::Problem& problem : result.problems) {
      add_problem(problem, problems, summary.text);
    }
    const nlohmann::ordered_json zooms = add_zooms(result, store.has_value(), summary.text);
    const bool ok = result.problems.empty();
    if (result.torn > 0) {
      summary.text += counted(result.torn, "file") +
                      " left over from a killed run and not part of the set: the next `terrace "
                      "tile` into the folder removes them\n";
    }
    summary.json = {{"ok", ok},
                    {"problems", problems},
                    {"tiles", result.tiles},
                    {"samples", result.samples},
                    {"left_over", result.torn},
                    {"zooms", zooms}};
    summary.text += fmt::format("{}{}, checked in {}\n",
                                ok ? "sound: " : "damaged: ", counted(result.tiles, "tile"),
                                readable_seconds(watch.seconds()));
    summary.exit_code = ok ? 0 : 1;
    return summary;
  }

  /// Returns the zooms as a JSON list and adds a line for each to `text`. `has_samples` means that
  /// the tiles were compared with the samples of a store.
  static nlohmann::ordered_json add_zooms(const TileCheckResult& result, bool has_samples,
                                          std::string& text) {
    nlohmann::ordered_json zooms = nlohmann::ordered_json::array();
    for (const ZoomCheck& zoom : result.zooms) {
      nlohmann::ordered_json line{{"zoom", zoom.zoom}, {"tiles", zoom.tiles}};
      text += fmt::format("zoom {}: {}", zoom.zoom, counted(zoom.tiles, "tile"));
      if (has_samples) {
        line["samples"] = zoom.samples;
        line["covered"] = zoom.samples - zoom.uncovered;
        line["uncovered"] = zoom.uncovered;
        line["max_error"] = zoom.max_error;
        text += fmt::format(
            ", within {} m of {}{}", readable_bound(zoom.max_error),
            zoom.uncovered == 0 ? "all " : with_commas(zoom.samples - zoom.uncovered) + " of ",
            counted(zoom.samples, "sample"));
        if (zoom.uncovered > 0) {
          text += fmt::format(" ({}{} on no triangle)", with_commas(zoom.uncovered),
                              zoom.uncovered == 1 ? " is" : " are");
        }
      }
      text += "\n";
      zooms.push_back(std::move(line));
    }
    return zooms;
  }

  std::string path_, store_, where_, vertical_, geoid_;
  std::optional<double> max_error_;
};

}  // namespace

std::unique_ptr<Command> make_verify() { return std::make_unique<VerifyCommand>(); }

}  // namespace terrace::tools
