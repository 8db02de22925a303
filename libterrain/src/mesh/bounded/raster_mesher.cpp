// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <terrace/base/ordered_work.hpp>
#include <terrace/base/portable_math.hpp>
#include <terrace/stream/store.hpp>

#include "earth/ground.hpp"
#include "mesh/bounded/mesher.hpp"
#include "mesh/bounded/raster_window_tin.hpp"
#include "surface/bounded/lattice_plan.hpp"
#include "surface/store_fill.hpp"
#include "surface/store_window.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Smallest and largest size of a window along each axis, in cells. Small meshes use the largest.
constexpr std::int64_t kWindowCells = 512, kWidestCells = 2048;
/// Target for the vertices per window, so that few of them are on sides, where they cannot be
/// removed.
constexpr double kVerticesPerWindow = 3000.0;
/// Size along each axis, in cells, of the windows that estimates are made from.
constexpr std::int64_t kSampleCells = 256;
/// Worst case per thread: a window of kWindowCells with every sample a vertex, or one of
/// kWidestCells with few, and the waiting results.
constexpr std::uint64_t kBytesPerThread = std::uint64_t{112} << 20;
constexpr std::uint64_t kRasterFixedBytes = std::uint64_t{48} << 20;
constexpr std::uint64_t kFillBytes = std::uint64_t{32} << 20;
/// Limit, in cells, for the distance of an edge that is straight in the file from the samples along
/// it: less than half, so that no sample next to a window's side moves to the other side of it.
constexpr double kMaxBend = 0.125;

/// Returns the size of windows, from the vertices per sample of greedy insertion.
std::int64_t window_cells(double per_sample) {
  std::int64_t cells = kWindowCells;
  while (per_sample * static_cast<double>(cells * cells) < kVerticesPerWindow &&
         cells < kWidestCells) {
    cells *= 2;
  }
  return cells;
}

/// Returns the samples of a raster store that a region needs: those inside and the next ones
/// outside, so that every triangle of neighbouring samples that reaches inside has its corners.
/// Without a region, returns all samples; empty if the region misses the raster.
LatticeWindow lattice_of(const stream::Store& store, const std::optional<Region>& region) {
  const stream::StoreSchema& schema = store.schema();
  assert(schema.grid);
  const auto columns = static_cast<std::int64_t>(schema.columns);
  const auto rows = static_cast<std::int64_t>(schema.rows);
  if (!region) return {0, 0, columns, rows};
  const stream::Placement& placement = schema;
  stream::Box3 box;
  for (unsigned corner = 0; corner < 4; ++corner) {
    const Point2 stored =
        stored_place(placement, {((corner & 1) != 0 ? region->box().max : region->box().min)[0],
                                 ((corner & 2) != 0 ? region->box().max : region->box().min)[1]});
    box.include(stream::Point3{stored[0], stored[1], 0.0});
  }
  const auto first = [](double low, std::int64_t count) {
    return static_cast<std::int64_t>(
        std::clamp(std::floor(low) - 1.0, 0.0, static_cast<double>(count)));
  };
  const auto last = [](double high, std::int64_t count) {
    return static_cast<std::int64_t>(
        std::clamp(std::ceil(high) + 1.0, -1.0, static_cast<double>(count - 1)));
  };
  const std::int64_t c0 = first(box.min[0], columns), c1 = last(box.max[0], columns);
  const std::int64_t r0 = first(box.min[1], rows), r1 = last(box.max[1], rows);
  // If it is more than a sample outside, nothing of it is inside.
  const bool missed = box.empty() || box.max[0] < 0.0 || box.max[1] < 0.0 ||
                      box.min[0] > static_cast<double>(columns - 1) ||
                      box.min[1] > static_cast<double>(rows - 1) || c1 < c0 || r1 < r0;
  if (missed) return {};
  return {c0, r0, c1 - c0 + 1, r1 - r0 + 1};
}

