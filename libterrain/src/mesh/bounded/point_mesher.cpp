// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <terrace/base/ordered_work.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>

#include "base/stopwatch.hpp"
#include "base/units.hpp"
#include "mesh/bounded/mesher.hpp"
#include "mesh/bounded/point_mesh_samples.hpp"
#include "surface/bounded/point_mesh_cells.hpp"
#include "surface/bounded/point_window_tin.hpp"
#include "surface/bounded/point_windows.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// A sample, its lists and the memory of removal; the mesh and its check.
constexpr std::uint64_t kBytesPerPoint = 24 + 40 + 200;
/// The same if few of many samples become vertices.
constexpr std::uint64_t kBytesPerSample = 80;
/// Cells are joined into windows of at most this many vertices, so that few of them are on sides,
/// where they cannot be removed; and of at most this many cells.
constexpr double kPointsPerMeshWindow = 10000.0;
constexpr double kMaxMeshCells = 4.0;
/// Memory for reading per thread, and for everything else.
constexpr std::uint64_t kBytesPerReader = std::uint64_t{12} << 20;
constexpr std::uint64_t kFixedBytes = std::uint64_t{48} << 20;

/// The middle's share of a cell's width and height: about an eighth of its area.
constexpr double kMiddle = 0.35;
/// With fewer samples in the middle, the whole cell is used.
constexpr std::size_t kFewSamples = 500;

/// Estimates how many vertices a mesh will have, from the samples in the middle of cells.
/// Thread-safe.
class PointMeshEstimate {
 public:
  PointMeshEstimate(const PointMeshCuts& cuts, PointMeshSamples& samples,
                    tri::PointDuplicates duplicates);

  /// Number of vertices of a cell's mesh by greedy insertion. max_error: in the unit of heights.
  [[nodiscard]] double in_cell(std::uint32_t cell, double max_error) const;
  /// The average over all cells, estimated from four of them.
  [[nodiscard]] double per_cell(double max_error) const;

 private:
  const PointMeshCuts& cuts_;
  PointMeshSamples& samples_;
  tri::PointTinOptions options_;
};

PointMeshEstimate::PointMeshEstimate(const PointMeshCuts& cuts, PointMeshSamples& samples,
                                     tri::PointDuplicates duplicates)
    : cuts_(cuts), samples_(samples) {
  options_.quality = tri::TinQuality::greedy;
  // Another check refuses duplicates.
  options_.duplicates =
      duplicates == tri::PointDuplicates::error ? tri::PointDuplicates::first : duplicates;
}

double PointMeshEstimate::in_cell(std::uint32_t number, double max_error) const {
  const PointMeshCuts::Cell& cell = cuts_.cells[number];
  PlaneBox box;
  for (std::size_t k = 0; k < 2; ++k) {
    const double middle = cell.low[k] / 2.0 + cell.high[k] / 2.0;
    const double half_size = kMiddle * (cell.high[k] - cell.low[k]) / 2.0;
    box.min[k] = middle - half_size;
    box.max[k] = middle + half_size;
  }
  MeshSamples samples;
  samples_.read(number, 1, box, samples);
  if (samples.size() < kFewSamples) {
    samples = {};
    samples_.read(number, 1, {}, samples);
  }
  tri::PointTinOptions options = options_;
  options.max_error = max_error;
  const tri::PointTin tin = tri::point_tin(samples.x, samples.y, samples.z, {}, options);
  return static_cast<double>(tin.inserted) * static_cast<double>(samples_.count(number, 1)) /
         static_cast<double>(samples.size());
}

double PointMeshEstimate::per_cell(double max_error) const {
  const auto count = static_cast<std::uint32_t>(cuts_.cells.size());
  double vertices = 0.0;
  for (const std::uint32_t k : {1U, 3U, 5U, 7U}) vertices += in_cell(count * k / 8, max_error);
  return vertices / 4.0;
}

/// Meshes the irregular samples of a store: in one piece if they are few, otherwise distributed to
/// the cells of a division of the plane.
class PointMesher final : public BoundedMesher {
 public:
  PointMesher(const stream::Store& store, const BoundedMeshOptions& options,
              const Context& context);

