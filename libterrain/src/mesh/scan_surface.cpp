// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/scan_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <terrace/stream/error.hpp>
#include <terrace/tri/surface_simplification.hpp>

#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "earth/ground.hpp"
#include "mesh/scan_surface_steps.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Peak memory in bytes per point: tetrahedra and their vertices, the shape, positions in the CRS
/// and on the ground, and the surface.
constexpr std::uint64_t kSurfaceBytesPerPoint = 300 + 60 + 48 + 2 * 60;
/// The poles rule needs the tetrahedra in another order, spheres and their labels, but not the
/// surface.
constexpr std::uint64_t kPolesBytesPerPoint = 660;

/// Returns the linear map from positions in the CRS to metres on the ground.
GroundMap map_of(const stream::Box3& box, const stream::StoreSchema& schema) {
  // The positions are already in the CRS.
  stream::Placement placement = schema;
  placement.world = {};
  for (stream::Channel& channel : placement.coordinates) channel.scale = 1, channel.offset = 0;
  return Ground(placement).map(box);
}

/// Converts back from metres about the middle of `positions` to the CRS.
std::vector<stream::Point3> from_ground(const std::vector<tri::Point3>& ground,
                                        const std::vector<stream::Point3>& positions,
                                        const stream::StoreSchema& schema) {
  if (ground.empty()) return {};
  stream::Box3 box;
  for (const stream::Point3& p : positions) box.include(p);
  const std::vector<stream::Point3> corners = on_ground({box.min, box.max}, schema);
  std::vector<stream::Point3> places;
  places.reserve(ground.size());
  for (const tri::Point3& p : ground) {
    stream::Point3 place;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double metres = corners[1][axis] - corners[0][axis];
      const double units = box.max[axis] - box.min[axis];
      place[axis] = 0.5 * box.min[axis] + 0.5 * box.max[axis] +
                    (metres > 0.0 ? p[axis] * (units / metres) : p[axis]);
    }
    places.push_back(place);
  }
  return places;
}

/// Moves positions in the CRS as their places on the ground were moved. Rounds towards the old
/// positions, so that no move grows beyond a limit.
void move_positions(const std::vector<tri::Point3>& from, const std::vector<tri::Point3>& to,
                    const GroundMap& map, std::vector<stream::Point3>& positions) {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double metres = map[4 * axis], before = positions[i][axis];
      const double by = metres > 0.0 ? (to[i][axis] - from[i][axis]) / metres : 0.0;
      double& after = positions[i][axis];
      after = before + by;
      if (std::abs(after - before) > std::abs(by)) after = std::nextafter(after, before);
    }
  }
}

/// See ScanSurface::spanned. A distance from a line or a plane of less than 1e-12 of its length is
/// rounding.
unsigned dimensions_of(const std::vector<stream::Point3>& points) {
  const auto between = [](const stream::Point3& a, const stream::Point3& b) {
    return stream::Point3{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  };
  const auto square = [](const stream::Point3& v) {
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
  };
  stream::Point3 line{};
  for (const stream::Point3& p : points) {
    const stream::Point3 v = between(points.front(), p);
    if (square(v) > square(line)) line = v;
  }
  if (square(line) == 0.0) return 0;
  stream::Point3 normal{};
  for (const stream::Point3& p : points) {
    const stream::Point3 v = between(points.front(), p);
    const stream::Point3 n{line[1] * v[2] - line[2] * v[1], line[2] * v[0] - line[0] * v[2],
                           line[0] * v[1] - line[1] * v[0]};
    if (square(n) > square(normal)) normal = n;
  }
  if (!(square(normal) > 1e-24 * square(line) * square(line))) return 1;
  const double rounding = 1e-12 * std::sqrt(square(normal) * square(line));
  const bool flat = std::all_of(points.begin(), points.end(), [&](const stream::Point3& p) {
    const stream::Point3 v = between(points.front(), p);
    return std::abs(v[0] * normal[0] + v[1] * normal[1] + v[2] * normal[2]) <= rounding;
  });
  return flat ? 2 : 3;
}

void set_parts(const tri::ShapeParts& parts, ScanSurface& out) {
  out.measures.components = parts.components;
  out.measures.euler_characteristic = parts.euler_characteristic;
}

template <class Triangulation>
void keep_tetrahedra(const std::vector<stream::Point3>& ground, const tri::RestoreOptions& options,
                     TriangleMesh points, Triangulation triangulation, ScanSurface& out) {
  triangulation.set_check_stop(options.check_stop);
  const std::vector<tri::VertexId> vertices = triangulation.build(ground, 2);
  tri::BasicShape3<Triangulation> shape(options.shape);
  shape.restore(triangulation, options.threads, options.check_stop);
  const tri::ShapeSurface surface = shape.surface(triangulation);
  out.measures = tri::measure(surface.surface);
  set_parts(shape.parts(triangulation, surface), out);
  out.samples_off = triangulation.vertex_count() - surface.vertices.size();
  // The first of several equal points represents them all.
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
    out.tetrahedra.push_back(corners);
  }
  out.mesh = std::move(points);
}

