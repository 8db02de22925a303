// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/point_mesher.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

#include "base/ordered_work.hpp"
#include "base/progress_report.hpp"
#include "base/stopwatch.hpp"
#include "base/units.hpp"
#include "mesh/bounded/aim_within.hpp"
#include "mesh/bounded/point_mesh_estimate.hpp"
#include "mesh/bounded/point_mesh_joiner.hpp"
#include "mesh/bounded/point_mesh_sides.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// A sample, its lists and what removal adds; the mesh and its check.
constexpr std::uint64_t kBytesPerPoint = 24 + 40 + 200;
/// The same where few of many samples become vertices.
constexpr std::uint64_t kBytesPerSample = 80;
/// Cells become one window where that has no more vertices than this, so that those on its sides,
/// which cannot be removed, are few among them; and only so many.
constexpr double kPointsPerMeshWindow = 10000.0;
constexpr double kMostMeshCells = 4.0;
/// What a thread needs to read, and what is there besides.
constexpr std::uint64_t kBytesPerReader = std::uint64_t{12} << 20;
constexpr std::uint64_t kBytesBeside = std::uint64_t{48} << 20;

}  // namespace

PointMesher::PointMesher(const stream::Store& store, const BoundedMeshOptions& options,
                         const Context& context)
    : store_(store),
      options_(options),
      context_(context),
      placement_(store.schema()),
      bounds_(world_box(placement_, store.bounds())),
      rounding_(options.path, bounds_, options.writer) {
  const Stopwatch reading;
  Detail detail;
  detail.region = options.region;
  detail.where = options.where;
  scan_ = scan_point_mesh(store, detail, options.window_points);
  if (!scan_.whole && scan_.hull.size() >= 3) {
    cuts_ = cut_for_point_mesh(std::move(scan_.some), scan_.period, options.window_points);
    scan_.some = {};
    samples_.emplace(store, detail, cuts_, options.path);
    std::uint64_t most = 0;
    for (std::uint32_t i = 0; i < cuts_.cells.size(); ++i) {
      most = std::max<std::uint64_t>(most, samples_->count(i, 1));
    }
    cell_threads_ = threads_within_memory(most * kBytesPerPoint, most);
  }
  reading_seconds_ = reading.seconds();
}

unsigned PointMesher::threads_within_memory(std::uint64_t each, std::uint64_t points) const {
  const std::uint64_t beside = single() ? 0 : kBytesBeside;
  if (!single()) each += kBytesPerReader;
  const std::uint64_t memory = context_.memory_or(0);
  if (memory < beside + each) {
    throw stream::Error({.file = store_.path().string(),
                         .where = {},
                         .cause = "a mesh with a bound needs " +
                                  std::to_string(((beside + each) >> 20) + 1) + "M of memory for " +
                                  with_commas(points) +
                                  " irregular points at a time, `memory_bytes` allows " +
                                  std::to_string(memory >> 20) + "M",
                         .remedy = "allow more"});
  }
  return static_cast<unsigned>(std::min<std::uint64_t>(
      context_.threads, (memory - beside) / std::max<std::uint64_t>(each, 1)));
}

PointMeshOptions PointMesher::mesh_options(double max_error) const {
  PointMeshOptions out;
  out.bound = max_error;
  const Aim aim = aim_within(max_error, rounding_, options_.path);
  out.first_aim = aim.first;
  out.tin.max_error = aim.sure;
  out.tin.duplicates = options_.duplicates;
  out.tin.quality = options_.quality;
  return out;
}

BoundedMeshResult PointMesher::run_whole(const PointMeshOptions& options, MeshSpool& spool) const {
  const Stopwatch meshing;
  const std::uint64_t points = scan_.whole->size();
  threads_within_memory(points * kBytesPerPoint, points);
  const PointWindowTin tin =
      mesh_samples(*scan_.whole, {}, {}, options, rounding_, store_.path().string());
  BoundedMeshResult result;
  result.max_error = tin.errors.largest;
  result.rms_error = tin.errors.rms;
  result.samples = tin.samples;
  result.uncovered = tin.uncovered;
  result.duplicates = tin.duplicates;
  for (const tri::Point3& p : tin.vertices) spool.add_vertex(p);
  for (const auto& triangle : tin.triangles) spool.add_triangle(triangle);
  result.vertices = spool.vertices();
  result.meshing_seconds = meshing.seconds();
  return result;
}

PointMeshPlan PointMesher::plan_for(double max_error) const {
  const PointMeshEstimate estimate(cuts_, *samples_, options_.duplicates);
  std::vector<double> vertices(cuts_.cells.size(), kPointsPerMeshWindow);
  if (estimate.per_cell(max_error) < kPointsPerMeshWindow / 2.0) {
    in_order(
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
               kMostMeshCells * static_cast<double>(options_.window_points) &&
           std::accumulate(from, from + cells, 0.0) <= kPointsPerMeshWindow;
  });
}

