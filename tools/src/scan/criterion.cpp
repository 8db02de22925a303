// SPDX-License-Identifier: GPL-3.0-or-later
#include "scan/criterion.hpp"

#include <cmath>

#include <terrace/base/stop_check.hpp>

#include "base/units.hpp"
#include "scan/cgal_surface.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Memory of CGAL's triangulation, in bytes per point.
constexpr std::uint64_t kCgalBytesPerPoint = 1200;

}  // namespace

ScanSurfaceOptions parse_criterion(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::string name = text.substr(0, colon);
  ScanSurfaceOptions options;
  std::optional<double> value;
  if (colon != std::string::npos) {
    value = number_from<double>(text.substr(colon + 1));
    if (!value || !(*value > 0.0) || !std::isfinite(*value))
      throw UsageError("--criterion: a positive number must follow '" + name + ":'");
  }
  tri::ShapeOptions& shape = options.restore.shape;
  if (name == "poles" && !value) {
    shape.rule = tri::ShapeRule::poles;
  } else if (name == "gabriel" && !value) {
    shape.rule = tri::ShapeRule::flood;
    shape.criterion = tri::ShapeCriterion::gabriel;
  } else if (name == "edge") {
    shape.rule = tri::ShapeRule::published;
    shape.criterion = tri::ShapeCriterion::edge_length;
    shape.keep_vertices = false;
    if (value) shape.edge_factor = *value;
  } else if (name == "alpha-wrap") {
    options.method = {
        [alpha = value.value_or(0.0)](std::span<const tri::Point3> points, const base::StopCheck&) {
          return tri::RestoredSurface{alpha_wrap_surface(points, alpha), {}};
        },
        kCgalBytesPerPoint};
  } else if (name == "advancing-front" && !value) {
    options.method = {advancing_front_surface, kCgalBytesPerPoint};
  } else {
    throw UsageError(
        "--criterion is poles, gabriel, edge[:FACTOR], advancing-front or alpha-wrap[:METRES], "
        "not '" +
        text + "'");
  }
  return options;
}

void set_metric(const MetricChoice& metric, ScanSurfaceOptions& options) {
  if (metric.kind == MetricChoice::Kind::euclidean) return;
  if (metric.kind != MetricChoice::Kind::elliptical) {
    throw UsageError("--metric: a surface takes euclidean or elliptical:FILE, not " + metric.text);
  }
  if (options.method) throw UsageError("--metric needs --criterion poles, gabriel or edge");
  if (metric.has_boxes()) {
    throw UsageError("--metric: a surface has one ellipsoid, so its region has no \"box\"");
  }
  options.restore.metric = metric.regions.front().metric.map();
}

}  // namespace terrace::tools
