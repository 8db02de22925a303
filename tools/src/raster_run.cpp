// SPDX-License-Identifier: GPL-3.0-or-later
#include "raster_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/geotiff_writer.hpp>

#include "crs_options.hpp"
#include "error.hpp"
#include "ground_slope.hpp"
#include "parallel.hpp"
#include "units.hpp"
#include "world.hpp"

namespace terrace::tools {
namespace {

constexpr std::int64_t kTile = 256;
/// Peak bytes per cell of the tiles at work: places twice, sorting, surface, heights.
constexpr std::uint64_t kBytesPerCell = 130;
constexpr double kMostCells = 2147483647.0;

/// Cells of the output: the centre of (0, 0), and steps per column and row.
struct Grid {
  double x = 0, y = 0, step_x = 1, step_y = -1;
  std::uint32_t columns = 0, rows = 0;
};

[[noreturn]] void outside(const stream::Store& store) {
  throw stream::Error({.file = store.path().string(),
                       .where = {},
                       .cause = "the region does not meet the store",
                       .remedy = "`terrace info` tells its bounds; --region-crs says in which CRS "
                                 "the region is"});
}

/// The store's area in its CRS: of a raster with half a cell around the samples.
stream::Box3 area_of(const stream::Store& store) {
  stream::Box3 stored = store.bounds();
  if (store.schema().grid) {
    const auto last = [](std::uint64_t n) { return static_cast<double>(n) - 0.5; };
    stored.min = {-0.5, -0.5, 0};
    stored.max = {last(store.schema().columns), last(store.schema().rows), 0};
  }
  stored.min[2] = stored.max[2] = 0;
  return world_box(placement_of(store.schema()), stored);
}

/// The box of the output's CRS around one of the store's CRS.
stream::Box3 converted(const stream::Box3& box, const CoordinateSystem& from,
                       const CoordinateSystem& to, const stream::Store& store) {
  // The outline bends: so many points on each side.
  constexpr int kPoints = 256;
  std::vector<Point2> outline;
  for (int i = 0; i <= kPoints; ++i) {
    const double t = static_cast<double>(i) / kPoints;
    const double x = box.min[0] + t * (box.max[0] - box.min[0]);
    const double y = box.min[1] + t * (box.max[1] - box.min[1]);
    for (const Point2 p : {Point2{x, box.min[1]}, Point2{x, box.max[1]}, Point2{box.min[0], y},
                           Point2{box.max[0], y}}) {
      outline.push_back(p);
    }
  }
  transform(from, to, outline);
  stream::Box3 result;
  for (const Point2& p : outline) {
    if (std::isfinite(p[0]) && std::isfinite(p[1])) result.include(stream::Point3{p[0], p[1], 0});
  }
  if (result.empty()) {
    throw stream::Error({.file = store.path().string(),
                         .where = {},
                         .cause = "the region has no place in " + to.title(),
                         .remedy = "take another --to-crs or a smaller --region"});
  }
  return result;
}

/// The distance between neighbouring points in units of the store's CRS.
double spacing_of(const stream::Store& store, const stream::Box3& area) {
  const std::array<double, 6>& m = store.schema().world.xy;
  if (store.schema().grid) return std::sqrt(std::abs(m[0] * m[4] - m[1] * m[3]));
  const double size = (area.max[0] - area.min[0]) * (area.max[1] - area.min[1]);
  return std::sqrt(size / static_cast<double>(std::max<std::uint64_t>(store.points(), 1)));
}

std::uint32_t count_of(double cells) {
  if (!(cells <= kMostCells)) {
    throw UsageError("--cell is too small: a side of the raster would have " +
                     number_text(std::ceil(cells)) + " cells");
  }
  return static_cast<std::uint32_t>(std::max(1.0, cells));
}

Grid grid_of(const stream::Store& store, const RasterRequest& request) {
  const stream::Box3 area = area_of(store);
  stream::Box3 box = area;
  if (request.region) {
    const stream::Box3& wanted = request.region->box();
    for (std::size_t axis = 0; axis < 2; ++axis) {
      box.min[axis] = std::max(box.min[axis], wanted.min[axis]);
      box.max[axis] = std::min(box.max[axis], wanted.max[axis]);
    }
  }
  if (store.points() == 0 || !(box.min[0] <= box.max[0] && box.min[1] <= box.max[1])) {
    outside(store);
  }
  const std::array<double, 6>& m = store.schema().world.xy;
  const bool straight = m[1] == 0 && m[3] == 0;
  Grid grid;
  if (!request.cell && !request.to && store.schema().grid && straight) {
    // The lattice itself: the samples within the box.
    std::array<double, 2> first{}, last{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double step = m[4 * axis], origin = axis == 0 ? m[2] : m[5];
      const double size =
          static_cast<double>(axis == 0 ? store.schema().columns : store.schema().rows);
      double a = (box.min[axis] - origin) / step, b = (box.max[axis] - origin) / step;
      if (a > b) std::swap(a, b);
      first[axis] = std::max(0.0, std::ceil(a - 1e-6));
      last[axis] = std::min(size - 1, std::floor(b + 1e-6));
      if (first[axis] > last[axis]) outside(store);
    }
    grid.step_x = m[0];
    grid.step_y = m[4];
    grid.x = m[2] + m[0] * first[0];
    grid.y = m[5] + m[4] * first[1];
    grid.columns = count_of(last[0] - first[0] + 1);
    grid.rows = count_of(last[1] - first[1] + 1);
    return grid;
  }
  double cell = request.cell.value_or(spacing_of(store, area));
  if (request.to) {
    const CoordinateSystem from = system_of(store);
    const Point2 centre{0.5 * (box.min[0] + box.max[0]), 0.5 * (box.min[1] + box.max[1])};
    std::vector<Point2> steps{centre, {centre[0] + cell, centre[1]}, {centre[0], centre[1] + cell}};
    box = converted(box, from, *request.to, store);
    if (!request.cell) {
      transform(from, *request.to, steps);
      const auto length = [&](std::size_t i) {
        return std::hypot(steps[i][0] - steps[0][0], steps[i][1] - steps[0][1]);
      };
      cell = std::sqrt(length(1) * length(2));
    }
  }
  if (!(cell > 0) || !std::isfinite(cell)) {
    throw UsageError("the points do not tell a cell size: give --cell");
  }
  grid.step_x = cell;
  grid.step_y = -cell;
  grid.x = box.min[0] + 0.5 * cell;
  grid.y = box.max[1] - 0.5 * cell;
  grid.columns = count_of(std::ceil((box.max[0] - box.min[0]) / cell - 1e-6));
  grid.rows = count_of(std::ceil((box.max[1] - box.min[1]) / cell - 1e-6));
  return grid;
}

/// What is made of the heights around a cell.
class Shader {
 public:
  Shader(const Grid& grid, const stream::Schema& schema, const stream::Crs& crs, RasterValue value)
      : value_(value), ground_(placement(grid, schema, crs)) {}