void keep_tetrahedra(const std::vector<stream::Point3>& ground, const tri::RestoreOptions& options,
                     TriangleMesh points, ScanSurface& out) {
  if (options.metric) {
    keep_tetrahedra(ground, options, std::move(points),
                    tri::Delaunay3<double, tri::EllipticalMetric3>(*options.metric), out);
  } else {
    keep_tetrahedra(ground, options, std::move(points), tri::Delaunay3<double>(), out);
  }
  if (out.tetrahedra.empty()) out.spanned = dimensions_of(ground);
}

void check_options(const ScanSurfaceOptions& options, const Detail& detail) {
  if (options.tetrahedra && options.method) {
    throw UsageError("a surface by another method has no tetrahedra");
  }
  if (options.tetrahedra && options.smoothing) {
    throw UsageError("only a surface can be smoothed, not its tetrahedra");
  }
  if (options.tetrahedra && simplifies(options)) {
    throw UsageError(stream::message(
        "{max_error} and {max_points} are for surfaces, not for the tetrahedra inside"));
  }
  if (options.max_error && options.max_points) {
    throw UsageError(stream::message("give either {max_error} or {max_points}, not both"));
  }
  if (options.max_error && !(*options.max_error >= 0.0)) {
    throw UsageError(stream::message("{max_error} must not be negative"));
  }
  if (options.max_points && *options.max_points < 4) {
    throw UsageError(stream::message("{max_points} must be at least 4"));
  }
  if (simplifies(options) && detail.cluster && detail.level > 0) {
    throw UsageError(
        stream::message("{max_error} and {max_points} apply to the surface through all samples: "
                        "with {cluster}, give {level} 0"));
  }
  if (simplifies(options) && (detail.level > 0 || !detail.focuses.empty())) {
    throw UsageError(stream::message(
        "{max_error} and {max_points} apply to the surface through all samples: they exclude "
        "{level} and {focus}"));
  }
}

}  // namespace

bool simplifies(const ScanSurfaceOptions& options) {
  return options.max_error || options.max_points;
}

std::uint64_t restoring_bytes_per_point(const ScanSurfaceOptions& options) {
  const bool poles = options.restore.shape.rule == tri::ShapeRule::poles;
  const std::uint64_t restoring = options.method
                                      ? options.method->bytes_per_point
                                      : kSurfaceBytesPerPoint + (poles ? kPolesBytesPerPoint : 0);
  return std::max({restoring, options.smoothing ? kSmoothingBytesPerPoint : 0,
                   simplifies(options) ? kSimplificationBytesPerPoint : 0});
}

