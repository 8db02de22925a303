// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/raster_mesher.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <terrace/stream/error.hpp>

#include "base/ordered_work.hpp"
#include "base/portable_math.hpp"
#include "base/progress_report.hpp"
#include "base/units.hpp"
#include "earth/ground.hpp"
#include "mesh/bounded/aim_within.hpp"
#include "mesh/bounded/lattice_plan.hpp"
#include "mesh/bounded/window_joiner.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Cells of a window each way: the smallest, and the largest that a small mesh makes of it.
constexpr std::int64_t kWindowCells = 512, kWidestCells = 2048;
/// Vertices that a window should have, so that those on its sides, which cannot be removed, are
/// few among them.
constexpr double kVerticesPerWindow = 3000.0;
/// Cells of a window that is a sample of all.
constexpr std::int64_t kSampleCells = 256;
/// What a thread needs at worst: a window of kWindowCells with every sample a vertex, or one of
/// kWidestCells with few, and the results that wait.
constexpr std::uint64_t kBytesPerThread = std::uint64_t{112} << 20;
constexpr std::uint64_t kRasterBytesBeside = std::uint64_t{48} << 20;

}  // namespace

RasterMesher::RasterMesher(const stream::Store& store, const BoundedMeshOptions& options,
                           const Context& context)
    : store_(store),
      options_(options),
      context_(context),
      placement_(store.schema()),
      whole_(lattice_of(store, options.region)),
      bounds_(world_box(placement_, store.bounds())),
      rounding_(options.path, bounds_, options.writer) {
  if (whole_.columns < 2 || whole_.rows < 2) {
    throw UsageError(options.region ? "`region`: nothing of it lies on the raster of the store"
                                    : "the raster is one line of samples: it has no triangles");
  }
  threads_ = threads_within_memory();
  if (options.fill == Fill::interpolate) fill_ = std::make_shared<StoreFill>(store);
}

double RasterMesher::metres_vertical() const {
  return Ground(placement_).map(store_.bounds())[8] / placement_.coordinates[2].scale;
}

double RasterMesher::estimate(double max_error) const {
  return sample(max_error, options_.quality, 4, 2).vertices_per_sample *
         static_cast<double>(whole_.size());
}

bool RasterMesher::can_estimate() const {
  return whole_.size() >= std::size_t{24} * kSampleCells * kSampleCells;
}

unsigned RasterMesher::threads_within_memory() const {
  const std::uint64_t memory = context_.memory_or(0);
  const std::uint64_t beside = kRasterBytesBeside + 8 * static_cast<std::uint64_t>(whole_.columns) +
                               (options_.fill == Fill::interpolate ? std::uint64_t{32} << 20 : 0);
  if (memory < beside + kBytesPerThread) {
    throw stream::Error({.file = store_.path().string(),
                         .where = {},
                         .cause = "a mesh with a bound needs " +
                                  std::to_string(((beside + kBytesPerThread) >> 20) + 1) +
                                  "M of memory, `memory_bytes` allows " +
                                  std::to_string(memory >> 20) + "M",
                         .remedy = "allow more"});
  }
  return static_cast<unsigned>(
      std::min<std::uint64_t>(context_.threads, (memory - beside) / kBytesPerThread));
}

std::vector<std::unique_ptr<WindowMesher>> RasterMesher::meshers(double max_error) const {
  const WindowTinOptions options = window_options(max_error);
  std::vector<std::unique_ptr<WindowMesher>> result;
  for (unsigned i = 0; i < threads_; ++i) {
    result.push_back(std::make_unique<WindowMesher>(store_, options, rounding_));
  }
  return result;
}

