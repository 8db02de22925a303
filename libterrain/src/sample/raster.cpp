// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/raster.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/tri/interpolation.hpp>

#include "base/available_memory.hpp"
#include "base/parallel.hpp"
#include "base/progress_report.hpp"
#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "earth/crs/definition.hpp"
#include "earth/ground.hpp"
#include "sample/raster_grid.hpp"
#include "sample/samplers.hpp"
#include "surface/ground_slope.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

stream::Placement placement_of(const RasterGrid& grid, const stream::StoreSchema& schema,
                               const stream::Crs& crs) {
  stream::Placement placement = schema;
  placement.world.xy = {grid.step_x, 0, grid.x, 0, grid.step_y, grid.y};
  // Heights are already scaled.
  placement.coordinates[2].scale = 1;
  placement.coordinates[2].offset = 0;
  placement.crs = crs;
  // Heights keep the unit that they have together with the store's own x and y.
  placement.coordinates[2].unit = Ground(schema).height_unit();
  return placement;
}

/// Computes slope, aspect or hillshade from the heights around a cell, see write_raster().
class RasterShader {
 public:
  /// value: anything but the height. crs: of the grid.
  RasterShader(const RasterGrid& grid, const stream::StoreSchema& schema, const stream::Crs& crs,
               RasterValue value)
      : value_(value),
        ground_(placement_of(grid, schema, crs)),
        assumption_(Ground(schema).assumption()) {}

  /// Metres per cell towards east and north, and metres per unit of height, at a cell.
  struct Scale {
    double east = 1, north = 1, up = 1;
  };
  [[nodiscard]] Scale scale(double column, double row) const {
    const stream::Point3 centre{column, row, 0};
    const GroundMap map = ground_.map({centre, centre});
    return {map[0], -map[4], map[8]};
  }

  /// z: the middle of 3 x 3 heights in rows `stride` apart. Returns NaN if there is no value.
  [[nodiscard]] double operator()(const double* z, std::ptrdiff_t stride, const Scale& s) const {
    const double *n = z - stride, *p = z + stride;
    const double gx =
        s.up * ((n[1] + 2 * z[1] + p[1]) - (n[-1] + 2 * z[-1] + p[-1])) / (8 * s.east);
    const double gy =
        s.up * ((n[-1] + 2 * n[0] + n[1]) - (p[-1] + 2 * p[0] + p[1])) / (8 * s.north);
    if (!(gx == gx && gy == gy && z[0] == z[0])) return NAN;
    if (value_ == RasterValue::slope) return tri::slope_degrees({gx, gy});
    if (value_ == RasterValue::aspect) return tri::aspect_degrees({gx, gy});
    // Towards the light in the north-west, at an altitude of 45 degrees.
    const double light =
        (0.5 * gx - 0.5 * gy + std::numbers::sqrt2 / 2) / std::sqrt(1 + gx * gx + gy * gy);
    return light <= 0 ? 1 : 1 + 254 * light;
  }

  /// The assumptions about units; may be empty.
  [[nodiscard]] const std::string& assumption() const { return assumption_; }

 private:
  RasterValue value_;
  Ground ground_;
  std::string assumption_;  ///< about the store
};

constexpr std::int64_t kRunTile = 256;
/// Peak memory in bytes per cell of the tiles in progress: places twice, sorting, surface, heights.
constexpr std::uint64_t kBytesPerCell = 130;

/// The most tiles along a side of the square that is sampled at once.
constexpr std::int64_t kMaxSide = 8;

std::uint64_t bytes_of(std::int64_t side, const SamplerOptions& options) {
  const std::uint64_t per_cell = kBytesPerCell + added_bytes_per_place(options);
  return static_cast<std::uint64_t>(side * side * kRunTile * kRunTile) * per_cell;
}

/// A tile's column and row among the tiles.
struct TilePlace {
  std::int64_t column = 0, row = 0;
};

