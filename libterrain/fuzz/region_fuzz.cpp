// SPDX-License-Identifier: Apache-2.0
// Regions and metrics: JSON files, and the text that the command line accepts. The first line says
// which: "region" or "metric" for the text of a file, "box" for a box.
#include <cmath>

#include <nlohmann/json.hpp>

#include "fuzz_target.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/metric_choice.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain::fuzz {

namespace {

void use(const Region& region) {
  const stream::Box3& box = region.box();
  require(!box.empty(), "the box of a region is not empty");
  for (const Polygon& polygon : region.polygons()) {
    require(!polygon.empty(), "a polygon has a ring");
    for (const std::vector<Point2>& ring : polygon) {
      require(ring.size() >= 3, "a ring has three corners");
      for (const Point2& p : ring) {
        require(std::isfinite(p[0]) && std::isfinite(p[1]), "finite corners");
      }
    }
    const Point2& corner = polygon.front().front();
    static_cast<void>(region.contains({corner[0], corner[1], 0}));
  }
  // Nothing is infinitely far away.
  require(!region.contains({std::numeric_limits<double>::infinity(), 0, 0}), "nothing at infinity");
}

void use(const MetricChoice& metric) {
  if (metric.kind == MetricChoice::Kind::elliptical) {
    require(!metric.regions.empty(), "an elliptical metric has a region");
    const std::string text = metric.canonical();
    const nlohmann::json list =
        nlohmann::json::parse(text.substr(text.find(':') + 1), nullptr, false);
    require(list.is_array() && list.size() == metric.regions.size(),
            "the record of a store is JSON");
  }
  const cluster::Metric ground = metric.on_ground({1, 2, 3}, {2, 2, 1});
  const double far = cluster::distance(ground, {0, 0, 0}, {3, 4, 5});
  require(!(far < 0), "distances are not negative");
  require(cluster::distance(ground, {1, 1, 1}, {1, 1, 1}) == 0, "a point is at its own place");
}

}  // namespace

bool accepts(const std::uint8_t* data, std::size_t size) {
  std::string_view text = text_of(data, size);
  const std::string_view how = take_line(text);
  try {
    if (how == "region") {
      const MemoryFile file(text);
      use(Region::parse(file.name()));
    } else if (how == "metric") {
      const MemoryFile file(text);
      use(MetricChoice::parse("elliptical:" + file.name()));
    } else if (how == "box") {
      if (text.find_first_not_of("0123456789+-.,eE ") != std::string_view::npos) return false;
      use(Region::parse(std::string(text)));
    } else {
      return false;
    }
  } catch (const UsageError&) {
    return false;
  } catch (const stream::Error& error) {
    require(!error.parts().cause.empty(), "a cause");
    return false;
  }
  return true;
}

}  // namespace terrace::terrain::fuzz