  BoundedMeshResult run(double max_error, MeshSpool& spool, std::uint64_t max_vertices) override;
  [[nodiscard]] double estimate(double max_error) const override;
  [[nodiscard]] bool can_estimate() const override { return samples_.has_value(); }

 private:
  [[nodiscard]] bool single() const { return scan_.all.has_value(); }
  [[nodiscard]] PointMeshOptions mesh_options(double max_error) const;
  /// Returns the error for several samples at one place, with the number of such places and the
  /// largest difference of their heights.
  [[nodiscard]] stream::Error shared_places_error() const;
  BoundedMeshResult run_single(const PointMeshOptions& options, MeshSpool& spool) const;
  BoundedMeshResult run_plan(const PointMeshOptions& options, MeshSpool& spool,
                             std::uint64_t max_vertices) const;
  [[nodiscard]] PointMeshPlan plan_for(double max_error) const;
  /// The number of threads for windows that need `each` bytes.
  [[nodiscard]] unsigned threads_for(std::uint64_t each, std::uint64_t points) const;

  PointMeshScan scan_;
  PointMeshCuts cuts_;
  // Thread-safe.
  mutable std::optional<PointMeshSamples> samples_;
  unsigned cell_threads_ = 1;
  double reading_seconds_ = 0.0;
};

PointMesher::PointMesher(const stream::Store& store, const BoundedMeshOptions& options,
                         const Context& context)
    : BoundedMesher(store, options, context) {
  const Stopwatch reading;
  Detail detail;
  detail.region = options.region;
  scan_ = scan_point_mesh(store, detail, options.window_points, context.threads, options.places);
  if (!scan_.all && scan_.hull.size() >= 3) {
    cuts_ = cut_for_point_mesh(std::move(scan_.sample), scan_.period, options.window_points);
    scan_.sample = {};
    samples_.emplace(store, detail, cuts_, options.path, context.threads, options.places);
    std::uint64_t max_points = 0;
    for (std::uint32_t i = 0; i < cuts_.cells.size(); ++i) {
      max_points = std::max<std::uint64_t>(max_points, samples_->count(i, 1));
    }
    cell_threads_ = threads_for(max_points * kBytesPerPoint, max_points);
  }
  reading_seconds_ = reading.seconds();
}

unsigned PointMesher::threads_for(std::uint64_t each, std::uint64_t points) const {
  return threads_within_memory(single() ? each : each + kBytesPerReader, single() ? 0 : kFixedBytes,
                               " for " + with_commas(points) + " irregular points at a time");
}

PointMeshOptions PointMesher::mesh_options(double max_error) const {
  PointMeshOptions out;
  const Aim aim = aim_within(max_error);
  out.bound = aim.bound;
  out.first_aim = aim.first;
  out.tin.max_error = aim.sure;
  out.tin.duplicates = options_.duplicates;
  out.tin.quality = options_.quality;
  out.tin.check_stop = [this] { context_.check_stop(); };
  return out;
}

BoundedMeshResult PointMesher::run_single(const PointMeshOptions& options, MeshSpool& spool) const {
  const Stopwatch meshing;
  const std::uint64_t points = scan_.all->size();
  static_cast<void>(threads_for(points * kBytesPerPoint, points));
  const BoundedWindow mesh = mesh_samples(*scan_.all, {}, {}, options, rounding_, store_);
  BoundedMeshResult result;
  result.max_error = mesh.measures.max_error;
  result.rms_error = mesh.measures.rms_error;
  result.samples = mesh.measures.samples;
  result.uncovered = mesh.measures.uncovered;
  result.duplicates = mesh.measures.duplicates;
  spool.add_vertices(mesh.vertices);
  spool.add_triangles(mesh.triangles);
  result.vertices = spool.vertices();
  result.meshing_seconds = meshing.seconds();
  return result;
}

