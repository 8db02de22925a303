// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/region.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>

#include <nlohmann/json.hpp>

#include "base/units.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// a + b as sum and rounding error, exactly (Knuth).
void two_sum(double a, double b, double& sum, double& rest) {
  sum = a + b;
  const double part = sum - a;
  rest = (a - (sum - part)) + (b - part);
}

/// The sign of a sum of products, exactly: each product is two doubles, and a sorted expansion of
/// non-overlapping parts grows by one double after the other.
class ExactSum {
 public:
  void add_product(double a, double b) {
    const double product = a * b;
    add(std::fma(a, b, -product));
    add(product);
  }
  [[nodiscard]] int sign() const {
    for (std::size_t i = size_; i-- > 0;) {
      if (parts_[i] != 0) return parts_[i] > 0 ? 1 : -1;
    }
    return 0;
  }

 private:
  void add(double value) {
    for (std::size_t i = 0; i < size_; ++i) {
      double sum = 0, rest = 0;
      two_sum(value, parts_[i], sum, rest);
      parts_[i] = rest;
      value = sum;
    }
    parts_[size_++] = value;
  }

  std::array<double, 12> parts_{};
  std::size_t size_ = 0;
};

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

int orientation(const Point2& a, const Point2& b, const Point2& c) {
  const double left = (b[0] - a[0]) * (c[1] - a[1]);
  const double right = (b[1] - a[1]) * (c[0] - a[0]);
  const double determinant = left - right;
  const double bound =
      (std::abs(left) + std::abs(right)) * 4 * std::numeric_limits<double>::epsilon();
  if (determinant > bound) return 1;
  if (-determinant > bound) return -1;
  ExactSum sum;
  sum.add_product(a[0], b[1]);
  sum.add_product(-a[1], b[0]);
  sum.add_product(b[0], c[1]);
  sum.add_product(-b[1], c[0]);
  sum.add_product(c[0], a[1]);
  sum.add_product(-c[1], a[0]);
  return sum.sign();
}

bool covers(const Polygon& polygon, const Point2& p) {
  bool inside = false;
  for (const std::vector<Point2>& ring : polygon) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Point2& a = ring[i];
      const Point2& b = ring[i + 1 == ring.size() ? 0 : i + 1];
      const bool in_height = std::min(a[1], b[1]) <= p[1] && p[1] <= std::max(a[1], b[1]);
      if (!in_height) continue;
      const int side = orientation(a, b, p);
      if (side == 0 && std::min(a[0], b[0]) <= p[0] && p[0] <= std::max(a[0], b[0])) return true;
      // A ray to the right meets the edge's half-open span of heights: crossings are counted once.
      const bool upward = a[1] <= p[1] && p[1] < b[1];
      const bool downward = b[1] <= p[1] && p[1] < a[1];
      if ((upward && side > 0) || (downward && side < 0)) inside = !inside;
    }
  }
  return inside;
}

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

std::optional<unsigned> parse_level(const std::string& text) {
  if (text == "top") return std::nullopt;
  unsigned level = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), level);
  if (error != std::errc{} || end != text.data() + text.size() || level > 255) {
    throw UsageError("'" + text + "' is not a level; write a number from 0 (full detail) or 'top'");
  }
  return level;
}

Focus parse_focus(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) {
    throw UsageError("the focus '" + text + "' names no level; write BOX:L");
  }
  return {.region = Region::parse(text.substr(0, colon)),
          .level = parse_level(text.substr(colon + 1))};
}

}  // namespace terrace::terrain
