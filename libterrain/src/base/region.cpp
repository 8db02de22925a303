// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/region.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <terrace/tri/predicates.hpp>

#include "base/geojson_crs.hpp"
#include "base/json_of_file.hpp"
#include "base/region_shape.hpp"
#include "base/units.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

stream::Error fault(const std::string& file, std::string cause) {
  return stream::Error(file, std::move(cause))
      .remedy("pass a GeoJSON file with polygons, or minx,miny,maxx,maxy");
}

std::vector<Point2> ring_of(const nlohmann::json& json, const std::string& file) {
  std::vector<Point2> ring;
  if (!json.is_array()) throw fault(file, "a polygon's ring is not a list of positions");
  for (const nlohmann::json& position : json) {
    if (!position.is_array() || position.size() < 2 || !position[0].is_number() ||
        !position[1].is_number()) {
      throw fault(file, "a position is not a pair of numbers");
    }
    ring.push_back({position[0].get<double>(), position[1].get<double>()});
    if (!std::isfinite(ring.back()[0]) || !std::isfinite(ring.back()[1])) {
      throw fault(file, "a position is not finite");
    }
  }
  if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  if (ring.size() < 3) throw fault(file, "a polygon's ring has fewer than three corners");
  return ring;
}

Polygon polygon_of(const nlohmann::json& rings, const std::string& file) {
  Polygon polygon;
  if (!rings.is_array() || rings.empty()) throw fault(file, "a polygon has no ring");
  for (const nlohmann::json& ring : rings) polygon.push_back(ring_of(ring, file));
  return polygon;
}

/// Appends the polygons of any GeoJSON object. depth limits recursion, as a file could exhaust the
/// stack.
void collect_polygons(const nlohmann::json& json, const std::string& file, int depth,
                      std::vector<Polygon>& polygons) {
  if (!json.is_object() || !json.contains("type") || !json["type"].is_string() || depth > 8) {
    throw fault(file, "not a GeoJSON object");
  }
  if (depth > 0 && json.contains("crs") && !json["crs"].is_null()) {
    throw stream::Error(file, "an object within it has its own crs")
        .remedy(stream::message("write one crs for all, as the first member of the file, or "
                                "give {region_crs}"));
  }
  const std::string type = json["type"].get<std::string>();
  const auto member = [&](const char* name) -> const nlohmann::json& {
    if (!json.contains(name)) throw fault(file, fmt::format("{} without '{}'", type, name));
    return json[name];
  };
  const auto each = [&](const nlohmann::json& list) {
    if (!list.is_array()) throw fault(file, type + " without a list");
    for (const nlohmann::json& part : list) collect_polygons(part, file, depth + 1, polygons);
  };
  if (type == "FeatureCollection") {
    each(member("features"));
  } else if (type == "GeometryCollection") {
    each(member("geometries"));
  } else if (type == "Feature") {
    // A feature may have a null geometry (RFC 7946, 3.2).
    const nlohmann::json& geometry = member("geometry");
    if (!geometry.is_null()) collect_polygons(geometry, file, depth + 1, polygons);
  } else if (type == "MultiPolygon") {
    const nlohmann::json& parts = member("coordinates");
    if (!parts.is_array()) throw fault(file, "MultiPolygon without a list");
    for (const nlohmann::json& part : parts) polygons.push_back(polygon_of(part, file));
  } else if (type == "Polygon") {
    polygons.push_back(polygon_of(member("coordinates"), file));
  } else {
    throw fault(file, "a region cannot be a " + type);
  }
}

Region read_geojson(const std::string& name, const std::stop_token& stop) {
  const auto json = json_of_file(name, kMaxGeoJsonBytes, convert_to_geojson(name), stop);
  if (!json) throw fault(name, "neither a box nor a file that can be read");
  std::vector<Polygon> polygons;
  collect_polygons(*json, name, 0, polygons);
  if (polygons.empty()) throw fault(name, "contains no polygon");
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return Region::of_polygons(std::move(polygons), -kInfinity, kInfinity, name, stop)
      .in_crs(crs_of_geojson(*json, name));
}

/// A box is a list of numbers, so any text of only such characters with a comma is read as a box.
bool looks_like_numbers(const std::string& text) {
  return text.find(',') != std::string::npos &&
         text.find_first_not_of("0123456789+-.,eE ") == std::string::npos;
}

}  // namespace

std::optional<PlacesCrs> crs_of_geojson(const nlohmann::json& object, const std::string& file) {
  if (!object.is_object() || !object.contains("crs")) return PlacesCrs{.name = {}, .file = file};
  const nlohmann::json& crs = object["crs"];
  if (crs.is_null()) return std::nullopt;
  const nlohmann::json::json_pointer name("/properties/name");
  if (!crs.is_object() || !crs.contains(name) || !crs.at(name).is_string() ||
      crs.at(name).get_ref<const std::string&>().empty()) {
    throw stream::Error(file, "its crs does not name a CRS")
        .remedy(stream::message("write {}, or give {region_crs}",
                                R"({"type": "name", "properties": {"name": "EPSG:n"}})"));
  }
  return PlacesCrs{.name = crs.at(name).get<std::string>(), .file = file};
}

