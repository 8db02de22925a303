// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "base/store_checks.hpp"
#include "contour/lines.hpp"
#include "contour/parts.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

constexpr std::int64_t kWindow = 512;
/// Memory in bytes per sample of a band: its height and its level.
constexpr std::uint64_t kContourBytesPerSample = 16;

/// Returns the window of samples around the region.
LatticeWindow lattice_of(const stream::Store& store, const GroundSlope& ground,
                         const std::optional<Region>& region) {
  StoredBox box{{0, 0},
                {static_cast<double>(store.schema().columns) - 1,
                 static_cast<double>(store.schema().rows) - 1}};
  if (region) {
    const StoredBox area = box_around(*region, ground);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      box.min[axis] = std::max(box.min[axis], std::floor(area.min[axis]));
      box.max[axis] = std::min(box.max[axis], std::ceil(area.max[axis]));
    }
  }
  if (!(box.min[0] <= box.max[0] && box.min[1] <= box.max[1])) throw_none_inside(store);
  const auto integer = [](double value) { return static_cast<std::int64_t>(value); };
  return {integer(box.min[0]), integer(box.min[1]), integer(box.max[0] - box.min[0]) + 1,
          integer(box.max[1] - box.min[1]) + 1};
}

}  // namespace

void draw_lattice_contours(const ContourParts& parts) {
  const stream::Store& store = parts.store;
  const ContourRequest& request = parts.request;
  if (request.max_edge) {
    throw UsageError(stream::message(
        "{max_edge} is for irregular points and coarser levels: rasters mark missing data "
        "explicitly"));
  }
  const GroundSlope ground(store);
  const LatticeWindow lattice = lattice_of(store, ground, request.region);
  const std::int64_t fits =
      static_cast<std::int64_t>(parts.memory_bytes / 4 / kContourBytesPerSample) / lattice.columns;
  std::int64_t band = ContourLines::kMaxBandRows;
  while (band > 2 && band > fits) band /= 2;
  const auto stored = [&](const Point2& p) {
    return Point2{p[0] + static_cast<double>(lattice.column),
                  p[1] + static_cast<double>(lattice.row)};
  };
  ContourLines lines(
      lattice.columns, request.interval,
      [&](ContourLine&& line) {
        for (Point2& p : line.points) p = stored(p);
        parts.emit(std::move(line));
      },
      parts.limit, parts.threads);
  std::function<bool(std::int64_t, std::int64_t)> is_wanted;
  if (request.region) {
    is_wanted = [&](std::int64_t column, std::int64_t row) {
      return request.region->covers(ground.world(
          stored({static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5})));
    };
  }

  const auto windows = static_cast<std::size_t>((lattice.columns + kWindow - 1) / kWindow);
  std::vector<std::unique_ptr<StoreWindow>> readers(parts.threads);
  std::vector<double> heights;
  for (std::int64_t row = 0; row + 1 < lattice.rows; row += band) {
    const std::int64_t rows = std::min(band + 1, lattice.rows - row);
    heights.resize(static_cast<std::size_t>(lattice.columns * rows));
    parallel_for(
        windows, parts.threads,
        [&](std::size_t i, unsigned thread) {
          if (readers[thread] == nullptr) {
            readers[thread] = std::make_unique<StoreWindow>(store);
          }
          const std::int64_t column = static_cast<std::int64_t>(i) * kWindow;
          const LatticeWindow window{lattice.column + column, lattice.row + row,
                                     std::min(kWindow, lattice.columns - column), rows};
          std::vector<double> part(window.size(), NAN);
          // The squares of the samples at the window's sides extend half a cell beyond it.
          const StoredBox around{
              {static_cast<double>(window.column - 1), static_cast<double>(window.row - 1)},
              {static_cast<double>(window.column + window.columns),
               static_cast<double>(window.row + window.rows)}};
          if (!request.region || reaches_into(around, *request.region, ground)) {
            readers[thread]->heights(window, std::span(part));
          }
          for (std::int64_t r = 0; r < rows; ++r) {
            std::copy_n(part.begin() + r * window.columns, window.columns,
                        heights.begin() + r * lattice.columns + column);
          }
        },
        parts.limit.stop);
    lines.add(heights, rows, is_wanted);
    parts.progress(static_cast<double>(row) / static_cast<double>(lattice.rows));
  }
  lines.finish();
}

}  // namespace terrace::terrain