/// Counts samples on sides of windows that no window covers.
class SideSamples {
 public:
  /// Adds samples that a window does not cover. Returns the number of samples that are now known to
  /// be covered by none of the windows that share them. Each sample counts once.
  std::uint64_t add(const std::vector<RasterWindow::SideSample>& uncovered) {
    std::uint64_t by_none = 0;
    for (const RasterWindow::SideSample& sample : uncovered) {
      const auto entry = windows_.try_emplace(sample.place, 0U).first;
      if (++entry->second < sample.windows) continue;
      ++by_none;
      windows_.erase(entry);
    }
    return by_none;
  }

 private:
  std::map<std::uint64_t, unsigned> windows_;  ///< by place: those that do not cover it
};

/// Meshes a raster store. Windows share their sides, and the vertices on a side depend only on the
/// samples there.
class RasterMesher final : public BoundedMesher {
 public:
  /// Throws: stream::Error if memory does not suffice, UsageError.
  RasterMesher(const stream::Store& store, const BoundedMeshOptions& options,
               const Context& context);

  BoundedMeshResult run(double max_error, MeshSpool& spool, std::uint64_t max_vertices) override;
  [[nodiscard]] double estimate(double max_error) const override;
  /// Whether the sampled windows are a small part of all.
  [[nodiscard]] bool can_estimate() const override;

 private:
  [[nodiscard]] WindowTinOptions window_options(double max_error) const;
  [[nodiscard]] std::vector<std::unique_ptr<WindowMesher>> meshers(double max_error) const;
  /// Measured on some windows; depends only on data and bound.
  struct Sample {
    double vertices_per_sample = 0.0;
    double reading_seconds = 0.0, meshing_seconds = 0.0;
  };
  [[nodiscard]] Sample sample(double max_error, tri::TinQuality quality, std::size_t across,
                              std::size_t down) const;

  /// Returns the largest size of a window along each axis, in cells, at which a straight edge in
  /// the file is within kMaxBend of the samples along it. Requires a conversion.
  [[nodiscard]] std::int64_t straight_cells() const;

  LatticeWindow lattice_;
  std::int64_t max_cells_ = std::numeric_limits<std::int64_t>::max();  ///< of a window, along each
                                                                       ///< axis
  unsigned threads_ = 1;
  std::shared_ptr<const StoreFill> fill_;
};

RasterMesher::RasterMesher(const stream::Store& store, const BoundedMeshOptions& options,
                           const Context& context)
    : BoundedMesher(store, options, context), lattice_(lattice_of(store, options.region)) {
  if (lattice_.columns < 2 || lattice_.rows < 2) {
    if (options.region) {
      throw UsageError(stream::message("{region}: it does not meet the raster of the store"));
    }
    throw stream::Error(store.path().string(),
                        "the raster is one line of samples, so it has no triangles")
        .remedy("use a profile or its points instead of a mesh");
  }
  const bool interpolates = options.fill == Fill::interpolate;
  threads_ =
      threads_within_memory(kBytesPerThread, kRasterFixedBytes +
                                                 WindowJoiner::kBytesPerShared *
                                                     static_cast<std::uint64_t>(lattice_.columns) +
                                                 (interpolates ? kFillBytes : 0));
  if (interpolates) fill_ = std::make_shared<StoreFill>(store);
  if (options.places.has_effect()) max_cells_ = straight_cells();
}