PointMeshPlan PointMesher::plan_for(double max_error) const {
  const PointMeshEstimate estimate(cuts_, *samples_, options_.duplicates);
  std::vector<double> vertices(cuts_.cells.size(), kPointsPerMeshWindow);
  if (estimate.per_cell(max_error) < kPointsPerMeshWindow / 2.0) {
    base::in_order(
        cuts_.cells.size(), cell_threads_,
        [&](unsigned, std::size_t i) {
          context_.check_stop();
          return estimate.in_cell(static_cast<std::uint32_t>(i), max_error);
        },
        [&](std::size_t i, double count) { vertices[i] = count; });
  }
  return plan_point_mesh(cuts_, scan_.hull, [&](std::uint32_t first, std::uint32_t cells) {
    const auto from = vertices.begin() + first;
    return static_cast<double>(samples_->count(first, cells)) <=
               kMaxMeshCells * static_cast<double>(options_.window_points) &&
           std::accumulate(from, from + cells, 0.0) <= kPointsPerMeshWindow;
  });
}

BoundedMeshResult PointMesher::run_plan(const PointMeshOptions& options, MeshSpool& spool,
                                        std::uint64_t max_vertices) const {
  if (!samples_) {  // collinear samples have no surface
    BoundedMeshResult result;
    result.samples = result.uncovered = scan_.samples;
    return result;
  }
  const PointMeshPlan plan = plan_for(options.tin.max_error);
  std::uint64_t max_points = 0, each = 0;
  for (const PointMeshPlan::Window& window : plan.windows) {
    const std::uint64_t points = samples_->count(window.first_cell, window.cells);
    max_points = std::max(max_points, points);
    each = std::max(each, points * (window.cells == 1 ? kBytesPerPoint : kBytesPerSample));
  }
  const ReadCells read = [this](std::uint32_t first_cell, std::uint32_t cells, const PlaneBox& box,
                                MeshSamples& out) { samples_->read(first_cell, cells, box, out); };
  PointMeshSides sides(plan, read, options.tin.duplicates, options.tin.max_error);
  const PointWindowMesher mesher(plan, read, sides, options, rounding_, store_);
  return run_windows(
      plan.windows.size(), threads_for(each, max_points), scan_.samples, spool, max_vertices,
      [&](unsigned, std::size_t i) { return mesher.mesh(i); },
      [&](std::size_t i, const BoundedWindow&) {
        for (const std::uint32_t side : plan.windows[i].sides) {
          if (plan.sides[side].last_window() == i) sides.drop(side);
        }
      });
}

double PointMesher::estimate(double max_error) const {
  // Removal leaves less than two thirds of the vertices that insertion makes.
  const double kept_share = options_.quality == tri::TinQuality::greedy ? 1.0 : 0.6;
  return kept_share * PointMeshEstimate(cuts_, *samples_, options_.duplicates).per_cell(max_error) *
         static_cast<double>(cuts_.cells.size());
}

stream::Error PointMesher::shared_places_error() const {
  SharedPlaces shared;
  if (scan_.all) {
    shared.add(*scan_.all);
  } else {
    for (std::uint32_t cell = 0; cell < cuts_.cells.size(); ++cell) {
      context_.check_stop();
      MeshSamples samples;
      samples_->read(cell, 1, {}, samples);
      shared.add(samples);
    }
  }
  return stream::Error(
             store_.path().string(),
             fmt::format("{} several samples with heights that differ by up to {} m (at {}, {})",
                         counted(shared.places, "place", "has", "have"),
                         readable_number(shared.range * metres_vertical()),
                         plain_number(shared.widest[0]), plain_number(shared.widest[1])))
      .remedy(options_.duplicates == tri::PointDuplicates::all
                  ? stream::message(
                        "set {duplicates} to min, max, mean or first to choose one, or allow "
                        "a larger {max_error}")
                  : stream::message("choose one with {duplicates}"));
}

BoundedMeshResult PointMesher::run(double max_error, MeshSpool& spool, std::uint64_t max_vertices) {
  BoundedMeshResult result;
  try {
    const PointMeshOptions options = mesh_options(max_error);
    result = single() ? run_single(options, spool) : run_plan(options, spool, max_vertices);
  } catch (const SamplesShareAPlace&) {
    throw shared_places_error();
  }
  result.reading_seconds += reading_seconds_;
  result.triangles = spool.triangles();
  return result;
}

}  // namespace

std::unique_ptr<BoundedMesher> make_point_mesher(const stream::Store& store,
                                                 const BoundedMeshOptions& options,
                                                 const Context& context) {
  return std::make_unique<PointMesher>(store, options, context);
}

}  // namespace terrace::terrain
