// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <optional>
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
#include "ordered_work.hpp"
#include "point_mesh_joiner.hpp"
#include "point_mesh_plan.hpp"
#include "point_mesh_samples.hpp"
#include "point_mesh_scan.hpp"
#include "point_mesh_sides.hpp"
#include "point_mesh_window.hpp"
#include "progress.hpp"
#include "units.hpp"
#include "world.hpp"

namespace terrace::tools {
namespace {

/// A sample, its lists and what removal adds; the mesh and its check.
constexpr std::uint64_t kBytesPerPoint = 24 + 40 + 200;
/// What a thread needs to read, and what is there besides.
constexpr std::uint64_t kBytesPerReader = std::uint64_t{12} << 20;
constexpr std::uint64_t kBytesBeside = std::uint64_t{48} << 20;

class PointMesher {
 public:
  PointMesher(const stream::Store& store, const BoundedMeshOptions& options,
              const CommonOptions& common);

  /// Meshes into the spool. max_error in the vertical unit. Stops early and returns fewer triangles
  /// once there are more than `most_vertices`.
  BoundedMeshResult run(double max_error, MeshSpool& spool, std::uint64_t most_vertices);
  /// Whether the samples are few enough for one window, which can have a limit of vertices itself.
  [[nodiscard]] bool single() const { return scan_.whole.has_value(); }
  [[nodiscard]] double metres_vertical() const {
    return Ground(placement_).map(store_.bounds())[8] / placement_.coordinates[2].scale;
  }
  [[nodiscard]] const stream::Box3& bounds() const { return bounds_; }

 private:
  void plan_windows();
  [[nodiscard]] PointMeshOptions mesh_options(double max_error) const;
  BoundedMeshResult run_whole(const PointMeshOptions& options, MeshSpool& spool) const;
  [[nodiscard]] unsigned threads_within_memory() const;

