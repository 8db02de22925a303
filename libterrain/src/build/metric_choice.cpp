// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/metric_choice.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <terrace/base/portable_math.hpp>

#include "base/json_of_file.hpp"
#include "base/units.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// The file and the region being read, for messages.
struct Place {
  const std::string& file;
  std::size_t region;

  [[nodiscard]] stream::Error fault(std::string cause) const {
    return stream::Error(file, std::move(cause))
        .at(fmt::format("region {}", region))
        .remedy(
            "a region is {\"box\": [minx, miny, maxx, maxy], \"semi_axes\": "
            "[a, b], \"angle\": degrees}");
  }
};

std::vector<double> numbers(const nlohmann::json& json, const char* name, const Place& place) {
  if (!json.is_array()) throw place.fault(fmt::format("\"{}\" is not a list of numbers", name));
  std::vector<double> values;
  for (const nlohmann::json& value : json) {
    if (!value.is_number()) {
      throw place.fault(fmt::format("\"{}\" has an entry that is not a number", name));
    }
    values.push_back(value.get<double>());
  }
  return values;
}

stream::Box3 box_of(const nlohmann::json& json, const Place& place) {
  const std::vector<double> v = numbers(json, "box", place);
  stream::Box3 box;
  if (v.size() == 4) {
    box = {{v[0], v[1], -kUnbounded}, {v[2], v[3], kUnbounded}};
  } else if (v.size() == 6) {
    box = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
  } else {
    throw place.fault(fmt::format("\"box\" has {}, not 4 or 6", counted(v.size(), "number")));
  }
  if (box.empty()) throw place.fault("\"box\" is empty: a minimum exceeds its maximum");
  return box;
}

cluster::LinearMap axes_of(const nlohmann::json& region, const Place& place) {
  if (region.contains("rotation")) {
    if (region.contains("angle")) throw place.fault("has both \"angle\" and \"rotation\"");
    const nlohmann::json& rows = region["rotation"];
    if (!rows.is_array() || rows.size() != 3)
      throw place.fault("\"rotation\" is not a list of three rows");
    cluster::LinearMap axes{};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::vector<double> row = numbers(rows[i], "rotation", place);
      if (row.size() != 3) throw place.fault("each row of \"rotation\" needs three numbers");
      for (std::size_t k = 0; k < 3; ++k) axes[3 * i + k] = row[k];
    }
    return axes;
  }
  double angle = 0.0;
  if (region.contains("angle")) {
    if (!region["angle"].is_number()) throw place.fault("\"angle\" is not a number of degrees");
    angle = region["angle"].get<double>();
  }
  // Not the library's own constructor from an angle: its sine may differ in the last bit between
  // machines.
  const double s = base::sin_degrees(angle), c = base::cos_degrees(angle);
  return {c, s, 0, -s, c, 0, 0, 0, 1};
}

MetricChoice::Region region_of(const nlohmann::json& json, const Place& place) {
  if (!json.is_object()) throw place.fault("is not an object");
  for (const auto& [name, value] : json.items()) {
    if (name != "box" && name != "semi_axes" && name != "angle" && name != "rotation") {
      throw place.fault(fmt::format("\"{}\" is not a member of a region", name));
    }
  }
  if (!json.contains("semi_axes")) throw place.fault("has no \"semi_axes\"");
  const std::vector<double> lengths = numbers(json["semi_axes"], "semi_axes", place);
  if (lengths.size() != 2 && lengths.size() != 3) {
    throw place.fault(
        fmt::format("\"semi_axes\" has {}, not 2 or 3", counted(lengths.size(), "number")));
  }
  std::optional<stream::Box3> box;
  if (json.contains("box")) box = box_of(json["box"], place);
  for (const double length : lengths) {
    // Distances are divided by this length.
    if (length > 0 && std::isinf(1.0 / length)) throw place.fault("\"semi_axes\" are too small");
  }
  try {
    return {box,
            cluster::Elliptical({lengths[0], lengths[1], lengths.size() > 2 ? lengths[2] : 1.0},
                                axes_of(json, place))};
  } catch (const std::invalid_argument& error) {
    throw place.fault(error.what());
  }
}

std::vector<MetricChoice::Region> read_regions(const std::string& file) {
  constexpr std::uint64_t kMaxBytes = std::uint64_t{16} << 20;
  const std::string shape =
      "write {\"regions\": [{\"box\": [minx, miny, maxx, maxy], \"semi_axes\": [a, b], \"angle\": "
      "degrees}]}";
  const std::optional<nlohmann::json> contents = json_of_file(file, kMaxBytes, shape);
  if (!contents) {
    throw stream::Error(file, "cannot be read")
        .remedy(stream::message("{metric} elliptical:FILE names a JSON file of regions"));
  }
  const nlohmann::json& json = *contents;
  if (!json.is_object() || !json.contains("regions") || !json["regions"].is_array() ||
      json["regions"].empty()) {
    throw stream::Error(file, "is not a JSON object with a list \"regions\"").remedy(shape);
  }
  std::vector<MetricChoice::Region> regions;
  for (const nlohmann::json& region : json["regions"]) {
    regions.push_back(region_of(region, {file, regions.size()}));
  }
  return regions;
}

}  // namespace