WindowTinOptions RasterMesher::window_options(double max_error) const {
  WindowTinOptions out;
  out.bound = max_error;
  const Aim aim = aim_within(max_error, rounding_, options_.path);
  out.first_aim = aim.first;
  out.aim = aim.sure;
  out.whole = whole_;
  out.region = options_.region;
  out.tin.quality = options_.quality;
  const GroundMap ground = Ground(placement_).map(store_.bounds());
  const bool mirrored = ground[0] * ground[4] - ground[1] * ground[3] < 0.0;
  out.tin.column_step = portable_hypot(ground[0], ground[3]);
  out.tin.row_step = (mirrored ? -1.0 : 1.0) * portable_hypot(ground[1], ground[4]);
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

RasterMesher::Sample RasterMesher::sample(double max_error, tri::TinQuality quality,
                                          std::size_t across, std::size_t down) const {
  const LatticePlan plan(whole_, kSampleCells);
  std::vector<std::size_t> windows;
  for (std::size_t y = 0; y < down; ++y) {
    for (std::size_t x = 0; x < across; ++x) {
      windows.push_back(plan.down() * (2 * y + 1) / (2 * down) * plan.across() +
                        plan.across() * (2 * x + 1) / (2 * across));
    }
  }
  std::sort(windows.begin(), windows.end());
  windows.erase(std::unique(windows.begin(), windows.end()), windows.end());
  const auto meshers = this->meshers(max_error);
  Sample sample;
  double vertices = 0.0, cells = 0.0;
  in_order(
      windows.size(), threads_,
      [&](unsigned worker, std::size_t i) {
        return meshers[worker]->count(plan.window(windows[i]), quality);
      },
      [&](std::size_t i, const WindowCount& count) {
        vertices += static_cast<double>(count.vertices);
        cells += static_cast<double>(plan.window(windows[i]).size());
        sample.reading_seconds += count.reading_seconds;
        sample.meshing_seconds += count.meshing_seconds;
      });
  sample.vertices_per_sample = vertices / cells;
  return sample;
}

std::int64_t RasterMesher::window_cells(double per_sample) {
  std::int64_t cells = kWindowCells;
  while (per_sample * static_cast<double>(cells * cells) < kVerticesPerWindow &&
         cells < kWidestCells) {
    cells *= 2;
  }
  return cells;
}

BoundedMeshResult RasterMesher::run(double max_error, MeshSpool& spool,
                                    std::uint64_t most_vertices) {
  BoundedMeshResult result;
  std::int64_t cells = kWindowCells;
  if (LatticePlan(whole_, cells).size() > 1) {
    const Sample sample = this->sample(max_error, tri::TinQuality::kGreedy, 2, 2);
    cells = window_cells(sample.vertices_per_sample);
    result.reading_seconds = sample.reading_seconds;
    result.meshing_seconds = sample.meshing_seconds;
  }
  const LatticePlan plan(whole_, cells);
  const auto meshers = this->meshers(max_error);
  WindowJoiner joiner(plan, spool);
  ProgressReport report(context_, "samples");
  double squares = 0.0, covered = 0.0;
  std::uint64_t samples_seen = 0;
  struct Enough {};
  try {
    in_order(
        plan.size(), threads_,
        [&](unsigned worker, std::size_t i) { return meshers[worker]->mesh(plan.window(i)); },
        [&](std::size_t i, WindowTin&& tin) {
          result.max_error = std::max(result.max_error, tin.check.max_error);
          const auto count = static_cast<double>(tin.check.covered);
          squares += tin.check.rms_error * tin.check.rms_error * count;
          covered += count;
          result.samples += tin.samples;
          result.reading_seconds += tin.reading_seconds;
          result.meshing_seconds += tin.meshing_seconds;
          samples_seen += tin.window.size();
          joiner.add(i, std::move(tin));
          if (spool.vertices() > most_vertices) throw Enough{};
          report.update(samples_seen,
                        static_cast<double>(samples_seen) / static_cast<double>(whole_.size()));
        });
    result.vertices = spool.vertices();
    result.uncovered = joiner.uncovered();
  } catch (const Enough&) {
    const double part = static_cast<double>(samples_seen) / static_cast<double>(whole_.size());
    result.vertices = std::max(
        spool.vertices(),
        static_cast<std::uint64_t>(static_cast<double>(spool.vertices()) / std::min(1.0, part)));
  }
  result.triangles = spool.triangles();
  result.rms_error = covered > 0.0 ? std::sqrt(squares / covered) : 0.0;
  return result;
}

}  // namespace terrace::terrain
