// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

#include "bounded_mesh.hpp"
#include "detail.hpp"
#include "error.hpp"
#include "ground.hpp"
#include "interrupt.hpp"
#include "mesh_spool.hpp"
#include "units.hpp"
#include "world.hpp"

namespace terrace::tools {
namespace {

/// A sample, its lists and what removal adds; the mesh and its check.
constexpr std::uint64_t kBytesPerPoint = 24 + 40 + 200;

struct Samples {
  std::vector<double> x, y, z;
};

Samples samples_of(const stream::Store& store, const Detail& detail, std::uint64_t memory_bytes) {
  std::uint64_t points = 0;
  for_each_wanted_record(
      store, detail,
      [&](stream::ClusterId, const stream::ClusterRecord& record) { points += record.points; });
  if (points > memory_bytes / kBytesPerPoint) {
    throw stream::Error(
        {.file = store.path().string(),
         .where = {},
         .cause = "a mesh with a bound of " + std::to_string(points) + " irregular points needs " +
                  std::to_string((points * kBytesPerPoint >> 20) + 1) +
                  "M of memory, --memory allows " + std::to_string(memory_bytes >> 20) + "M",
         .remedy = "mesh smaller regions"});
  }
  const Placement placement = placement_of(store.schema());
  Samples samples;
  for_each_wanted(
      store, detail,
      [&](stream::ClusterId, const stream::ClusterRecord&, const stream::ClusterPoints& cluster) {
        check_interrupt();
        for (const stream::Point3& stored : cluster.positions) {
          const stream::Point3 p = world_point(placement, stored);
          if (detail.region && !detail.region->contains(p)) continue;
          samples.x.push_back(p[0]);
          samples.y.push_back(p[1]);
          samples.z.push_back(p[2]);
        }
      });
  return samples;
}

}  // namespace

BoundedMeshResult bounded_point_mesh(const stream::Store& store, const BoundedMeshOptions& options,
                                     const CommonOptions& common) {
  if (options.fill != Fill::none) {
    throw UsageError("--fill is for rasters: irregular points have no cells without data");
  }
  const Placement placement = placement_of(store.schema());
  const double metres = Ground(placement).map(store.bounds())[8] / placement.coordinates[2].scale;
  const stream::Box3 bounds = world_box(placement, store.bounds());
  const stream::MeshRounding rounding(options.path, bounds, options.writer);

  Detail detail;
  detail.region = options.region;
  BoundedMeshResult result;
  const Stopwatch reading;
  const Samples samples = samples_of(store, detail, common.memory_or(0));
  result.reading_seconds = reading.seconds();

  const Stopwatch meshing;
  tri::PointTinOptions tin_options;
  const double bound = options.max_error / metres;
  const bool exact = rounding.largest() == stream::Point3{};
  tin_options.max_error = exact ? bound : bound * (15.0 / 16.0) - rounding.largest()[2];
  if (options.max_points > 0) tin_options.max_error = 0.0;
  if (tin_options.max_error < 0.0) {
    throw stream::Error({.file = options.path,
                         .where = {},
                         .cause = "its format rounds heights by up to " +
                                  number_text(rounding.largest()[2]) +
                                  ", too much for this --max-error",
                         .remedy = "write PLY, which is exact"});
  }
  tin_options.max_points = options.max_points;
  tin_options.duplicates = options.duplicates;
  tin_options.quality = options.quality == tri::TinQuality::kGreedy ? tri::PointTinQuality::kGreedy
                        : options.quality == tri::TinQuality::kFitted
                            ? tri::PointTinQuality::kFitted
                            : tri::PointTinQuality::kRemoval;
  tri::PointTin tin;
  try {
    tin = tri::point_tin(samples.x, samples.y, samples.z, {}, tin_options);
  } catch (const std::invalid_argument& error) {
    throw stream::Error({.file = store.path().string(),
                         .where = {},
                         .cause = error.what(),
                         .remedy = "say with --duplicates which of them counts"});
  }
  // Measured on what a reader gets back.
  tri::TinErrors errors = tin.errors;
  if (!exact) {
    if (tin.duplicates > 0) {
      throw stream::Error({.file = options.path,
                           .where = {},
                           .cause =
                               "its format rounds positions, so the error where several samples "
                               "have one place cannot be verified",
                           .remedy = "write PLY, which is exact"});
    }
    std::vector<tri::Point3> read;
    read.reserve(tin.vertices.size());
    for (const tri::Point3& p : tin.vertices) read.push_back(rounding(p));
    errors = tri::measure_surface(samples.x, samples.y, samples.z, read, tin.triangles);
  }
  if (options.max_points == 0 && errors.largest > bound) {
    throw stream::Error({.file = options.path,
                         .where = {},
                         .cause = "the mesh misses its bound: " + number_text(errors.largest) +
                                  " of " + number_text(bound),
                         .remedy = exact ? "this is a fault of terrace, please report it"
                                         : "write PLY, which is exact"});
  }
  result.meshing_seconds = meshing.seconds();
  result.max_error = errors.largest * metres;
  result.rms_error = errors.rms * metres;
  result.samples = samples.x.size();
  result.duplicates = tin.duplicates;

  MeshSpool spool(options.path);
  for (const tri::Point3& p : tin.vertices) spool.add_vertex(p);
  for (const auto& triangle : tin.triangles) spool.add_triangle(triangle);
  spool.write(options.path, options.writer, bounds);
  result.vertices = spool.vertices();
  result.triangles = spool.triangles();
  return result;
}

}  // namespace terrace::tools