  const stream::Store& store_;
  const BoundedMeshOptions& options_;
  const CommonOptions& common_;
  Placement placement_;
  stream::Box3 bounds_;
  stream::MeshRounding rounding_;
  PointMeshScan scan_;
  PointMeshPlan plan_;
  std::optional<PointMeshSamples> samples_;
  unsigned threads_ = 1;
  double reading_seconds_ = 0.0;
};

PointMesher::PointMesher(const stream::Store& store, const BoundedMeshOptions& options,
                         const CommonOptions& common)
    : store_(store),
      options_(options),
      common_(common),
      placement_(placement_of(store.schema())),
      bounds_(world_box(placement_, store.bounds())),
      rounding_(options.path, bounds_, options.writer) {
  const Stopwatch reading;
  scan_ = scan_point_mesh(store, options.region, options.window_points);
  if (!scan_.whole && scan_.hull.size() >= 3) plan_windows();
  reading_seconds_ = reading.seconds();
  threads_ = threads_within_memory();
}

void PointMesher::plan_windows() {
  plan_ = plan_point_mesh(std::move(scan_.some), scan_.period, scan_.hull, options_.window_points);
  scan_.some = {};
  samples_.emplace(store_, options_.region, plan_, options_.path);
}

unsigned PointMesher::threads_within_memory() const {
  const bool single = scan_.whole.has_value();
  std::uint64_t points = single ? scan_.whole->size() : 0;
  for (std::size_t i = 0; i < plan_.windows.size(); ++i) {
    points = std::max<std::uint64_t>(points, samples_->count(i));
  }
  const std::uint64_t beside = single ? 0 : kBytesBeside;
  const std::uint64_t each = points * kBytesPerPoint + (single ? 0 : kBytesPerReader);
  const std::uint64_t memory = common_.memory_or(0);
  if (memory < beside + each) {
    throw stream::Error({.file = store_.path().string(),
                         .where = {},
                         .cause = "a mesh with a bound needs " +
                                  std::to_string(((beside + each) >> 20) + 1) + "M of memory for " +
                                  with_commas(points) +
                                  " irregular points at a time, --memory allows " +
                                  std::to_string(memory >> 20) + "M",
                         .remedy = "allow more"});
  }
  if (each == 0) return common_.threads;
  return static_cast<unsigned>(std::min<std::uint64_t>(common_.threads, (memory - beside) / each));
}

PointMeshOptions PointMesher::mesh_options(double max_error) const {
  PointMeshOptions out;
  out.bound = max_error;
  const bool exact = rounding_.largest() == stream::Point3{};
  out.tin.max_error = exact ? max_error : max_error * (15.0 / 16.0) - rounding_.largest()[2];
  if (out.tin.max_error < 0.0) {
    throw stream::Error({.file = options_.path,
                         .where = {},
                         .cause = "its format rounds heights by up to " +
                                  number_text(rounding_.largest()[2]) +
                                  ", too much for this --max-error",
                         .remedy = "write PLY, which is exact"});
  }
  out.tin.duplicates = options_.duplicates;
  out.tin.quality = options_.quality == tri::TinQuality::kGreedy   ? tri::PointTinQuality::kGreedy
                    : options_.quality == tri::TinQuality::kFitted ? tri::PointTinQuality::kFitted
                                                                   : tri::PointTinQuality::kRemoval;
  return out;
}

BoundedMeshResult PointMesher::run_whole(const PointMeshOptions& options, MeshSpool& spool) const {
  const Stopwatch meshing;
  const PointWindowTin tin =
      mesh_samples(*scan_.whole, {}, {}, options, rounding_, store_.path().string());
  BoundedMeshResult result;
  result.max_error = tin.errors.largest;
  result.rms_error = tin.errors.rms;
  result.samples = tin.samples;
  result.duplicates = tin.duplicates;
  for (const tri::Point3& p : tin.vertices) spool.add_vertex(p);
  for (const auto& triangle : tin.triangles) spool.add_triangle(triangle);
  result.meshing_seconds = meshing.seconds();
  return result;
}

BoundedMeshResult PointMesher::run(double max_error, MeshSpool& spool,
                                   std::uint64_t most_vertices) {
  PointMeshOptions options;
  BoundedMeshResult result;
  if (single()) {
    options = mesh_options(options_.max_points > 0 ? rounding_.largest()[2] * 2.0 : max_error);
    if (options_.max_points > 0) options.tin.max_error = 0.0;
    options.tin.max_points = options_.max_points;
    result = run_whole(options, spool);
  } else {
    options = mesh_options(max_error);
    PointMeshSides sides(plan_, *samples_, options.tin.duplicates, options.tin.max_error);
    const PointWindowMesher mesher(plan_, *samples_, sides, options, rounding_,
                                   store_.path().string());
    PointMeshJoiner joiner(plan_, sides, spool);
    ProgressMeter meter(common_.progress, "samples");
    double squares = 0.0, covered = 0.0;
    struct Enough {};
    try {
      in_order(
          plan_.windows.size(), threads_,
          [&](unsigned, std::size_t i) {
            check_interrupt();
            return mesher.mesh(i);
          },
          [&](std::size_t i, const PointWindowTin& tin) {
            joiner.add(i, tin);
            if (spool.vertices() > most_vertices) throw Enough{};
            result.max_error = std::max(result.max_error, tin.errors.largest);
            const auto count = static_cast<double>(tin.errors.covered);
            squares += tin.errors.rms * tin.errors.rms * count;
            covered += count;
            result.samples += tin.samples;
            result.duplicates += tin.duplicates;
            result.reading_seconds += tin.reading_seconds;
            result.meshing_seconds += tin.meshing_seconds;
            meter.update(result.samples,
                         static_cast<double>(result.samples) / static_cast<double>(scan_.samples));
          });
    } catch (const Enough&) {
      // The caller sees it by the number of vertices.
    }
    result.rms_error = covered > 0.0 ? std::sqrt(squares / covered) : 0.0;
    if (plan_.windows.empty()) result.samples = scan_.samples;  // on one line: no surface
  }
  result.reading_seconds += reading_seconds_;
  result.vertices = spool.vertices();
  result.triangles = spool.triangles();
  return result;
}

}  // namespace

BoundedMeshResult bounded_point_mesh(const stream::Store& store, const BoundedMeshOptions& options,
                                     const CommonOptions& common) {
  if (options.fill != Fill::none) {
    throw UsageError("--fill is for rasters: irregular points have no cells without data");
  }
  PointMesher mesher(store, options, common);
  const double metres = mesher.metres_vertical();
  BoundedMeshResult result;
  MeshSpool spool(options.path);
  result = mesher.run(options.max_error / metres, spool, ~std::uint64_t{0});
  spool.write(options.path, options.writer, mesher.bounds());
  result.max_error *= metres;
  result.rms_error *= metres;
  return result;
}

}  // namespace terrace::tools
