// SPDX-License-Identifier: GPL-3.0-or-later
#include "contour_run.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <terrace/stream/error.hpp>

#include "contour_lines.hpp"
#include "crs_options.hpp"
#include "fixed_text.hpp"
#include "ground_slope.hpp"
#include "parallel.hpp"
#include "store_window.hpp"
#include "units.hpp"

namespace terrace::tools {
namespace {

constexpr std::int64_t kBandRows = 256, kWindow = 512;
/// Of a sample of a band (height, level), and of a point of a line at work (twice while it grows).
constexpr std::uint64_t kBytesPerSample = 16, kBytesPerPoint = 48;
/// Nine decimals of a degree are a tenth of a millimetre.
constexpr int kDecimals = 9;

stream::Error failure(const stream::Store& store, const std::string& cause,
                      const std::string& remedy) {
  return stream::Error(
      {.file = store.path().string(), .where = {}, .cause = cause, .remedy = remedy});
}

/// The samples around the region.
LatticeWindow lattice_of(const stream::Store& store, const GroundSlope& ground,
                         const std::optional<Region>& region) {
  const auto columns = static_cast<double>(store.schema().columns);
  const auto rows = static_cast<double>(store.schema().rows);
  stream::Box3 box;
  box.min = {0, 0, 0};
  box.max = {columns - 1, rows - 1, 0};
  if (region) {
    stream::Box3 wanted;
    const stream::Box3& world = region->box();
    for (unsigned corner = 0; corner < 4; ++corner) {
      const Point2 p = ground.stored(
          {(corner & 1 ? world.max : world.min)[0], (corner & 2 ? world.max : world.min)[1]});
      wanted.include(stream::Point3{p[0], p[1], 0});
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      box.min[axis] = std::max(box.min[axis], std::floor(wanted.min[axis]));
      box.max[axis] = std::min(box.max[axis], std::ceil(wanted.max[axis]));
    }
  }
  if (!(box.min[0] <= box.max[0] && box.min[1] <= box.max[1])) {
    throw failure(store, "the region does not meet the store",
                  "`terrace info` tells its bounds; --region-crs says in which CRS the region is");
  }
  const auto whole = [](double value) { return static_cast<std::int64_t>(value); };
  return {whole(box.min[0]), whole(box.min[1]), whole(box.max[0] - box.min[0]) + 1,
          whole(box.max[1] - box.min[1]) + 1};
}

}  // namespace

ContourOutcome write_contours(const stream::Store& store, const ContourRequest& request,
                              const std::function<void(std::string_view)>& write,
                              const std::function<void(std::uint64_t, double)>& progress) {
  if (!store.schema().grid) {
    throw failure(store, "contour lines are made of rasters, and this store holds points",
                  "build a store of a raster");
  }
  const CoordinateSystem system = system_of(store);
  const GroundSlope ground(store);
  const LatticeWindow lattice = lattice_of(store, ground, request.region);
  const stream::Channel& z = store.schema().coordinates[2];
  for (const double raw : {store.bounds().min[2], store.bounds().max[2]}) {
    if (store.points() > 0 && std::abs((raw * z.scale + z.offset) / request.interval) > 1e15) {
      throw failure(store, "heights have too many levels of " + number_text(request.interval),
                    "give a larger --interval");
    }
  }
  const std::int64_t band = std::clamp<std::int64_t>(
      static_cast<std::int64_t>(request.memory_bytes / 4 / kBytesPerSample) / lattice.columns, 2,
      kBandRows);

  ContourOutcome outcome;
  std::string text =
      "{\"type\":\"FeatureCollection\",\"generator\":\"terrace contour\",\"features\":[";
  const FixedText degrees(kDecimals);
  std::vector<Point2> places;
  const auto emit = [&](const ContourLine& line) {
    places.clear();
    for (const Point2& p : line.points) {
      places.push_back(ground.world(
          {p[0] + static_cast<double>(lattice.column), p[1] + static_cast<double>(lattice.row)}));
    }
    system.to_geographic(places);
    text += outcome.lines == 0 ? "\n" : ",\n";
    text += "{\"type\":\"Feature\",\"properties\":{\"elev\":" +
            number_text(static_cast<double>(line.level) * request.interval) +
            "},\"geometry\":{\"type\":\"LineString\",\"coordinates\":[";
    for (std::size_t i = 0; i < places.size(); ++i) {
      text += i == 0 ? "[" : ",[";
      degrees.append(text, places[i][0]);
      text += ',';
      degrees.append(text, places[i][1]);
      text += ']';
    }
    text += "]}}";
    ++outcome.lines;
    outcome.closed += line.closed ? 1 : 0;
    outcome.points += line.points.size();
    if (text.size() > (std::size_t{1} << 20)) {
      write(text);
      text.clear();
    }
  };
  ContourLines lines(lattice.columns, request.interval, emit);
  std::function<bool(std::int64_t, std::int64_t)> wanted;
  if (request.region) {
    wanted = [&](std::int64_t column, std::int64_t row) {
      const Point2 p = ground.world({static_cast<double>(column + lattice.column) + 0.5,
                                     static_cast<double>(row + lattice.row) + 0.5});
      return request.region->contains(
          {p[0], p[1], request.region->box().min[2] > -1e300 ? request.region->box().min[2] : 0});
    };
  }

  const auto windows = static_cast<std::size_t>((lattice.columns + kWindow - 1) / kWindow);
  std::vector<std::unique_ptr<StoreWindow>> readers(std::max(1U, request.threads));
  std::vector<double> heights;
  for (std::int64_t row = 0; row + 1 < lattice.rows; row += band) {
    const std::int64_t rows = std::min(band + 1, lattice.rows - row);
    heights.resize(static_cast<std::size_t>(lattice.columns * rows));
    parallel_for(windows, request.threads, [&](unsigned thread, std::size_t i) {
      if (readers[thread] == nullptr) readers[thread] = std::make_unique<StoreWindow>(store);
      const std::int64_t column = static_cast<std::int64_t>(i) * kWindow;
      const LatticeWindow window{lattice.column + column, lattice.row + row,
                                 std::min(kWindow, lattice.columns - column), rows};
      std::vector<double> part(window.size());
      readers[thread]->heights(window, std::span(part));
      for (std::int64_t r = 0; r < rows; ++r) {
        std::copy_n(part.begin() + r * window.columns, window.columns,
                    heights.begin() + r * lattice.columns + column);
      }
    });
    lines.add(heights, rows, wanted);
    if (lines.open_points() * kBytesPerPoint > request.memory_bytes / 2) {
      throw failure(store,
                    "contour lines that are not at their ends have " +
                        with_commas(lines.open_points()) + " points, too many for --memory",
                    "raise --memory or --interval, or take a smaller --region");
    }
    if (progress) {
      progress(outcome.lines, static_cast<double>(row) / static_cast<double>(lattice.rows));
    }
  }
  lines.finish();
  text += "\n]}\n";
  write(text);
  return outcome;
}

}  // namespace terrace::tools
