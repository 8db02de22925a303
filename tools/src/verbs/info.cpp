// SPDX-License-Identifier: GPL-3.0-or-later
#include "verbs/info.hpp"

#include <optional>

#include "base/units.hpp"
#include "earth/crs/crs_definition.hpp"
#include "earth/crs/datum_change.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::tools {

using namespace terrain;

nlohmann::ordered_json json_of(const stream::Box3& box) {
  if (box.empty()) return nullptr;
  nlohmann::ordered_json json;
  json["min"] = box.min;
  json["max"] = box.max;
  return json;
}

nlohmann::ordered_json json_of(const stream::Crs& crs) {
  if (crs == stream::Crs{}) return nullptr;
  nlohmann::ordered_json json;
  const auto text = [](const std::string& value) {
    return value.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(value);
  };
  json["epsg"] = crs.epsg == 0 ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(crs.epsg);
  json["name"] = text(crs.name);
  json["wkt"] = text(crs.wkt);
  json["geographic"] = crs.geographic;
  json["horizontal_unit"] = text(crs.horizontal_unit);
  json["vertical_epsg"] = crs.vertical_epsg == 0 ? nlohmann::ordered_json(nullptr)
                                                 : nlohmann::ordered_json(crs.vertical_epsg);
  json["vertical_unit"] = text(crs.vertical_unit);
  return json;
}

nlohmann::ordered_json json_of(const stream::Channel& channel) {
  nlohmann::ordered_json json;
  json["name"] = channel.name;
  json["type"] = stream::name_of(channel.type);
  json["scale"] = channel.scale;
  json["offset"] = channel.offset;
  json["unit"] = channel.unit;
  return json;
}

std::string text_of(const stream::Crs& crs, const stream::Box3& bounds) {
  std::string text = crs.epsg != 0 ? "EPSG:" + std::to_string(crs.epsg) : "";
  if (!crs.name.empty()) text += text.empty() ? crs.name : " (" + crs.name + ")";
  if (text.empty()) text = crs.wkt.empty() ? "unknown" : crs.wkt.substr(0, 60) + "...";
  if (crs.vertical_epsg != 0) text += " + EPSG:" + std::to_string(crs.vertical_epsg);
  try {
    const std::optional<CrsDefinition> known = definition_of(crs);
    if (!known) return text;
    const CoordinateSystem system = CoordinateSystem(*known).over(bounds);
    const DatumChange& change = system.to_wgs84();
    if (!change.possible()) {
      text += ", datum " + known->datum + " without a way to WGS 84";
      if (!change.better().empty()) text += ": " + change.better();
    } else if (!change.identity()) {
      text += ", to WGS 84 by " + change.description();
    } else if (change.accuracy().value_or(0) > 0) {
      text += ", counts as WGS 84 within " + number_text(*change.accuracy()) + " m";
      if (!change.better().empty()) text += " (" + change.better() + ")";
    }
  } catch (const CrsError& error) {
    text += std::string(", ") + error.what();
  }
  return text;
}

std::string text_of(const stream::Box3& box) {
  if (box.empty()) return "none";
  const auto corner = [](const stream::Point3& p) {
    // A nanodegree, or a millimetre of what is projected.
    return readable_number(p[0], 10) + ' ' + readable_number(p[1], 10) + ' ' +
           readable_number(p[2], 10);
  };
  return corner(box.min) + "  to  " + corner(box.max);
}

std::string text_of(const stream::Channel& channel) {
  std::string text = channel.name + ' ' + std::string(stream::name_of(channel.type));
  if (channel.scale != 1) text += " x " + number_text(channel.scale);
  if (channel.offset != 0) text += " + " + number_text(channel.offset);
  if (!channel.unit.empty()) text += " (" + channel.unit + ")";
  return text;
}

}  // namespace terrace::tools