  /// Metres per cell going east and north, and per unit of height, at a cell.
  struct Scale {
    double east = 1, north = 1, up = 1;
  };
  [[nodiscard]] Scale scale(double column, double row) const {
    const stream::Point3 here{column, row, 0};
    const GroundMap map = ground_.map({here, here});
    return {map[0], -map[4], map[8]};
  }

  /// z: 3 x 3 heights by rows, a row of the lattice being `stride` apart; at the middle one.
  [[nodiscard]] double operator()(const double* z, std::ptrdiff_t stride, const Scale& s) const {
    const double *n = z - stride, *p = z + stride;
    const double gx =
        s.up * ((n[1] + 2 * z[1] + p[1]) - (n[-1] + 2 * z[-1] + p[-1])) / (8 * s.east);
    const double gy =
        s.up * ((n[-1] + 2 * n[0] + n[1]) - (p[-1] + 2 * p[0] + p[1])) / (8 * s.north);
    if (!(gx == gx && gy == gy && z[0] == z[0])) return NAN;
    if (value_ == RasterValue::slope) return tri::slope_degrees({gx, gy});
    if (value_ == RasterValue::aspect) return tri::aspect_degrees({gx, gy});
    // Towards the light: half north-west, as high as far.
    const double light =
        (0.5 * gx - 0.5 * gy + std::numbers::sqrt2 / 2) / std::sqrt(1 + gx * gx + gy * gy);
    return light <= 0 ? 1 : 1 + 254 * light;
  }