BoundedMeshResult PointMesher::run_windows(const PointMeshOptions& options, MeshSpool& spool,
                                           std::uint64_t most_vertices) const {
  BoundedMeshResult result;
  if (!samples_) {  // on one line: no surface
    result.samples = result.uncovered = scan_.samples;
    return result;
  }
  const PointMeshPlan plan = plan_for(options.tin.max_error);
  std::uint64_t most = 0, each = 0;
  for (const PointMeshPlan::Window& window : plan.windows) {
    const std::uint64_t points = samples_->count(window.first_cell, window.cells);
    most = std::max(most, points);
    each = std::max(each, points * (window.cells == 1 ? kBytesPerPoint : kBytesPerSample));
  }
  PointMeshSides sides(plan, *samples_, options.tin.duplicates, options.tin.max_error);
  const PointWindowMesher mesher(plan, *samples_, sides, options, rounding_,
                                 store_.path().string());
  PointMeshJoiner joiner(plan, sides, spool);
  ProgressReport report(context_, "samples");
  double squares = 0.0, covered = 0.0;
  struct Enough {};
  try {
    in_order(
        plan.windows.size(), threads_within_memory(each, most),
        [&](unsigned, std::size_t i) {
          context_.check_stop();
          return mesher.mesh(i);
        },
        [&](std::size_t i, const PointWindowTin& tin) {
          joiner.add(i, tin);
          result.samples += tin.samples;
          if (spool.vertices() > most_vertices) throw Enough{};
          result.max_error = std::max(result.max_error, tin.errors.largest);
          const auto count = static_cast<double>(tin.errors.covered);
          squares += tin.errors.rms * tin.errors.rms * count;
          covered += count;
          result.uncovered += tin.uncovered;
          result.duplicates += tin.duplicates;
          result.reading_seconds += tin.reading_seconds;
          result.meshing_seconds += tin.meshing_seconds;
          report.update(result.samples,
                        static_cast<double>(result.samples) / static_cast<double>(scan_.samples));
        });
  } catch (const Enough&) {
    // The caller sees it by the number of vertices, told from the part that is made.
    const double part =
        std::max(1.0, static_cast<double>(result.samples)) / static_cast<double>(scan_.samples);
    result.vertices = static_cast<std::uint64_t>(static_cast<double>(spool.vertices()) / part);
    result.vertices = std::max(result.vertices, most_vertices + 1);
    return result;
  }
  result.vertices = spool.vertices();
  result.rms_error = covered > 0.0 ? std::sqrt(squares / covered) : 0.0;
  return result;
}

double PointMesher::estimate(double max_error) const {
  // Removal leaves less than two thirds of what insertion makes.
  const double left = options_.quality == tri::TinQuality::kGreedy ? 1.0 : 0.6;
  return left * PointMeshEstimate(cuts_, *samples_, options_.duplicates).per_cell(max_error) *
         static_cast<double>(cuts_.cells.size());
}

stream::Error PointMesher::shared_places_error() const {
  SharedPlaces shared;
  if (scan_.whole) {
    shared.add(*scan_.whole);
  } else {
    for (std::uint32_t cell = 0; cell < cuts_.cells.size(); ++cell) {
      context_.check_stop();
      MeshSamples samples;
      samples_->read(cell, 1, {}, samples);
      shared.add(samples);
    }
  }
  const bool some = shared.places > 1;
  return stream::Error(
      {.file = store_.path().string(),
       .where = {},
       .cause = with_commas(shared.places) + (some ? " places have" : " place has") +
                " several samples, whose heights differ by up to " +
                readable_number(shared.range * metres_vertical()) + " m (at " +
                number_text(shared.widest[0]) + ", " + number_text(shared.widest[1]) + ")",
       .remedy = options_.duplicates == tri::PointDuplicates::kAll
                     ? "say with `duplicates` min, max, mean or first which of them counts, or ask "
                       "for a larger `max_error`"
                     : "say with `duplicates` which of them counts"});
}

BoundedMeshResult PointMesher::run(double max_error, MeshSpool& spool,
                                   std::uint64_t most_vertices) {
  BoundedMeshResult result;
  try {
    if (!single()) {
      result = run_windows(mesh_options(max_error), spool, most_vertices);
    } else {
      PointMeshOptions options;
      if (options_.max_points > 0) {
        options = mesh_options(bounds_.max[2] - bounds_.min[2]);
        options.first_aim = options.tin.max_error = 0.0;
        options.tin.max_points = options_.max_points;
      } else {
        options = mesh_options(max_error);
      }
      result = run_whole(options, spool);
    }
  } catch (const SamplesShareAPlace&) {
    throw shared_places_error();
  }
  result.reading_seconds += reading_seconds_;
  result.triangles = spool.triangles();
  return result;
}

}  // namespace terrace::terrain
