// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/region.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include <nlohmann/json.hpp>

#include "base/polygon.hpp"
#include "base/units.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

[[noreturn]] void fail(const std::string& file, const std::string& cause) {
  throw stream::Error({.file = file,
                       .where = {},
                       .cause = cause,
                       .remedy = "give a GeoJSON file with polygons, or minx,miny,maxx,maxy"});
}

std::vector<Point2> ring_of(const nlohmann::json& json, const std::string& file) {
  std::vector<Point2> ring;
  if (!json.is_array()) fail(file, "a polygon's ring is not a list of positions");
  for (const nlohmann::json& position : json) {
    if (!position.is_array() || position.size() < 2 || !position[0].is_number() ||
        !position[1].is_number()) {
      fail(file, "a position is not a pair of numbers");
    }
    ring.push_back({position[0].get<double>(), position[1].get<double>()});
    if (!std::isfinite(ring.back()[0]) || !std::isfinite(ring.back()[1])) {
      fail(file, "a position is not finite");
    }
  }
  if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  if (ring.size() < 3) fail(file, "a polygon's ring has fewer than three corners");
  return ring;
}

Polygon polygon_of(const nlohmann::json& rings, const std::string& file) {
  Polygon polygon;
  if (!rings.is_array() || rings.empty()) fail(file, "a polygon has no ring");
  for (const nlohmann::json& ring : rings) polygon.push_back(ring_of(ring, file));
  return polygon;
}

/// Appends the polygons of any GeoJSON object. depth guards against files made to exhaust the
/// stack.
void collect_polygons(const nlohmann::json& json, const std::string& file, int depth,
                      std::vector<Polygon>& polygons) {
  if (!json.is_object() || !json.contains("type") || !json["type"].is_string() || depth > 8) {
    fail(file, "not a GeoJSON object");
  }
  const std::string type = json["type"].get<std::string>();
  const auto member = [&](const char* name) -> const nlohmann::json& {
    if (!json.contains(name)) fail(file, type + " without '" + name + "'");
    return json[name];
  };
  const auto each = [&](const nlohmann::json& list) {
    if (!list.is_array()) fail(file, type + " without a list");
    for (const nlohmann::json& part : list) collect_polygons(part, file, depth + 1, polygons);
  };
  if (type == "FeatureCollection") {
    each(member("features"));
  } else if (type == "GeometryCollection") {
    each(member("geometries"));
  } else if (type == "Feature") {
    collect_polygons(member("geometry"), file, depth + 1, polygons);
  } else if (type == "MultiPolygon") {
    const nlohmann::json& parts = member("coordinates");
    if (!parts.is_array()) fail(file, "MultiPolygon without a list");
    for (const nlohmann::json& part : parts) polygons.push_back(polygon_of(part, file));
  } else if (type == "Polygon") {
    polygons.push_back(polygon_of(member("coordinates"), file));
  } else {
    fail(file, "a region cannot be a " + type);
  }
}

std::vector<Polygon> read_geojson(const std::string& name) {
  std::ifstream file(name);
  if (!file) fail(name, "neither a box nor a file that can be read");
  std::vector<Polygon> polygons;
  try {
    collect_polygons(nlohmann::json::parse(file), name, 0, polygons);
  } catch (const nlohmann::json::exception& error) {
    fail(name, std::string("not JSON (") + error.what() + ")");
  }
  if (polygons.empty()) fail(name, "holds no polygon");
  return polygons;
}

/// A box is a list of numbers: whatever begins like one and has a comma is taken as such.
bool looks_like_numbers(const std::string& text) {
  return text.find(',') != std::string::npos &&
         text.find_first_not_of("0123456789+-.,eE ") == std::string::npos;
}

}  // namespace

Region Region::parse(const std::string& text) {
  Region region;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (looks_like_numbers(text)) {
    const std::vector<double> v = parse_numbers(text, "the box '" + text + "'");
    if (v.size() == 4) {
      region.box_ = {.min = {v[0], v[1], -kInfinity}, .max = {v[2], v[3], kInfinity}};
    } else if (v.size() == 6) {
      region.box_ = {.min = {v[0], v[1], v[2]}, .max = {v[3], v[4], v[5]}};
    } else {
      throw UsageError("the box '" + text + "' has " + std::to_string(v.size()) +
                       " numbers; write minx,miny,maxx,maxy or minx,miny,minz,maxx,maxy,maxz");
    }
    if (region.box_.empty()) {
      throw UsageError("the box '" + text + "' has a minimum above its maximum");
    }
    return region;
  }
  return of_polygons(read_geojson(text), -kInfinity, kInfinity);
}

Region Region::of_box(const stream::Box3& box) {
  Region region;
  region.box_ = box;
  return region;
}

Region Region::of_polygons(std::vector<Polygon> polygons, double low, double high) {
  Region region;
  region.polygons_ = std::move(polygons);
  for (const Polygon& polygon : region.polygons_) {
    for (const Point2& p : polygon.front()) {
      region.box_.include(stream::Point3{p[0], p[1], low});
      region.box_.include(stream::Point3{p[0], p[1], high});
    }
  }
  return region;
}

bool Region::contains(const stream::Point3& p) const {
  if (!box_.contains(p)) return false;
  if (polygons_.empty()) return true;
  for (const Polygon& polygon : polygons_) {
    if (covers(polygon, {p[0], p[1]})) return true;
  }
  return false;
}

}  // namespace terrace::terrain