std::vector<stream::Point3> on_ground(const std::vector<stream::Point3>& positions,
                                      const stream::StoreSchema& schema) {
  stream::Box3 box;
  for (const stream::Point3& p : positions) box.include(p);
  const GroundMap map = map_of(box, schema);
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

std::size_t distinct_places(std::vector<stream::Point3> points) {
  std::sort(points.begin(), points.end());
  return static_cast<std::size_t>(std::unique(points.begin(), points.end()) - points.begin());
}

void set_vertices(const tri::RestoredSurface& surface, const std::vector<tri::Point3>& samples,
                  const TriangleMesh& points, const stream::StoreSchema& schema,
                  TriangleMesh& mesh) {
  if (surface.input.empty()) {
    mesh.positions = from_ground(surface.surface.points, points.positions, schema);
    return;
  }
  for (const std::size_t i : surface.input) {
    mesh.positions.push_back(points.positions[i]);
    mesh.levels.push_back(points.levels[i]);
  }
  if (samples.empty()) return;
  stream::Box3 box;
  for (const stream::Point3& p : points.positions) box.include(p);
  move_positions(samples, surface.surface.points, map_of(box, schema), mesh.positions);
}

void simplify_scan(const ScanSurfaceOptions& options, const base::StopCheck& check_stop,
                   tri::RestoredSurface& surface, std::vector<tri::Point3>& samples,
                   ScanSurface& out) {
  tri::SimplificationOptions limits{.max_points = options.max_points.value_or(0),
                                    .check_stop = check_stop};
  if (options.max_error) limits.max_error = *options.max_error;
  out.simplified = SimplifiedFrom{.vertices = surface.surface.points.size(),
                                  .triangles = surface.surface.faces.size(),
                                  .volume = tri::measure(surface.surface).volume};
  tri::SimplifiedSurface simplified = tri::simplify_surface(surface.surface, limits);
  out.simplified->max_distance = simplified.max_distance;
  const auto select = [&](auto& values) {
    if (values.empty()) return;
    // Ascending, so that no value is overwritten before it moves.
    for (std::size_t i = 0; i < simplified.input.size(); ++i)
      values[i] = values[simplified.input[i]];
    values.resize(simplified.input.size());
  };
  select(surface.input);
  select(samples);
  surface.surface = std::move(simplified.surface);
}

std::vector<tri::Point3> smooth_scan(const ScanSurfaceOptions& options, const Context& context,
                                     tri::RestoredSurface& surface, ScanSurface& out) {
  tri::SurfaceSmoothingOptions smoothing = *options.smoothing;
  smoothing.threads = context.threads;
  smoothing.check_stop = [&] { context.check_stop(); };
  tri::SmoothedPoints smoothed = tri::smooth(surface.surface, smoothing);
  out.moves = smoothed.moves;
  return std::exchange(surface.surface.points, std::move(smoothed.points));
}

ScanSurface scan_surface(const stream::Store& store, const Detail& detail,
                         const ScanSurfaceOptions& options, const Context& context) {
  check_options(options, detail);
  need_points(store, "a surface");
  say_unknown_height_unit(Ground(store.schema()), context);
  const stream::Store source = store.with_stop(context.stop);
  if (uses_stored_surface(source, detail, options)) {
    return stored_scan_surface(source, detail, options, context);
  }
  need_memory_for_surface(source, wanted_points(source, detail), restoring_bytes_per_point(options),
                          context.memory_or(0));
  TriangleMesh points = detail_points(source, detail);
  if (points.positions.empty()) {
    if (!detail.cluster) throw_none_inside(store);
    throw stream::Error(store.path().string(), "no point of the cluster meets the condition")
        .remedy(stream::message("give another {where} or {cluster}"));
  }
  const std::vector<stream::Point3> ground = on_ground(points.positions, source.schema());
  ScanSurface out;
  tri::RestoreOptions restore = options.restore;
  restore.threads = context.threads;
  restore.check_stop = [&] { context.check_stop(); };
  if (options.tetrahedra) {
    keep_tetrahedra(ground, restore, std::move(points), out);
    return out;
  }
  tri::RestoredSurface surface = options.method
                                     ? options.method->restore(ground, restore.check_stop)
                                     : tri::restore_surface(ground, restore);
  context.check_stop();
  if (options.method && (!surface.input.empty() || surface.surface.faces.empty())) {
    out.samples_off = distinct_places(ground) - surface.input.size();
  }
  std::vector<tri::Point3> samples;
  if (options.smoothing) samples = smooth_scan(options, context, surface, out);
  if (simplifies(options)) simplify_scan(options, restore.check_stop, surface, samples, out);
  out.measures = tri::measure(surface.surface);
  if (!options.method) {
    set_parts(surface.parts, out);
    out.samples_off = surface.unused_points;
    out.open = surface.open;
    out.lids = surface.lids;
  }
  out.mesh.triangles = std::move(surface.surface.faces);
  if (out.mesh.triangles.empty()) out.spanned = dimensions_of(ground);
  set_vertices(surface, samples, points, source.schema(), out.mesh);
  return out;
}

}  // namespace terrace::terrain
