// SPDX-License-Identifier: GPL-3.0-or-later
#include "scan/surface_run.hpp"

#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include <terrace/stream/error.hpp>
#include <terrace/tri/shape.hpp>

#include "base/units.hpp"
#include "earth/ground.hpp"
#include "scan/cgal_surface.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Peak bytes per point: tetrahedra and their vertices, the shape, positions in the CRS and on the
/// ground, and the surface.
constexpr std::uint64_t kSurfaceBytesPerPoint = 300 + 60 + 48 + 2 * 60;
/// CGAL's own triangulation in place of ours.
constexpr std::uint64_t kCgalBytesPerPoint = 1200;

std::optional<double> positive_number(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (!(value > 0.0) || !std::isfinite(value)) return std::nullopt;
  return value;
}

void check_memory(const stream::Store& store, const Detail& detail,
                  const SurfaceCriterion& criterion, std::uint64_t memory_bytes) {
  std::uint64_t points = 0;
  for_each_wanted_record(
      store, detail,
      [&](stream::ClusterId, const stream::ClusterRecord& record) { points += record.points; });
  const bool ours = criterion.method == SurfaceMethod::kShape;
  const std::uint64_t needed = points * (ours ? kSurfaceBytesPerPoint : kCgalBytesPerPoint);
  if (needed <= memory_bytes) return;
  throw stream::Error({.file = store.path().string(),
                       .where = {},
                       .cause = "a surface of " + with_commas(points) + " points needs " +
                                readable_bytes(needed) + ", --memory allows " +
                                readable_bytes(memory_bytes),
                       .remedy = "take a coarser --level or a smaller --region"});
}

/// Metres about the middle of the positions.
std::vector<stream::Point3> on_ground(const std::vector<stream::Point3>& positions,
                                      const stream::StoreSchema& schema) {
  stream::Box3 box;
  for (const stream::Point3& p : positions) box.include(p);
  // The positions are in the CRS already.
  stream::Placement placement = schema;
  placement.world = {};
  for (stream::Channel& channel : placement.coordinates) channel.scale = 1, channel.offset = 0;
  const GroundMap map = Ground(placement).map(box);
  std::vector<stream::Point3> ground;
  ground.reserve(positions.size());
  for (const stream::Point3& p : positions) {
    stream::Point3 place;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      place[axis] = map[4 * axis] * (p[axis] - (0.5 * box.min[axis] + 0.5 * box.max[axis]));
    }
    ground.push_back(place);
  }
  return ground;
}

template <class Triangulation>
void keep_tetrahedra(const std::vector<stream::Point3>& ground, const tri::RestoreOptions& options,
                     TriangleMesh points, Triangulation triangulation, SurfaceOutcome& outcome) {
  const std::vector<tri::VertexId> vertices = triangulation.build(ground, 2);
  tri::BasicShape3<Triangulation> shape(options.shape);
  shape.restore(triangulation);
  outcome.measures = tri::measure(shape.surface(triangulation).surface);
  // The first of several equal points stands for all.
  constexpr auto kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(triangulation.vertex_slots(), kUnused);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    std::uint32_t& n = number[tri::slot(vertices[i])];
    if (n == kUnused) n = static_cast<std::uint32_t>(i);
  }
  for (const tri::TetrahedronId t : shape.kept_tetrahedra()) {
    std::array<std::uint32_t, 4> corners{};
    for (std::size_t k = 0; k < 4; ++k) {
      corners[k] = number[tri::slot(triangulation.vertices(t)[k])];
    }
    outcome.tetrahedra.push_back(corners);
  }
  outcome.mesh = std::move(points);
}

}  // namespace