  [[nodiscard]] const std::string& assumption() const { return ground_.assumption(); }

 private:
  static Placement placement(const Grid& grid, const stream::Schema& schema,
                             const stream::Crs& crs) {
    Placement placement = placement_of(schema);
    placement.world.xy = {grid.step_x, 0, grid.x, 0, grid.step_y, grid.y};
    // Heights are scaled already.
    placement.coordinates[2].scale = 1;
    placement.coordinates[2].offset = 0;
    placement.crs = crs;
    // Heights keep their unit where x and y get another.
    if (placement.crs.vertical_unit.empty()) placement.crs.vertical_unit = schema.crs.vertical_unit;
    return placement;
  }

  RasterValue value_;
  Ground ground_;
};

class RasterRun {
 public:
  RasterRun(const stream::Store& store, const RasterRequest& request)
      : request_(request),
        grid_(grid_of(store, request)),
        crs_(request.to ? request.to->crs() : store.schema().crs),
        ground_(store),
        sampler_(make_sampler(store, request.sampler)),
        shader_(grid_, store.schema(), crs_, request.value),
        nodata_(nodata(store, request.value)) {
    if (request.to) from_ = system_of(store);
  }

  RasterOutcome run(const stream::Channel& heights,
                    const std::function<void(std::uint64_t, double)>& progress) {
    stream::GeoTiffOptions options;
    options.columns = grid_.columns;
    options.rows = grid_.rows;
    options.sample.type = shaded() ? stream::ScalarType::u8 : stream::ScalarType::f32;
    if (request_.value == RasterValue::height) options.sample.unit = heights.unit;
    options.world.xy = {grid_.step_x, 0, grid_.x, 0, grid_.step_y, grid_.y};
    options.crs = crs_;
    options.nodata = nodata_;
    options.tile = kTile;
    options.replace = request_.replace;
    stream::GeoTiffWriter writer(request_.output, options);
    const std::int64_t across = (grid_.columns + kTile - 1) / kTile;
    const std::int64_t down = (grid_.rows + kTile - 1) / kTile;
    const auto at_once = static_cast<std::int64_t>(std::clamp<std::uint64_t>(
        request_.sampler.memory_bytes / 2 / (kTile * kTile * kBytesPerCell), 1, 32));
    for (std::int64_t row = 0; row < down; ++row) {
      for (std::int64_t first = 0; first < across; first += at_once) {
        const std::int64_t count = std::min(at_once, across - first);
        sample(first * kTile, row * kTile, count * kTile);
        tiles_.resize(static_cast<std::size_t>(count));
        counts_.assign(tiles_.size(), 0);
        parallel_for(tiles_.size(), request_.sampler.threads, [&](unsigned, std::size_t i) {
          make_tile(i, (first + static_cast<std::int64_t>(i)) * kTile, row * kTile);
        });
        for (std::size_t i = 0; i < tiles_.size(); ++i) {
          if (counts_[i] == 0) continue;
          outcome_.cells_with_data += counts_[i];
          writer.write_tile(static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(i),
                            static_cast<std::uint32_t>(row), tiles_[i]);
        }
        const double share = (static_cast<double>(row) +
                              static_cast<double>(first + count) / static_cast<double>(across)) /
                             static_cast<double>(down);
        if (progress) progress(outcome_.cells_with_data, share);
      }
    }
    writer.commit();
    outcome_.columns = grid_.columns;
    outcome_.rows = grid_.rows;
    if (request_.value != RasterValue::height) outcome_.assumption = shader_.assumption();
    return outcome_;
  }

 private:
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

