// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

#include "bounded_mesh.hpp"
#include "error.hpp"
#include "ground.hpp"
#include "interrupt.hpp"
#include "lattice_plan.hpp"
#include "mesh_spool.hpp"
#include "ordered_work.hpp"
#include "progress.hpp"
#include "raster_fill.hpp"
#include "units.hpp"
#include "window_joiner.hpp"
#include "window_tin.hpp"
#include "world.hpp"

namespace terrace::tools {
namespace {

/// Cells of a window each way: the smallest, and the largest that a small mesh makes of it.
constexpr std::int64_t kWindowCells = 512, kWidestCells = 2048;
/// Vertices that a window should have, so that those on its sides, which cannot be removed, are
/// few among them.
constexpr std::size_t kVerticesPerWindow = 3000;
/// What a thread needs at worst: a window of kWindowCells with every sample a vertex, or one of
/// kWidestCells with few, and the results that wait.
constexpr std::uint64_t kBytesPerThread = std::uint64_t{112} << 20;
constexpr std::uint64_t kBytesBeside = std::uint64_t{48} << 20;

/// One run over all windows at one bound.
class RasterMesher {
 public:
  RasterMesher(const stream::Store& store, const BoundedMeshOptions& options,
               const CommonOptions& common)
      : store_(store),
        options_(options),
        common_(common),
        placement_(placement_of(store.schema())),
        whole_(lattice_of(store, options.region)),
        bounds_(world_box(placement_, store.bounds())),
        rounding_(options.path, bounds_, options.writer) {
    if (whole_.columns < 2 || whole_.rows < 2) {
      throw UsageError(options.region ? "--region: nothing of it lies on the raster of the store"
                                      : "the raster is one line of samples: it has no triangles");
    }
    threads_ = threads_within_memory();
    if (options.fill == Fill::interpolate) fill_ = std::make_shared<RasterFill>(store);
  }

  /// Meshes into the spool. max_error in the vertical unit. Stops early and returns fewer triangles
  /// once there are more than `most_vertices`.
  BoundedMeshResult run(double max_error, MeshSpool& spool, std::uint64_t most_vertices);

  [[nodiscard]] double metres_vertical() const {
    return Ground(placement_).map(store_.bounds())[8] / placement_.coordinates[2].scale;
  }
  [[nodiscard]] const stream::Box3& bounds() const { return bounds_; }

 private:
  [[nodiscard]] unsigned threads_within_memory() const;
  [[nodiscard]] WindowTinOptions window_options(double max_error) const;
  [[nodiscard]] std::int64_t window_cells(const WindowTinOptions& options) const;