constexpr std::int64_t power_of_two(std::int64_t at_least) {
  std::int64_t power = 1;
  while (power < at_least) power *= 2;
  return power;
}

/// Calls visit(corner) for the squares of `side` tiles in the square of `size` at `corner` that
/// begin before `end`, quarter by quarter. So tiles come in the same order for any side, and nearby
/// tiles are close to each other in that order. Both sizes are powers of two.
template <class Visit>
void for_each_square(TilePlace corner, std::int64_t size, std::int64_t side, TilePlace end,
                     const Visit& visit) {
  if (corner.column >= end.column || corner.row >= end.row) return;
  if (size <= side) return visit(corner);
  const std::int64_t half = size / 2;
  for (const auto& [column, row] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
    for_each_square({corner.column + column * half, corner.row + row * half}, half, side, end,
                    visit);
  }
}

/// An unknown CRS is written as the store records it.
stream::Crs crs_with_keys(const stream::Store& store) {
  const stream::Crs& recorded = store.schema().crs;
  if (recorded.epsg != 0) return recorded;
  try {
    const std::optional<CrsDefinition> definition = definition_of(recorded);
    if (definition) return CoordinateSystem(*definition).crs_with_keys();
  } catch (const CrsError&) {
    // Only functions that need places report the error; heights do not need them.
  }
  return recorded;
}

SamplerOptions heights_only(SamplerOptions options) {
  options.gradients = false;
  return options;
}

class RasterRun {
 public:
  RasterRun(const stream::Store& store, const RasterRequest& request, const RasterGrid& grid,
            const Context& context)
      : request_(request),
        context_(context),
        grid_(grid),
        crs_(request.to ? request.to->to().crs_with_keys() : crs_with_keys(store)),
        ground_(store),
        sampler_(make_sampler(store, heights_only(request.sampler), context)),
        shader_(grid_, store.schema(), crs_, request.value),
        nodata_(nodata(store, request.value)) {}

  RasterOutcome run(const std::string& height_unit, const ProgressReport& report) {
    stream::GeoTiffOptions options;
    options.columns = grid_.columns;
    options.rows = grid_.rows;
    options.sample.type = shaded() ? stream::ScalarType::u8 : stream::ScalarType::f32;
    if (request_.value == RasterValue::height) options.sample.unit = height_unit;
    options.world.xy = {grid_.step_x, 0, grid_.x, 0, grid_.step_y, grid_.y};
    options.crs = crs_;
    options.nodata = nodata_;
    options.tile = kRunTile;
    options.overviews = request_.value == RasterValue::aspect ? stream::GeoTiffOverviews::nearest
                                                              : stream::GeoTiffOverviews::average;
    options.level = 6;  // overviews included, as fast as level 7 without them, and hardly larger
    options.threads = context_.threads;
    options.replace = request_.replace;
    options.stop = context_.stop;
    const std::uint64_t memory = memory_without_table(options);
    stream::GeoTiffWriter writer(request_.output, options);
    const std::int64_t across = (grid_.columns + kRunTile - 1) / kRunTile;
    const std::int64_t down = (grid_.rows + kRunTile - 1) / kRunTile;
    std::int64_t side = 1;
    while (side < kMaxSide && bytes_of(2 * side, request_.sampler) <= memory / 2) side *= 2;
    std::vector<TilePlace> block;
    double done = 0;
    for_each_square({0, 0}, power_of_two(std::max(across, down)), side, {across, down},
                    [&](TilePlace corner) {
                      block.clear();
                      for_each_square(corner, side, 1, {across, down},
                                      [&](TilePlace tile) { block.push_back(tile); });
                      sample(corner, side);
                      make_tiles(block, writer);
                      done += static_cast<double>(block.size());
                      const double all = static_cast<double>(across) * static_cast<double>(down);
                      report.update(outcome_.cells_with_data, done / all);
                    });
    writer.commit();
    outcome_.columns = grid_.columns;
    outcome_.rows = grid_.rows;
    if (outcome_.cells_with_data == 0) context_.say(request_.output + ": no cell has data");
    if (request_.value != RasterValue::height && !shader_.assumption().empty()) {
      context_.say(shader_.assumption());
    }
    return outcome_;
  }