SurfaceCriterion parse_criterion(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::string name = text.substr(0, colon);
  SurfaceCriterion criterion;
  std::optional<double> value;
  if (colon != std::string::npos) {
    value = positive_number(text.substr(colon + 1));
    if (!value) throw UsageError("--criterion: a positive number must follow '" + name + ":'");
  }
  if (name == "edge") {
    criterion.restore.shape.criterion = tri::ShapeCriterion::kEdgeLength;
    if (value) criterion.restore.shape.edge_factor = *value;
  } else if (name == "alpha-wrap") {
    criterion.method = SurfaceMethod::kAlphaWrap;
    if (value) criterion.alpha = *value;
  } else if (name == "advancing-front" && !value) {
    criterion.method = SurfaceMethod::kAdvancingFront;
  } else if (name != "gabriel" || value) {
    throw UsageError(
        "--criterion is edge[:FACTOR], gabriel, advancing-front or alpha-wrap[:METRES], not '" +
        text + "'");
  }
  return criterion;
}

std::optional<tri::EllipticalMetric3> surface_metric(const MetricChoice& metric,
                                                     const SurfaceCriterion& criterion) {
  if (metric.kind == MetricChoice::Kind::euclidean) return std::nullopt;
  if (metric.kind != MetricChoice::Kind::elliptical) {
    throw UsageError("a surface has the metric euclidean or elliptical:FILE, not " + metric.text);
  }
  if (criterion.method != SurfaceMethod::kShape) {
    throw UsageError("--metric is for --criterion gabriel and edge");
  }
  if (metric.has_boxes()) {
    throw UsageError("--metric: a surface has one ellipsoid, so its region has no \"box\"");
  }
  return metric.regions.front().metric.map();
}

SurfaceOutcome surface_of_store(const stream::Store& store, const Detail& detail,
                                const SurfaceCriterion& criterion, bool tetrahedra,
                                std::uint64_t memory_bytes) {
  if (tetrahedra && criterion.method != SurfaceMethod::kShape) {
    throw UsageError("--tetrahedra is for --criterion gabriel and edge");
  }
  check_memory(store, detail, criterion, memory_bytes);
  TriangleMesh points = detail_points(store, detail);
  const std::vector<stream::Point3> ground = on_ground(points.positions, store.schema());
  SurfaceOutcome outcome;
  if (tetrahedra) {
    const tri::RestoreOptions& options = criterion.restore;
    if (options.metric) {
      keep_tetrahedra(ground, options, std::move(points),
                      tri::Delaunay3<double, tri::EllipticalMetric3>(*options.metric), outcome);
    } else {
      keep_tetrahedra(ground, options, std::move(points), tri::Delaunay3<double>(), outcome);
    }
    return outcome;
  }
  tri::RestoredSurface surface;
  switch (criterion.method) {
    case SurfaceMethod::kShape:
      surface = tri::restore_surface(ground, criterion.restore);
      break;
    case SurfaceMethod::kAdvancingFront:
      surface = advancing_front_surface(ground);
      break;
    case SurfaceMethod::kAlphaWrap:
      surface.surface = alpha_wrap_surface(ground, criterion.alpha);
      break;
  }
  outcome.measures = tri::measure(surface.surface);
  outcome.mesh.triangles = std::move(surface.surface.faces);
  if (criterion.method != SurfaceMethod::kAlphaWrap) {
    for (const std::size_t i : surface.input) {
      outcome.mesh.positions.push_back(points.positions[i]);
      outcome.mesh.levels.push_back(points.levels[i]);
    }
    return outcome;
  }
  // Corners of a wrap are new points: back from metres to the CRS.
  stream::Box3 box;
  for (const stream::Point3& p : points.positions) box.include(p);
  const std::vector<stream::Point3> corners = on_ground({box.min, box.max}, store.schema());
  for (const stream::Point3& p : surface.surface.points) {
    stream::Point3 place;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double metres = corners[1][axis] - corners[0][axis];
      const double units = box.max[axis] - box.min[axis];
      place[axis] = 0.5 * box.min[axis] + 0.5 * box.max[axis] +
                    (metres > 0.0 ? p[axis] * (units / metres) : p[axis]);
    }
    outcome.mesh.positions.push_back(place);
  }
  return outcome;
}

}  // namespace terrace::tools