  const stream::Store& store_;
  const BoundedMeshOptions& options_;
  const CommonOptions& common_;
  Placement placement_;
  LatticeWindow whole_;
  stream::Box3 bounds_;
  stream::MeshRounding rounding_;
  unsigned threads_ = 1;
  std::shared_ptr<const RasterFill> fill_;
};

unsigned RasterMesher::threads_within_memory() const {
  const std::uint64_t memory = common_.memory_or(0);
  const std::uint64_t beside = kBytesBeside + 8 * static_cast<std::uint64_t>(whole_.columns) +
                               (options_.fill == Fill::interpolate ? std::uint64_t{32} << 20 : 0);
  if (memory < beside + kBytesPerThread) {
    throw stream::Error(
        {.file = store_.path().string(),
         .where = {},
         .cause = "a mesh with a bound needs " + std::to_string((beside + kBytesPerThread) >> 20) +
                  "M of memory, --memory allows " + std::to_string(memory >> 20) + "M",
         .remedy = "allow more"});
  }
  return static_cast<unsigned>(
      std::min<std::uint64_t>(common_.threads, (memory - beside) / kBytesPerThread));
}

WindowTinOptions RasterMesher::window_options(double max_error) const {
  WindowTinOptions out;
  out.bound = max_error;
  out.aim = max_error;
  const stream::Point3& moved = rounding_.largest();
  if (moved != stream::Point3{}) {
    // Heights move by what they are rounded by, and a little with the places.
    out.aim = max_error * (15.0 / 16.0) - moved[2];
    if (!(out.aim > 0.0)) {
      throw stream::Error({.file = options_.path,
                           .where = {},
                           .cause = "its format rounds heights by up to " + number_text(moved[2]) +
                                    ", too much for this --max-error",
                           .remedy = "write PLY, which is exact"});
    }
  }
  out.whole = whole_;
  out.tin.quality = options_.quality;
  const GroundMap ground = Ground(placement_).map(store_.bounds());
  const bool mirrored = ground[0] * ground[4] - ground[1] * ground[3] < 0.0;
  out.tin.column_step = std::hypot(ground[0], ground[3]);
  out.tin.row_step = (mirrored ? -1.0 : 1.0) * std::hypot(ground[1], ground[4]);
  if (options_.fill == Fill::flat) {
    const double lowest = bounds_.min[2];
    out.fill = [lowest](std::int64_t, std::int64_t) { return lowest; };
  } else if (fill_) {
    out.fill = [fill = fill_](std::int64_t column, std::int64_t row) {
      return fill->height(static_cast<double>(column), static_cast<double>(row));
    };
  }
  return out;
}

std::int64_t RasterMesher::window_cells(const WindowTinOptions& options) const {
  // Four windows here and there stand for all. It depends on the data and the bound alone.
  const LatticePlan plan(whole_, kWindowCells);
  WindowMesher mesher(store_, options, rounding_);
  std::size_t vertices = 0, windows = 0;
  for (const std::size_t y : {1U, 3U}) {
    for (const std::size_t x : {1U, 3U}) {
      const std::size_t i = plan.down() * y / 4 * plan.across() + plan.across() * x / 4;
      vertices += mesher.count_greedy(plan.window(i));
      ++windows;
    }
  }
  std::int64_t cells = kWindowCells;
  for (vertices /= windows; vertices < kVerticesPerWindow && cells < kWidestCells; vertices *= 4) {
    cells *= 2;
  }
  return cells;
}

BoundedMeshResult RasterMesher::run(double max_error, MeshSpool& spool,
                                    std::uint64_t most_vertices) {
  const WindowTinOptions window_options = this->window_options(max_error);
  const LatticePlan plan(whole_, window_cells(window_options));
  std::vector<std::unique_ptr<WindowMesher>> meshers;
  for (unsigned i = 0; i < threads_; ++i) {
    meshers.push_back(std::make_unique<WindowMesher>(store_, window_options, rounding_));
  }
  WindowJoiner joiner(plan, *meshers[0], options_.region, spool);
  ProgressMeter meter(common_.progress, "samples");
  BoundedMeshResult result;
  double squares = 0.0, covered = 0.0;
  std::uint64_t samples_seen = 0;
  struct Enough {};
  try {
    in_order(
        plan.size(), threads_,
        [&](unsigned worker, std::size_t i) {
          check_interrupt();
          return meshers[worker]->mesh(plan.window(i));
        },
        [&](std::size_t i, const WindowTin& tin) {
          joiner.add(i, tin);
          if (spool.vertices() > most_vertices) throw Enough{};
          result.max_error = std::max(result.max_error, tin.check.max_error);
          const auto count = static_cast<double>(tin.check.covered);
          squares += tin.check.rms_error * tin.check.rms_error * count;
          covered += count;
          result.samples += tin.samples;
          result.reading_seconds += tin.reading_seconds;
          result.meshing_seconds += tin.meshing_seconds;
          samples_seen += tin.window.size();
          meter.update(samples_seen,
                       static_cast<double>(samples_seen) / static_cast<double>(whole_.size()));
        });
  } catch (const Enough&) {
    // The caller sees it by the number of vertices.
  }
  result.vertices = spool.vertices();
  result.triangles = spool.triangles();
  result.rms_error = covered > 0.0 ? std::sqrt(squares / covered) : 0.0;
  return result;
}

}  // namespace

namespace {

/// The mesh with the smallest bound that has at most max_points vertices, to within 2 % of them:
/// one run per bound that is tried, about ten.
BoundedMeshResult least_error(RasterMesher& mesher, const BoundedMeshOptions& options) {
  const std::uint64_t most = options.max_points;
  const double range = mesher.bounds().max[2] - mesher.bounds().min[2];
  constexpr double kLeastStep = 1.002;
  // Bounds between which the answer lies, and the numbers of vertices there.
  double many_bound = 0.0, few_bound = 0.0, few = 0.0;
  bool few_known = false;
  double bound = range / 64.0;
  BoundedMeshResult result;
  std::unique_ptr<MeshSpool> spool;
  const auto run = [&](double at) {
    spool.reset();  // its files have the names of the next one's
    spool = std::make_unique<MeshSpool>(options.path);
    result = mesher.run(at, *spool, most);
    return result.vertices <= most;
  };
  for (int round = 0; round < 24; ++round) {
    if (run(bound)) {
      few_known = true;
      few_bound = bound;
      few = static_cast<double>(result.vertices);
      if (bound == 0.0 || few >= 0.98 * static_cast<double>(most)) break;
    } else {
      if (bound >= range) {
        throw stream::Error({.file = options.path,
                             .where = {},
                             .cause = "--max-points " + std::to_string(most) +
                                      " is too few even for a flat mesh of this region",
                             .remedy = "allow more points"});
      }
      many_bound = bound;
    }
    if (!few_known) {
      bound = std::min(range, 4.0 * bound);
    } else if (many_bound == 0.0) {
      bound = few_bound < 1e-6 * range ? 0.0 : few_bound / 4.0;
    } else {
      if (few_bound / many_bound < kLeastStep) break;
      // The number falls about as the inverse of the bound, or more slowly.
      const double wanted = few_bound * few / (0.99 * static_cast<double>(most));
      const double middle = std::sqrt(few_bound * many_bound);
      bound =
          wanted > many_bound ? std::min(std::max(wanted, middle), few_bound / kLeastStep) : middle;
    }
  }
  if (result.vertices > most) run(few_bound);
  spool->write(options.path, options.writer, mesher.bounds());
  return result;
}

}  // namespace

BoundedMeshResult bounded_raster_mesh(const stream::Store& store, const BoundedMeshOptions& options,
                                      const CommonOptions& common) {
  RasterMesher mesher(store, options, common);
  const double metres = mesher.metres_vertical();
  BoundedMeshResult result;
  if (options.max_points == 0) {
    MeshSpool spool(options.path);
    result = mesher.run(options.max_error / metres, spool, ~std::uint64_t{0});
    spool.write(options.path, options.writer, mesher.bounds());
  } else {
    result = least_error(mesher, options);
  }
  result.max_error *= metres;
  result.rms_error *= metres;
  return result;
}

}  // namespace terrace::tools