 private:
  /// Returns the memory left after the table of the file's tiles. Throws: stream::Error if that is
  /// less than the table.
  [[nodiscard]] std::uint64_t memory_without_table(const stream::GeoTiffOptions& options) const {
    const std::uint64_t table = stream::geotiff_table_bytes(options);
    const std::uint64_t memory = working_memory(context_);
    if (table <= memory / 2) return memory - table;
    throw stream::Error(
        request_.output,
        stream::message("a raster of {} x {} cells needs {} of memory, {memory_bytes} allows {}",
                        with_commas(grid_.columns), with_commas(grid_.rows),
                        readable_bytes(kProcessBytes + 2 * table),
                        readable_bytes(context_.memory_or(0))))
        .remedy(stream::message("pass a larger {cell} or a smaller {region}"));
  }

  [[nodiscard]] bool shaded() const { return request_.value == RasterValue::hillshade; }

  static double nodata(const stream::Store& store, RasterValue value) {
    if (value == RasterValue::hillshade) return 0;
    const stream::Channel& z = store.schema().coordinates[2];
    const auto height = [&](double raw) { return raw * z.scale + z.offset; };
    const double lowest = std::min(height(store.bounds().min[2]), height(store.bounds().max[2]));
    return value == RasterValue::height && lowest <= -9999
               ? static_cast<double>(-std::numeric_limits<float>::max())
               : -9999;
  }

  /// Samples the surface at the cells of a square of tiles and, for slopes, one cell around it, by
  /// rows into heights_.
  void sample(TilePlace corner, std::int64_t side) {
    const std::int64_t around = request_.value == RasterValue::height ? 0 : 1;
    first_column_ = corner.column * kRunTile - around;
    first_row_ = corner.row * kRunTile - around;
    const auto size = [&](std::int64_t first, std::int64_t all) {
      return static_cast<std::size_t>(std::min(side * kRunTile + 2 * around, all + around - first));
    };
    width_ = size(first_column_, grid_.columns);
    const std::size_t height = size(first_row_, grid_.rows);
    places_.resize(width_ * height);
    surface_.resize(places_.size());
    heights_.resize(places_.size());
    parallel_for(
        height, context_.threads,
        [&](std::size_t j) {
          const std::span<Point2> line(places_.data() + j * width_, width_);
          const auto cell = [](std::int64_t first, std::size_t i) {
            return static_cast<double>(first + static_cast<std::int64_t>(i));
          };
          const double y = grid_.y + grid_.step_y * cell(first_row_, j);
          for (std::size_t i = 0; i < width_; ++i) {
            line[i] = {grid_.x + grid_.step_x * cell(first_column_, i), y};
          }
          if (request_.to) request_.to->reverse(line);
          for (Point2& p : line) {
            p = ground_.turned(p);
            p = !clips_ || request_.region->covers(p) ? ground_.stored(p) : Point2{NAN, NAN};
          }
        },
        context_.stop);
    sampler_->sample(places_, surface_);
    for (std::size_t i = 0; i < surface_.size(); ++i) heights_[i] = surface_[i].height;
  }

  void make_tiles(std::span<const TilePlace> block, stream::GeoTiffWriter& writer) {
    tiles_.resize(block.size());
    counts_.assign(block.size(), 0);
    parallel_for(
        block.size(), context_.threads,
        [&](std::size_t i) { make_tile(i, block[i].column * kRunTile, block[i].row * kRunTile); },
        context_.stop);
    for (std::size_t i = 0; i < block.size(); ++i) {
      outcome_.cells_with_data += counts_[i];
      const std::span<const std::byte> samples = tiles_[i];
      writer.write_tile(static_cast<std::uint32_t>(block[i].column),
                        static_cast<std::uint32_t>(block[i].row),
                        counts_[i] == 0 ? samples.first(0) : samples);
    }
  }

