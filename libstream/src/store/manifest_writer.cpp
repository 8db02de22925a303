// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>

#include <nlohmann/json.hpp>

#include "store/codec/bytes.hpp"
#include "store/manifest.hpp"

namespace terrace::stream::store {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has no infinities and NaN, which are rare enough to be words.
Json number(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
}

Json channel_json(const Channel& channel) {
  return {{"name", channel.name},
          {"type", std::string(name_of(channel.type))},
          {"scale", number(channel.scale)},
          {"offset", number(channel.offset)},
          {"unit", channel.unit}};
}

Json point_json(const Point3& p) { return Json::array({number(p[0]), number(p[1]), number(p[2])}); }

Json file_json(const FileEntry& file) {
  return {{"file", file.name}, {"bytes", file.bytes}, {"crc32", hexadecimal(file.checksum)}};
}

Json box_json(const Box3& box) {
  return {{"min", point_json(box.min)}, {"max", point_json(box.max)}};
}

/// Leaves out what a segment shares with its store.
Json segment_json(const SegmentEntry& segment, const Box3& bounds) {
  Json json = {{"clusters", segment.clusters},
               {"data", file_json(segment.data)},
               {"index", file_json(segment.index)},
               {"directory_bytes", segment.directory_bytes}};
  if (segment.bounds != bounds) json["bounds"] = box_json(segment.bounds);
  const auto is_zero = [](auto number) { return number == 0; };
  if (!std::all_of(segment.base.begin(), segment.base.end(), is_zero)) json["base"] = segment.base;
  if (!std::all_of(segment.shift.begin(), segment.shift.end(), is_zero)) {
    json["shift"] = segment.shift;
  }
  return json;
}

Json crs_json(const Crs& crs) {
  return {{"epsg", crs.epsg},
          {"vertical_epsg", crs.vertical_epsg},
          {"name", crs.name},
          {"geographic", crs.geographic},
          {"horizontal_unit", crs.horizontal_unit},
          {"vertical_unit", crs.vertical_unit},
          {"wkt", crs.wkt}};
}

Json to_json(const Manifest& m) {
  Json json;
  json["format"] = kFormatName;
  json["version"] = m.version;
  json["kind"] = m.schema.grid ? "grid" : "cloud";
  json["source"] = m.schema.format;
  json["points"] = m.points;
  json["nodata"] = m.schema.nodata;
  json["columns"] = m.schema.columns;
  json["rows"] = m.schema.rows;
  json["bounds"] = m.bounds.empty() ? Json(nullptr) : box_json(m.bounds);
  json["mean_height"] = number(m.mean_height);
  json["coordinates"] = Json::array();
  for (const Channel& channel : m.schema.coordinates) {
    json["coordinates"].push_back(channel_json(channel));
  }
  json["attributes"] = Json::array();
  for (const Channel& channel : m.schema.attributes) {
    json["attributes"].push_back(channel_json(channel));
  }
  json["world"] = Json::array();
  for (const double c : m.schema.world.xy) json["world"].push_back(number(c));
  json["crs"] = crs_json(m.schema.crs);
  json["vertical"] = m.schema.vertical;
  json["parameters"] = Json::array();
  for (const auto& [name, value] : m.schema.parameters) {
    json["parameters"].push_back({{"name", name}, {"value", value}});
  }
  json["levels"] = Json::array();
  for (std::size_t l = 0; l < m.levels.size(); ++l) {
    const LevelEntry& level = m.levels[l];
    Json segments = Json::array();
    for (const SegmentEntry& segment : level.segments) {
      segments.push_back(segment_json(segment, m.bounds));
    }
    json["levels"].push_back({{"level", l},
                              {"points", level.points},
                              {"members", level.members},
                              {"clusters", level.clusters},
                              {"segments", std::move(segments)}});
  }
  if (m.surface) {
    json["surface"] = {{"vertices", m.surface->vertices},
                       {"triangles", m.surface->triangles},
                       {"data", file_json(m.surface->file)}};
  }
  return json;
}

}  // namespace

std::string to_text(const Manifest& manifest) {
  Json json = to_json(manifest);
  json["checksum"] = kZeros;
  std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  const std::uint32_t checksum = crc32(0, text.data(), text.size());
  const std::size_t at = text.size() - kClosing.size() - kZeros.size();
  text.replace(at, kZeros.size(), hexadecimal(checksum));
  return text;
}

bool is_as_written(const std::string& text, const Manifest& manifest) {
  Json json = to_json(manifest);
  json["checksum"] = hexadecimal(manifest.checksum);
  // Objects of this kind of JSON are equal only if their keys have the same order.
  return Json::parse(text, nullptr, /*allow_exceptions=*/false) == json;
}

}  // namespace terrace::stream::store