std::int64_t RasterMesher::straight_cells() const {
  constexpr int kPlaces = 8;  // along each axis
  constexpr std::array<Point2, 4> kWays{{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
  const double half = 0.5 * static_cast<double>(std::min<std::int64_t>(
                                kWindowCells, std::max(lattice_.columns, lattice_.rows) - 1));
  double bend = 0.0;  // of an edge of twice `half` cells along a row or column
  for (int i = 0; i <= kPlaces; ++i) {
    for (int j = 0; j <= kPlaces; ++j) {
      const auto at = [](std::int64_t first, std::int64_t count, int step) {
        return static_cast<double>(first) + static_cast<double>((count - 1) * step) / kPlaces;
      };
      const Point2 middle{at(lattice_.column, lattice_.columns, i),
                          at(lattice_.row, lattice_.rows, j)};
      for (const Point2& way : kWays) {
        std::array<Point2, 3> places{};
        for (std::size_t k = 0; k < 3; ++k) {
          const double step = half * (static_cast<double>(k) - 1.0);
          const stream::Point3 p =
              world_point(placement_, {middle[0] + step * way[0], middle[1] + step * way[1], 0.0});
          places[k] = {p[0], p[1]};
        }
        options_.places(std::span<Point2>(places));
        const auto& [a, m, b] = places;
        const double cells = 2.0 * half * base::hypot(way[0], way[1]);
        const double off = base::hypot(0.5 * (a[0] + b[0]) - m[0], 0.5 * (a[1] + b[1]) - m[1]);
        const double length = base::hypot(b[0] - a[0], b[1] - a[1]);
        // A sample without an image there is refused when it becomes a vertex.
        if (!std::isfinite(off) || !(length > 0.0)) continue;
        // In cells along this direction, scaled to the length along a row.
        bend = std::max(bend, off / (length / cells) / (way[0] * way[0] + way[1] * way[1]));
      }
    }
  }
  // Bends grow as the square of the length; the longest edge is the diagonal of the largest window.
  constexpr double kLongest = 1.5 * 1.4143;
  const double cells = 2.0 * half * std::sqrt(kMaxBend / std::max(bend, 1e-9)) / kLongest;
  return static_cast<std::int64_t>(std::clamp(cells, 1.0, static_cast<double>(kWidestCells)));
}

double RasterMesher::estimate(double max_error) const {
  return sample(max_error, options_.quality, 4, 2).vertices_per_sample *
         static_cast<double>(lattice_.size());
}

bool RasterMesher::can_estimate() const {
  return lattice_.size() >= std::size_t{24} * kSampleCells * kSampleCells;
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
  const Aim aim = aim_within(max_error);
  out.bound = aim.bound;
  out.first_aim = aim.first;
  out.aim = aim.sure;
  out.lattice = lattice_;
  out.region = options_.region;
  out.places = options_.places;
  out.tin.quality = options_.quality;
  out.tin.check_stop = [this] { context_.check_stop(); };
  const GroundMap ground = Ground(placement_).map(store_.bounds());
  const bool mirrored = ground[0] * ground[4] - ground[1] * ground[3] < 0.0;
  out.tin.column_step = base::hypot(ground[0], ground[3]);
  out.tin.row_step = (mirrored ? -1.0 : 1.0) * base::hypot(ground[1], ground[4]);
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
  const LatticePlan plan(lattice_, kSampleCells);
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
  base::in_order(
      windows.size(), threads_,
      [&](unsigned worker, std::size_t i) {
        context_.check_stop();
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

BoundedMeshResult RasterMesher::run(double max_error, MeshSpool& spool,
                                    std::uint64_t max_vertices) {
  std::int64_t cells = kWindowCells;
  Sample sample;
  if (LatticePlan(lattice_, cells).size() > 1) {
    sample = this->sample(max_error, tri::TinQuality::greedy, 2, 2);
    cells = window_cells(sample.vertices_per_sample);
  }
  const LatticePlan plan(lattice_, std::min(cells, max_cells_));
  const auto meshers = this->meshers(max_error);
  SideSamples side_samples;
  BoundedMeshResult result = run_windows(
      plan.size(), threads_, lattice_.size(), spool, max_vertices,
      [&](unsigned worker, std::size_t i) { return meshers[worker]->mesh(plan, i); },
      [&](std::size_t, RasterWindow& window) {
        window.measures.uncovered += side_samples.add(window.uncovered);
      });
  result.reading_seconds += sample.reading_seconds;
  result.meshing_seconds += sample.meshing_seconds;
  return result;
}

}  // namespace

std::unique_ptr<BoundedMesher> make_raster_mesher(const stream::Store& store,
                                                  const BoundedMeshOptions& options,
                                                  const Context& context) {
  return std::make_unique<RasterMesher>(store, options, context);
}

}  // namespace terrace::terrain