  void make_tile(std::size_t number, std::int64_t column, std::int64_t row) {
    std::vector<std::byte>& bytes = tiles_[number];
    const std::size_t size = shaded() ? 1 : sizeof(float);
    bytes.resize(kRunTile * kRunTile * size);
    const std::int64_t columns = std::min<std::int64_t>(kRunTile, grid_.columns - column);
    const std::int64_t rows = std::min<std::int64_t>(kRunTile, grid_.rows - row);
    const double middle = static_cast<double>(column) + 0.5 * static_cast<double>(columns - 1);
    for (std::int64_t j = 0; j < kRunTile; ++j) {
      RasterShader::Scale scale;
      if (request_.value != RasterValue::height && j < rows) {
        scale = shader_.scale(middle, static_cast<double>(row + j));
      }
      for (std::int64_t i = 0; i < kRunTile; ++i) {
        double value = NAN;
        if (i < columns && j < rows) {
          const double* z = heights_.data() +
                            static_cast<std::size_t>(row - first_row_ + j) * width_ +
                            static_cast<std::size_t>(column - first_column_ + i);
          value = request_.value == RasterValue::height
                      ? *z
                      : shader_(z, static_cast<std::ptrdiff_t>(width_), scale);
        }
        if (std::isnan(value)) {
          value = nodata_;
        } else {
          ++counts_[number];
        }
        std::byte* at = bytes.data() + static_cast<std::size_t>(j * kRunTile + i) * size;
        if (shaded()) {
          *at = static_cast<std::byte>(static_cast<std::uint8_t>(value + 0.5));
        } else {
          const auto number32 = static_cast<float>(value);
          std::memcpy(at, &number32, sizeof number32);
        }
      }
    }
  }

  const RasterRequest& request_;
  const Context& context_;
  /// Whether cells may be outside the region. A box is enlarged to whole cells instead, unless the
  /// grid is given.
  bool clips_ = request_.region && !(request_.region->polygons().empty() && request_.align.empty());
  RasterGrid grid_;
  stream::Crs crs_;
  GroundSlope ground_;
  std::unique_ptr<HeightSampler> sampler_;
  RasterShader shader_;
  double nodata_;
  RasterOutcome outcome_;

  // The tiles in progress.
  std::int64_t first_column_ = 0, first_row_ = 0;  ///< first column and row of heights_
  std::size_t width_ = 0;
  std::vector<Point2> places_;
  std::vector<SurfacePoint> surface_;
  std::vector<double> heights_;
  std::vector<std::vector<std::byte>> tiles_;
  std::vector<std::uint64_t> counts_;
};

}  // namespace

RasterOutcome write_raster(const stream::Store& store, const RasterRequest& request,
                           const Context& context) {
  need_terrain(store, "a raster");
  const stream::Store source = store.with_stop(context.stop);
  const ProgressReport report(context, "cells");
  if (request.sampler.max_error && request.value == RasterValue::height) {
    say_unknown_height_unit(Ground(store.schema()), context);
  }
  RasterRequest aligned = request;
  const RasterGrid grid =
      request.align.empty() ? raster_grid(source, request) : aligned_grid(source, aligned, context);
  std::string height_unit = store.schema().coordinates[2].unit;
  if (request.to && height_unit.empty()) {
    // A unit that follows from the store's own x and y does not follow from those of the raster.
    // Readers take metres for granted unless x and y are in another unit of length.
    const std::string unit = Ground(store.schema()).height_unit();
    const stream::Crs other = request.to->to().crs();
    const bool assumed = other.geographic || metres_in_unit(other.horizontal_unit) == 1.0;
    if (unit != "metre" || !assumed) height_unit = unit;
  }
  return RasterRun(source, aligned, grid, context).run(height_unit, report);
}

}  // namespace terrace::terrain
