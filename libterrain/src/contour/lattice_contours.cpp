// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "base/store_checks.hpp"
#include "contour/lines.hpp"
#include "contour/parts.hpp"
#include "surface/ground_slope.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Columns that one task reads.
constexpr std::int64_t kWindowColumns = 512;
/// Bytes per sample of a band: a height and a level.
constexpr std::uint64_t kContourBytesPerSample = 16;

/// Returns the smallest window of samples that contains the region, or the whole raster.
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
  const auto to_integer = [](double value) { return static_cast<std::int64_t>(value); };
  return {to_integer(box.min[0]), to_integer(box.min[1]), to_integer(box.max[0] - box.min[0]) + 1,
          to_integer(box.max[1] - box.min[1]) + 1};
}

}  // namespace

void draw_lattice_contours(const ContourParts& parts) {
  const stream::Store& store = parts.store;
  const ContourRequest& request = parts.request;
  if (request.max_edge) {
    throw UsageError(stream::message(
        "{max_edge} does not apply to level 0 of a raster, which marks missing data explicitly"));
  }
  const GroundSlope ground(store);
  const LatticeWindow lattice = lattice_of(store, ground, request.region);
  // Bands may use a quarter of the memory; the rest is for open lines and blocks of the store.
  const std::int64_t max_band_rows =
      static_cast<std::int64_t>(parts.memory_bytes / 4 / kContourBytesPerSample) / lattice.columns;
  std::int64_t band = ContourLines::kMaxBandRows;
  // Halves, so that the order of lines stays the same (see kMaxBandRows).
  while (band > 2 && band > max_band_rows) band /= 2;
  const auto to_stored = [&](const Point2& p) {
    return Point2{p[0] + static_cast<double>(lattice.column),
                  p[1] + static_cast<double>(lattice.row)};
  };
  ContourLines contours(
      lattice.columns, request.interval,
      [&](ContourLine&& line) {
        for (Point2& p : line.points) p = to_stored(p);
        parts.emit(std::move(line));
      },
      parts.limit, parts.threads);
  std::function<bool(std::int64_t, std::int64_t)> in_region;
  if (request.region) {
    in_region = [&](std::int64_t column, std::int64_t row) {
      return request.region->covers(ground.world(
          to_stored({static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5})));
    };
  }

  const auto windows =
      static_cast<std::size_t>((lattice.columns + kWindowColumns - 1) / kWindowColumns);
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
          const std::int64_t column = static_cast<std::int64_t>(i) * kWindowColumns;
          const LatticeWindow window{lattice.column + column, lattice.row + row,
                                     std::min(kWindowColumns, lattice.columns - column), rows};
          std::vector<double> window_heights(window.size(), NAN);
          // The squares that use the outer samples of the window reach one cell beyond it.
          const StoredBox around{
              {static_cast<double>(window.column - 1), static_cast<double>(window.row - 1)},
              {static_cast<double>(window.column + window.columns),
               static_cast<double>(window.row + window.rows)}};
          if (!request.region || reaches_into(around, *request.region, ground)) {
            readers[thread]->heights(window, std::span(window_heights));
          }
          for (std::int64_t r = 0; r < rows; ++r) {
            std::copy_n(window_heights.begin() + r * window.columns, window.columns,
                        heights.begin() + r * lattice.columns + column);
          }
        },
        parts.limit.stop);
    contours.add(heights, rows, in_region);
    parts.progress(static_cast<double>(row) / static_cast<double>(lattice.rows));
  }
  contours.finish();
}

}  // namespace terrace::terrain
