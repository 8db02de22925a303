// SPDX-License-Identifier: Apache-2.0
#include "tile/format/layer.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <iterator>

#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <terrace/stream/error.hpp>

#include "base/file_marks.hpp"
#include "base/json_of_file.hpp"

namespace terrace::terrain {
namespace {

using Json = nlohmann::ordered_json;

/// Checks the number, because the library would convert numbers of any kind and size.
std::uint32_t count_from(const Json& json) {
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > UINT32_MAX) {
    throw std::runtime_error(json.dump() + " where a non-negative integer is expected");
  }
  return json.get<std::uint32_t>();
}

TileRange range_from(const Json& json, unsigned zoom) {
  const TileRange range{count_from(json.at("startX")), count_from(json.at("startY")),
                        count_from(json.at("endX")), count_from(json.at("endY"))};
  if (range.x0 > range.x1 || range.y0 > range.y1 || range.x1 >= tile_columns(zoom) ||
      range.y1 >= tile_rows(zoom)) {
    throw std::runtime_error(fmt::format("a range of available tiles outside zoom {}", zoom));
  }
  return range;
}

TileLayer layer_from(const Json& json) {
  if (json.at("format") != "quantized-mesh-1.0") throw std::runtime_error("another tile format");
  if (json.value("scheme", "tms") != "tms") throw std::runtime_error("another scheme than tms");
  if (json.value("projection", "EPSG:4326") != "EPSG:4326") {
    throw std::runtime_error("another projection than EPSG:4326");
  }
  TileLayer layer;
  layer.name = json.value("name", "");
  const auto bounds = json.at("bounds").get<std::vector<double>>();
  if (bounds.size() != 4) throw std::runtime_error("bounds that are not four numbers");
  layer.bounds = {bounds[0], bounds[1], bounds[2], bounds[3]};
  layer.extensions = json.value("extensions", std::vector<std::string>{});
  const Json& available = json.at("available");
  if (!available.is_array() || available.empty() || available.size() > kDeepestZoom + 1) {
    throw std::runtime_error("no list of available tiles per zoom");
  }
  for (unsigned zoom = 0; zoom < available.size(); ++zoom) {
    layer.available.emplace_back();
    for (const Json& range : available[zoom]) {
      layer.available.back().push_back(range_from(range, zoom));
    }
  }
  layer.last_zoom = static_cast<unsigned>(available.size()) - 1;
  if (const auto zoom = json.find("minzoom"); zoom != json.end()) {
    layer.first_zoom = std::min<unsigned>(count_from(*zoom), layer.last_zoom);
  }
  if (const auto extension = json.find("terrace"); extension != json.end()) {
    layer.max_errors = extension->value("maxErrors", std::vector<double>{});
    layer.fingerprint = extension->value("fingerprint", "");
  }
  return layer;
}

}  // namespace

std::vector<TileRange> ranges_of(const std::vector<TileAddress>& tiles) {
  std::vector<TileRange> open, done;
  for (std::size_t i = 0; i < tiles.size();) {
    // Find the runs of one row. A run extends a rectangle that ends in the row below.
    const std::uint32_t y = tiles[i].y;
    std::vector<TileRange> row;
    for (; i < tiles.size() && tiles[i].y == y; ++i) {
      if (!row.empty() && row.back().x1 + 1 == tiles[i].x) {
        row.back().x1 = tiles[i].x;
      } else {
        row.push_back({tiles[i].x, y, tiles[i].x, y});
      }
    }
    std::vector<TileRange> next;
    for (TileRange& run : row) {
      const auto below = std::find_if(open.begin(), open.end(), [&](const TileRange& range) {
        return range.x0 == run.x0 && range.x1 == run.x1 && range.y1 + 1 == y;
      });
      if (below != open.end()) {
        run.y0 = below->y0;
        open.erase(below);
      }
      next.push_back(run);
    }
    done.insert(done.end(), open.begin(), open.end());
    open = std::move(next);
  }
  done.insert(done.end(), open.begin(), open.end());
  std::sort(done.begin(), done.end(), [](const TileRange& a, const TileRange& b) {
    return a.y0 != b.y0 ? a.y0 < b.y0 : a.x0 < b.x0;
  });
  return done;
}

std::string layer_json(const TileLayer& layer) {
  Json available = Json::array();
  for (const auto& ranges : layer.available) {
    Json list = Json::array();
    for (const TileRange& range : ranges) {
      list.push_back(
          {{"startX", range.x0}, {"startY", range.y0}, {"endX", range.x1}, {"endY", range.y1}});
    }
    available.push_back(std::move(list));
  }
  Json json{
      {"tilejson", "2.1.0"},
      {"name", layer.name},
      {"version", "1.0.0"},
      {"format", "quantized-mesh-1.0"},
      {"scheme", "tms"},
      {"projection", "EPSG:4326"},
      {"tiles", {"{z}/{x}/{y}.terrain?v={version}"}},
      {"extensions", layer.extensions},
      {"bounds", {layer.bounds.west, layer.bounds.south, layer.bounds.east, layer.bounds.north}},
      {"minzoom", layer.first_zoom},
      {"maxzoom", layer.last_zoom},
      {"available", std::move(available)},
      // Readers skip unknown keys.
      {"terrace",
       {{"mark", kWriterMark},
        {"maxErrors", layer.max_errors},
        {"fingerprint", layer.fingerprint}}},
  };
  // Without this key CesiumJS fails at every tile with metadata. With it, CesiumJS uses only the
  // metadata of tiles, each of which lists the tiles one zoom below.
  if (std::ranges::find(layer.extensions, "metadata") != layer.extensions.end()) {
    json["metadataAvailability"] = 1;
  }
  return json.dump(1) + "\n";
}

TileLayer read_layer(const std::string& path) {
  constexpr std::uint64_t kMaxBytes = std::uint64_t{256} << 20;  // for a fragmented coverage
  const auto json = json_of_file(path, kMaxBytes, "make the tiles again");
  if (!json) {
    throw stream::Error(path, "cannot be read").remedy("pass the folder of a finished tile set");
  }
  try {
    return layer_from(*json);
  } catch (const std::exception& error) {
    throw stream::Error(path,
                        std::string("does not describe a supported tile set: ") + error.what())
        .remedy("make the tiles again");
  }
}

}  // namespace terrace::terrain
