// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
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
#include "terrace/terrain/output_kinds.hpp"
#include "terrace/terrain/tiles.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Sets the zooms from "LAST" or "FIRST-LAST". An empty text changes nothing. Throws UsageError.
void set_zooms(const std::string& text, TilesRequest& request) {
  if (text.empty()) return;
  const auto number = [&](std::string_view part) {
    const auto value = number_from<unsigned>(part);
    if (!value) throw UsageError(fmt::format("--zoom '{}': FIRST-LAST, as in 0-14", text));
    return *value;
  };
  const std::size_t dash = text.find('-');
  if (dash != std::string::npos) {
    request.first_zoom = number(std::string_view(text).substr(0, dash));
  }
  request.last_zoom =
      number(std::string_view(text).substr(dash == std::string::npos ? 0 : dash + 1));
}

/// Sets the fill from "interpolate", "flat" or "flat:METRES". Throws UsageError.
void set_fill(const std::string& text, TilesRequest& request) {
  if (text.starts_with("flat:")) {
    request.flat_height = parse_number(text.substr(5), "--fill flat");
  } else if (text != "interpolate" && text != "flat") {
    throw UsageError(fmt::format("--fill '{}': interpolate, flat or flat:METRES", text));
  }
  request.fill = text == "interpolate" ? Fill::interpolate : Fill::flat;
}

class TileCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", store_, "the store to read: a raster, or irregular points")->required();
    add_output(app, output_, "the folder to write");
    app.add_option("--format", format_, "quantized-mesh")->capture_default_str();
    app.add_option("--zoom", zoom_,
                   "FIRST-LAST (default: from 0 to the zoom that shows every sample)");
    add_number(app, "--max-error", max_error_,
               "error bound of the deepest zoom in metres, doubled at each zoom above (default: "
               "what globes expect, 77067 / 2^zoom)",
               kPositive)
        ->type_name("METRES");
    app.add_option("--quality", quality_, "greedy, removal (fewer triangles) or fitted")
        ->capture_default_str();
    app.add_option("--fill", fill_,
                   "heights where there is no data: interpolate (0 beyond the outline of the "
                   "data), flat (the store's lowest height) or flat:METRES")
        ->capture_default_str();
    app.add_flag("--gzip", gzip_,
                 "compress the tiles; the server must send Content-Encoding: gzip with them");
    app.add_flag("--normals", normals_, "add normals at the vertices, for lighting");
    app.add_option(
           "--water", water_,
           "add a water mask: nodata (cells of a raster without data), or a height of the store")
        ->type_name("nodata|HEIGHT");
    app.add_flag("--metadata", metadata_, "list in each tile the tiles below it");
    app.add_option("--vertical", vertical_,
                   "ellipsoidal: heights are above the ellipsoid; ignore: treat them as if they "
                   "were; orthometric: heights are above sea level, and are converted from the "
                   "store's vertical CRS, or from EGM96 if it has none");
    app.add_option("--geoid", geoid_, "a geoid grid of GeographicLib, added to the heights")
        ->type_name("FILE");
    app.add_flag("--resume", resume_,
                 "continue an interrupted run, or repair a finished set; intact tiles are kept");
    add_where(app, where_);
    app.add_option("--name", name_, "name of the tile set, for layer.json");
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kTileSet, output_);
    const Stopwatch watch;
    const TilesOutcome result =
        write_tiles(open_store(store_, where_), request(common), common.context());

    Summary summary;
    nlohmann::ordered_json zooms = nlohmann::ordered_json::array();
    for (const TileZoom& zoom : result.zooms) {
      zooms.push_back({{"zoom", zoom.zoom}, {"tiles", zoom.tiles}, {"max_error", zoom.max_error}});
      summary.text += fmt::format("zoom {}: {}, within {} m\n", zoom.zoom,
                                  counted(zoom.tiles, "tile"), readable_bound(zoom.max_error));
    }
    summary.json = {{"tiles", result.tiles}, {"bytes", result.bytes},     {"made", result.made},
                    {"kept", result.kept},   {"removed", result.removed}, {"zooms", zooms}};
    summary.add_cost(watch);
    summary.text += fmt::format("{}: {}, {}, in {}", output_, counted(result.tiles, "tile"),
                                readable_bytes(result.bytes), readable_seconds(watch.seconds()));
    if (result.made < result.tiles) {
      summary.text += fmt::format("; {} already existed", with_commas(result.tiles - result.made));
    }
    summary.text += "\n";
    return summary;
  }

 private:
  [[nodiscard]] TilesRequest request(const CommonOptions& common) const {
    if (format_ != "quantized-mesh") {
      throw UsageError(fmt::format("--format '{}': only quantized-mesh is supported", format_));
    }
    TilesRequest request{.folder = output_, .name = name_};
    set_zooms(zoom_, request);
    request.max_error = max_error_;
    request.quality = parse_quality(quality_);
    request.vertical = parse_height_reference(vertical_);
    request.geoid = geoid_;
    set_fill(fill_, request);
    request.water = !water_.empty();
    if (request.water && water_ != "nodata") request.water_height = parse_number(water_, "--water");
    request.normals = normals_;
    request.metadata = metadata_;
    request.gzip = gzip_;
    request.resume = resume_;
    request.replace = common.force;
    return request;
  }

  std::string store_, output_, format_ = "quantized-mesh", zoom_, quality_ = "removal";
  std::string fill_ = "interpolate", water_, vertical_, geoid_, name_, where_;
  std::optional<double> max_error_;
  bool gzip_ = false, normals_ = false, metadata_ = false, resume_ = false;
};

}  // namespace

std::unique_ptr<Command> make_tile() { return std::make_unique<TileCommand>(); }

}  // namespace terrace::tools
