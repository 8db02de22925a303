// SPDX-License-Identifier: GPL-3.0-or-later
#include "raster_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <terrace/stream/geotiff_writer.hpp>

#include "crs_options.hpp"
#include "error.hpp"
#include "ground_slope.hpp"
#include "parallel.hpp"
#include "raster_grid.hpp"
#include "raster_shader.hpp"

namespace terrace::tools {
namespace {

constexpr std::int64_t kTile = 256;
/// Peak bytes per cell of the tiles at work: places twice, sorting, surface, heights.
constexpr std::uint64_t kBytesPerCell = 130;

class RasterRun {
 public:
  RasterRun(const stream::Store& store, const RasterRequest& request)
      : request_(request),
        grid_(raster_grid(store, request)),
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
      RasterShader::Scale scale;
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
  RasterGrid grid_;
  stream::Crs crs_;
  GroundSlope ground_;
  std::unique_ptr<HeightSampler> sampler_;
  RasterShader shader_;
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
