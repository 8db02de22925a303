// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/scan_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <terrace/stream/error.hpp>

#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "earth/ground.hpp"
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
/// Memory of the program and for reading the store.
constexpr std::uint64_t kSurfaceBytesBeside = std::uint64_t{48} << 20;

void check_surface_memory(const stream::Store& store, const Detail& detail,
                          std::uint64_t bytes_per_point, std::uint64_t memory_bytes) {
  const std::uint64_t points = wanted_points(store, detail);
  const std::uint64_t needed = kSurfaceBytesBeside + points * bytes_per_point;
  if (needed <= memory_bytes) return;
  throw stream::Error(store.path().string(),
                      stream::message("a surface of {} needs {}, {memory_bytes} allows {}",
                                      counted(points, "point"), readable_bytes(needed),
                                      readable_bytes(memory_bytes)))
      .remedy(stream::message("choose a coarser {level} or a smaller {region}"));
}

/// Returns metres about the middle of the positions.
std::vector<stream::Point3> on_ground(const std::vector<stream::Point3>& positions,
                                      const stream::StoreSchema& schema) {
  stream::Box3 box;
  for (const stream::Point3& p : positions) box.include(p);
  // The positions are already in the CRS.
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

std::size_t distinct_places(std::vector<stream::Point3> points) {
  std::sort(points.begin(), points.end());
  return static_cast<std::size_t>(std::unique(points.begin(), points.end()) - points.begin());
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

}  // namespace

ScanSurface scan_surface(const stream::Store& store, const Detail& detail,
                         const ScanSurfaceOptions& options, const Context& context) {
  if (options.tetrahedra && options.method) {
    throw UsageError("a surface by another method has no tetrahedra");
  }
  need_points(store, "a surface");
  say_unknown_height_unit(Ground(store.schema()), context);
  const stream::Store source = store.with_stop(context.stop);
  const bool poles = options.restore.shape.rule == tri::ShapeRule::poles;
  check_surface_memory(source, detail,
                       options.method ? options.method->bytes_per_point
                                      : kSurfaceBytesPerPoint + (poles ? kPolesBytesPerPoint : 0),
                       context.memory_or(0));
  TriangleMesh points = detail_points(source, detail);
  if (points.positions.empty()) throw_none_inside(store);
  const std::vector<stream::Point3> ground = on_ground(points.positions, source.schema());
  ScanSurface out;
  tri::RestoreOptions restore = options.restore;
  restore.threads = context.threads;
  restore.check_stop = [&] { context.check_stop(); };
  if (options.tetrahedra) {
    if (restore.metric) {
      keep_tetrahedra(ground, restore, std::move(points),
                      tri::Delaunay3<double, tri::EllipticalMetric3>(*restore.metric), out);
    } else {
      keep_tetrahedra(ground, restore, std::move(points), tri::Delaunay3<double>(), out);
    }
    if (out.tetrahedra.empty()) out.spanned = dimensions_of(ground);
    return out;
  }
  tri::RestoredSurface surface = options.method
                                     ? options.method->restore(ground, restore.check_stop)
                                     : tri::restore_surface(ground, restore);
  context.check_stop();
  out.measures = tri::measure(surface.surface);
  if (!options.method) {
    set_parts(surface.parts, out);
    out.samples_off = surface.unused_points;
    out.open = surface.open;
    out.lids = surface.lids;
  } else if (!surface.input.empty() || surface.surface.faces.empty()) {
    out.samples_off = distinct_places(ground) - surface.input.size();
  }
  out.mesh.triangles = std::move(surface.surface.faces);
  if (out.mesh.triangles.empty()) out.spanned = dimensions_of(ground);
  if (surface.input.empty()) {
    out.mesh.positions = from_ground(surface.surface.points, points.positions, source.schema());
    return out;
  }
  for (const std::size_t i : surface.input) {
    out.mesh.positions.push_back(points.positions[i]);
    out.mesh.levels.push_back(points.levels[i]);
  }
  return out;
}

}  // namespace terrace::terrain