  /// The surface at the cells of a row of tiles and one cell around, by rows in heights_.
  void sample(std::int64_t column, std::int64_t row, std::int64_t columns) {
    width_ = static_cast<std::size_t>(std::min<std::int64_t>(columns, grid_.columns - column)) + 2;
    const std::size_t height =
        static_cast<std::size_t>(std::min<std::int64_t>(kTile, grid_.rows - row)) + 2;
    places_.resize(width_ * height);
    surface_.resize(places_.size());
    heights_.resize(places_.size());
    parallel_for(height, request_.sampler.threads, [&](unsigned, std::size_t j) {
      const std::span<Point2> line(places_.data() + j * width_, width_);
      const double y =
          grid_.y + grid_.step_y * static_cast<double>(row + static_cast<std::int64_t>(j) - 1);
      for (std::size_t i = 0; i < width_; ++i) {
        line[i] = {
            grid_.x + grid_.step_x * static_cast<double>(column + static_cast<std::int64_t>(i) - 1),
            y};
      }
      if (from_) transform(*request_.to, *from_, line);
      for (Point2& p : line) {
        const bool wanted = !request_.region || request_.region->polygons().empty() ||
                            request_.region->contains({p[0], p[1], 0});
        p = wanted ? ground_.stored(p) : Point2{NAN, NAN};
      }
    });
    sampler_->sample(places_, surface_);
    for (std::size_t i = 0; i < surface_.size(); ++i) heights_[i] = surface_[i].height;
    first_column_ = column;
  }

  void make_tile(std::size_t number, std::int64_t column, std::int64_t row) {
    std::vector<std::byte>& bytes = tiles_[number];
    const std::size_t size = shaded() ? 1 : sizeof(float);
    bytes.resize(kTile * kTile * size);
    const std::int64_t columns = std::min<std::int64_t>(kTile, grid_.columns - column);
    const std::int64_t rows = std::min<std::int64_t>(kTile, grid_.rows - row);
    const double middle = static_cast<double>(column) + 0.5 * static_cast<double>(columns - 1);
    for (std::int64_t j = 0; j < kTile; ++j) {
      Shader::Scale scale;
      if (request_.value != RasterValue::height && j < rows) {
        scale = shader_.scale(middle, static_cast<double>(row + j));
      }
      for (std::int64_t i = 0; i < kTile; ++i) {
        double value = NAN;
        if (i < columns && j < rows) {
          const double* z = heights_.data() + static_cast<std::size_t>(j + 1) * width_ +
                            static_cast<std::size_t>(column - first_column_ + i + 1);
          value = request_.value == RasterValue::height
                      ? *z
                      : shader_(z, static_cast<std::ptrdiff_t>(width_), scale);
        }
        if (std::isnan(value)) {
          value = nodata_;
        } else {
          ++counts_[number];
        }
        std::byte* at = bytes.data() + static_cast<std::size_t>(j * kTile + i) * size;
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
  Grid grid_;
  stream::Crs crs_;
  GroundSlope ground_;
  std::unique_ptr<HeightSampler> sampler_;
  Shader shader_;
  double nodata_;
  std::optional<CoordinateSystem> from_;
  RasterOutcome outcome_;

  // The tiles at work.
  std::int64_t first_column_ = 0;
  std::size_t width_ = 0;
  std::vector<Point2> places_;
  std::vector<SurfacePoint> surface_;
  std::vector<double> heights_;
  std::vector<std::vector<std::byte>> tiles_;
  std::vector<std::uint64_t> counts_;
};

}  // namespace

RasterValue parse_raster_value(const std::string& text) {
  if (text == "height") return RasterValue::height;
  if (text == "slope") return RasterValue::slope;
  if (text == "aspect") return RasterValue::aspect;
  if (text == "hillshade") return RasterValue::hillshade;
  throw UsageError("'" + text + "' is no --value; write height, slope, aspect or hillshade");
}

RasterOutcome write_raster(const stream::Store& store, const RasterRequest& request,
                           const std::function<void(std::uint64_t, double)>& progress) {
  return RasterRun(store, request).run(store.schema().coordinates[2], progress);
}

}  // namespace terrace::tools