MetricChoice MetricChoice::parse(const std::string& text) {
  MetricChoice choice;
  choice.text = text;
  const std::size_t colon = text.find(':');
  const std::string name = text.substr(0, colon);
  const std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (text == "euclidean") return choice;
  if (text == "squared") {
    choice.kind = Kind::squared;
  } else if (name == "minkowski" && !rest.empty()) {
    choice.kind = Kind::minkowski;
    choice.p = rest == "inf"
                   ? kUnbounded
                   : parse_number(rest, stream::message("the exponent of {metric} minkowski"));
    if (!(choice.p > 0.0))
      throw UsageError(stream::message("{metric} minkowski:P needs a positive P, or inf"));
  } else if (name == "elliptical" && !rest.empty()) {
    choice.kind = Kind::elliptical;
    choice.regions = read_regions(rest);
  } else {
    throw UsageError(stream::message(
        "{metric} {}: the metrics are euclidean, squared, minkowski:P and elliptical:FILE", text));
  }
  return choice;
}

MetricChoice MetricChoice::recorded(const std::string& text) {
  constexpr std::string_view kElliptical = "elliptical:";
  if (!text.starts_with(kElliptical)) return parse(text);
  MetricChoice choice;
  choice.text = text;
  choice.kind = Kind::elliptical;
  try {
    for (const auto& json : nlohmann::json::parse(text.substr(kElliptical.size()))) {
      Region region{std::nullopt, cluster::Elliptical(json.at("map").get<cluster::LinearMap>())};
      if (json.contains("box")) {
        const auto ends = json["box"].get<std::vector<double>>();
        if (ends.size() != 4 && ends.size() != 6) throw std::invalid_argument("a box");
        const std::size_t axes = ends.size() / 2;
        stream::Box3 box{{0, 0, -kUnbounded}, {0, 0, kUnbounded}};
        for (std::size_t axis = 0; axis < axes; ++axis) {
          box.min[axis] = ends[axis];
          box.max[axis] = ends[axes + axis];
        }
        region.box = box;
      }
      choice.regions.push_back(std::move(region));
    }
  } catch (const std::exception&) {  // of the JSON library, or for an impossible ellipsoid
    choice.regions.clear();
  }
  if (choice.regions.empty()) {
    throw UsageError(stream::message("{metric} is not as a store records it: {}", text));
  }
  return choice;
}

bool MetricChoice::has_boxes() const {
  // Regions after one without a box are never reached.
  return kind == Kind::elliptical && regions.front().box.has_value();
}

std::string MetricChoice::canonical() const {
  if (kind != Kind::elliptical) return text;
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Region& region : regions) {
    nlohmann::ordered_json json = nlohmann::ordered_json::object();
    if (region.box) {
      const stream::Box3& box = *region.box;
      // Boxes in the plane are unbounded in z, and JSON cannot express infinity.
      json["box"] = std::isfinite(box.min[2])
                        ? std::vector<double>{box.min[0], box.min[1], box.min[2],
                                              box.max[0], box.max[1], box.max[2]}
                        : std::vector<double>{box.min[0], box.min[1], box.max[0], box.max[1]};
    }
    json["map"] = region.metric.map();
    list.push_back(std::move(json));
  }
  return "elliptical:" + list.dump();
}

cluster::Metric MetricChoice::on_ground(const stream::Point3& origin,
                                        const cluster::LinearMap& map) const {
  switch (kind) {
    case Kind::euclidean:
      return cluster::Euclidean{};
    case Kind::squared:
      return cluster::SquaredEuclidean{};
    case Kind::minkowski:
      return cluster::Minkowski{p};
    case Kind::elliptical:
      break;
  }
  if (!has_boxes()) return regions.front().metric;
  // The inverse map, from the ground to the CRS. Without a weight for heights, all heights are
  // inside.
  const bool flat = map[8] == 0.0;
  const double area = map[0] * map[4] - map[1] * map[3];
  const cluster::EllipticalField::Frame frame{{map[4] / area, -map[1] / area, 0,  //
                                               -map[3] / area, map[0] / area, 0,  //
                                               0, 0, flat ? 0.0 : 1.0 / map[8]},
                                              origin};
  std::vector<cluster::EllipticalField::Region> field;
  for (const Region& region : regions) {
    base::Box3 box{{-kUnbounded, -kUnbounded, -kUnbounded}, {kUnbounded, kUnbounded, kUnbounded}};
    if (region.box) {
      for (std::size_t axis = 0; axis < (flat ? 2U : 3U); ++axis) {
        const double low = region.box->min[axis], high = region.box->max[axis];
        // Boxes are closed, so rounding on the way to the ground and back must not move points on
        // their sides outside.
        constexpr double kRounding = 1e-14;
        const auto slack = [&](double side) {
          return std::isfinite(side) ? kRounding * (std::abs(side) + std::abs(origin[axis])) : 0.0;
        };
        box.min[axis] = low - slack(low);
        box.max[axis] = high + slack(high);
      }
    }
    field.push_back({box, region.metric});
  }
  return cluster::EllipticalField(std::move(field), frame);
}

}  // namespace terrace::terrain