std::string geojson_crs_member(const stream::Crs& crs) {
  if (crs.epsg == 4326) return {};
  const std::string name =
      crs.epsg != 0 ? fmt::format("urn:ogc:def:crs:EPSG::{}", crs.epsg) : crs.wkt;
  if (name.empty()) return "\"crs\":null,";
  return R"("crs":{"type":"name","properties":{"name":)" + nlohmann::json(name).dump() + "}},";
}

Region Region::parse(const std::string& text, const std::stop_token& stop) {
  Region region;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (looks_like_numbers(text)) {
    const std::vector<double> v = parse_numbers(text, "the box '" + text + "'");
    if (v.size() == 4) {
      region.box_ = {.min = {v[0], v[1], -kInfinity}, .max = {v[2], v[3], kInfinity}};
    } else if (v.size() == 6) {
      region.box_ = {.min = {v[0], v[1], v[2]}, .max = {v[3], v[4], v[5]}};
    } else {
      throw UsageError("the box '" + text + "' has " + counted(v.size(), "number") +
                       "; write minx,miny,maxx,maxy or minx,miny,minz,maxx,maxy,maxz");
    }
    if (region.box_.empty()) {
      throw UsageError("the box '" + text + "' has a minimum above its maximum" +
                       (v[0] > v[v.size() / 2] && std::abs(v[0]) <= 180
                            ? " (across the antimeridian longitudes continue: 170 to 190)"
                            : ""));
    }
    return region;
  }
  return read_geojson(text, stop);
}

Region Region::of_box(const stream::Box3& box) {
  Region region;
  region.box_ = box;
  return region;
}

Region Region::in_crs(std::optional<PlacesCrs> crs) const {
  Region region = *this;
  region.crs_ = std::move(crs);
  return region;
}

Region Region::with_extent(const stream::Box3& extent) const {
  Region region = *this;
  region.extent_ = extent;
  return region;
}

Region Region::of_polygons(std::vector<Polygon> polygons, double low, double high,
                           const std::string& file, const std::stop_token& stop) {
  return of_shape(std::make_shared<RegionShape>(std::move(polygons), file, stop), low, high);
}

Region Region::of_shape(std::shared_ptr<const RegionShape> shape, double low, double high) {
  Region region;
  region.shape_ = std::move(shape);
  for (const Polygon& polygon : region.polygons()) {
    for (const Point2& p : polygon.front()) {
      region.box_.include(stream::Point3{p[0], p[1], low});
      region.box_.include(stream::Point3{p[0], p[1], high});
    }
  }
  return region;
}

const std::vector<Polygon>& Region::polygons() const {
  static const std::vector<Polygon> none;
  return shape_ ? shape_->polygons() : none;
}

bool Region::contains(const stream::Point3& p) const {
  return box_.contains(p) && (!shape_ || shape_->covers({p[0], p[1]}));
}

bool Region::covers(const Point2& place) const {
  return contains({place[0], place[1], std::clamp(0.0, box_.min[2], box_.max[2])});
}

void Region::restrict(stream::Selection& selection) const {
  // The source itself widens a box by its possible rounding.
  selection.region = shape_ ? box_ : extent();
  selection.covers = {};
  if (shape_) {
    selection.covers = [shape = shape_](const Point2& place) { return shape->covers(place); };
  }
}

Overlap Region::overlap(const stream::Box3& box) const {
  if (box.empty() || !box_.intersects(box)) return Overlap::none;
  const bool inside = box_.contains(box.min) && box_.contains(box.max);
  if (!shape_) return inside ? Overlap::whole : Overlap::part;
  // Only the part within the bounds matters, which is also finite.
  Point2 low{}, high{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    low[axis] = std::max(box.min[axis], box_.min[axis]);
    high[axis] = std::min(box.max[axis], box_.max[axis]);
  }
  const Overlap flat = shape_->overlap(low, high);
  return flat == Overlap::whole && !inside ? Overlap::part : flat;
}

bool Region::touches(const std::array<stream::Point3, 3>& triangle) const {
  stream::Box3 bounds;
  for (const stream::Point3& corner : triangle) bounds.include(corner);
  if (!bounds.intersects(box_)) return false;
  std::array<Point2, 3> flat{};
  for (std::size_t i = 0; i < 3; ++i) flat[i] = {triangle[i][0], triangle[i][1]};
  if (shape_) return shape_->touches(flat);
  // If the bounds meet, two convex shapes are disjoint only if a side of the triangle separates
  // them.
  const int turn = tri::orientation(flat[0], flat[1], flat[2]);
  for (std::size_t i = 0; i < 3; ++i) {
    int least = 1, most = -1;
    for (unsigned corner = 0; corner < 4; ++corner) {
      const Point2 p{(corner & 1 ? box_.max : box_.min)[0], (corner & 2 ? box_.max : box_.min)[1]};
      const int side = tri::orientation(flat[i], flat[(i + 1) % 3], p);
      least = std::min(least, side);
      most = std::max(most, side);
    }
    if ((most < 0 && turn >= 0) || (least > 0 && turn <= 0)) return false;
  }
  return true;
}

}  // namespace terrace::terrain
