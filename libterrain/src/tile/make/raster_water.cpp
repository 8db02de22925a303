// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "earth/polynomial_patch.hpp"
#include "tile/make/raster_surface.hpp"

namespace terrace::terrain {
namespace {

/// Largest error of an interpolated place, in samples, at the places where it is checked.
constexpr double kTolerance = 0.005;
/// Limits on the size of a part of a mask, in cells. Smaller parts are converted cell by cell.
/// Larger parts are divided unless they are uniform.
constexpr std::size_t kSmallestHeight = 8, kLargestHeight = 64;
/// The most samples to read at once, unless a single cell needs more.
constexpr std::size_t kMaxWaterSamples = 65536;

using WaterPatch = PolynomialPatch<2, 2>;

/// Fills a mask of cells in rows and columns, part by part. View: reads a window of heights.
template <class View>
class WaterMask {
 public:
  WaterMask(const TiledRaster& raster, const View& view, std::span<const double> longitude,
            std::span<const double> latitude, std::size_t columns, std::span<std::uint8_t> out)
      : raster_(raster),
        view_(view),
        longitude_(longitude),
        latitude_(latitude),
        columns_(columns),
        out_(out) {}

  void fill(const LatticePart& whole) {
    divide(whole, [this](const LatticePart& part) { return is_filled(part); });
  }
  /// Fills the part cell by cell.
  void fill_exactly(const LatticePart& part);

 private:
  /// Fills the part if it is small, uniform or smooth; returns false otherwise.
  bool is_filled(const LatticePart& part);
  /// Whether all cells with places between these are equal; if so, sets them.
  bool is_uniform(const LatticePart& part, std::span<const Point2> nodes);
  /// Rounds the places of a part to the nearest samples, row by row, and reads those.
  void look(const LatticePart& part, std::span<Point2> places);
  void read(const LatticePart& part, std::span<const Point2> places, std::size_t stride);
  void set(const LatticePart& part, bool wet) {
    for (std::size_t row = part.row; row < part.row + part.rows; ++row) {
      std::fill_n(out_.begin() + static_cast<std::ptrdiff_t>(row * columns_ + part.column),
                  part.columns, wet ? std::uint8_t{1} : std::uint8_t{0});
    }
  }

  const TiledRaster& raster_;
  const View& view_;
  std::span<const double> longitude_, latitude_;
  std::size_t columns_;
  std::span<std::uint8_t> out_;
};

template <class View>
bool WaterMask<View>::is_uniform(const LatticePart& part, std::span<const Point2> nodes) {
  Point2 low = nodes[0], high = nodes[0];
  for (const Point2& p : nodes) {
    low = {std::min(low[0], p[0]), std::min(low[1], p[1])};
    high = {std::max(high[0], p[0]), std::max(high[1], p[1])};
  }
  const stream::StoreSchema& schema = raster_.store.schema();
  const auto from = [](double at, double margin) {
    return static_cast<std::int64_t>(std::floor(std::clamp(at - margin, -2.0, 1e12)));
  };
  const auto to = [](double at, double margin, std::uint64_t count) {
    const double last = static_cast<double>(count) + 1.0;
    return static_cast<std::int64_t>(std::ceil(std::clamp(at + margin, -2.0, last)));
  };
  // Add a sample, and the possible bulge between the places.
  const double across = 1.0 + (high[0] - low[0]) / 8.0, down = 1.0 + (high[1] - low[1]) / 8.0;
  const std::int64_t left = from(low[0], across), top = from(low[1], down);
  const std::int64_t right = to(high[0], across, schema.columns);
  const std::int64_t bottom = to(high[1], down, schema.rows);
  const LatticeWindow window{left, top, right - left + 1, bottom - top + 1};
  const bool empty = window.columns <= 0 || window.rows <= 0;
  const auto range = empty ? std::nullopt : raster_.blocks.range(window);
  if (raster_.water_height) {
    const double height = *raster_.water_height;
    if (range && height >= range->low && height <= range->high) return false;
    set(part, false);
    return true;
  }
  if (!range) {
    set(part, true);
    return true;
  }
  const bool inside = left >= 0 && top >= 0 && right < static_cast<std::int64_t>(schema.columns) &&
                      bottom < static_cast<std::int64_t>(schema.rows);
  if (!inside || !raster_.blocks.is_complete(window)) return false;
  set(part, false);
  return true;
}

template <class View>
void WaterMask<View>::read(const LatticePart& part, std::span<const Point2> places,
                           std::size_t stride) {
  LatticeWindow window;
  std::int64_t right = 0, bottom = 0;
  for (std::size_t j = 0; j < part.rows; ++j) {
    for (std::size_t i = 0; i < part.columns; ++i) {
      const Point2& p = places[j * stride + i];
      const auto column = static_cast<std::int64_t>(p[0]), row = static_cast<std::int64_t>(p[1]);
      const bool first = i == 0 && j == 0;
      window.column = first ? column : std::min(window.column, column);
      window.row = first ? row : std::min(window.row, row);
      right = first ? column : std::max(right, column);
      bottom = first ? row : std::max(bottom, row);
    }
  }
  window.columns = right - window.column + 1;
  window.rows = bottom - window.row + 1;
  if (window.size() > kMaxWaterSamples && (part.columns > 1 || part.rows > 1)) {
    if (part.rows > 1) {
      const std::size_t upper = part.rows / 2;
      read({part.column, part.row, part.columns, upper}, places, stride);
      read({part.column, part.row + upper, part.columns, part.rows - upper},
           places.subspan(upper * stride), stride);
    } else {
      const std::size_t left = part.columns / 2;
      read({part.column, part.row, left, 1}, places, stride);
      read({part.column + left, part.row, part.columns - left, 1}, places.subspan(left), stride);
    }
    return;
  }
  const auto view = view_(window);
  for (std::size_t j = 0; j < part.rows; ++j) {
    for (std::size_t i = 0; i < part.columns; ++i) {
      const Point2& p = places[j * stride + i];
      const double height =
          view.first[(static_cast<std::int64_t>(p[1]) - window.row) * view.stride +
                     static_cast<std::int64_t>(p[0]) - window.column];
      const bool wet = raster_.water_height ? height == *raster_.water_height : std::isnan(height);
      out_[(part.row + j) * columns_ + part.column + i] = wet ? 1 : 0;
    }
  }
}

template <class View>
void WaterMask<View>::look(const LatticePart& part, std::span<Point2> places) {
  const stream::StoreSchema& schema = raster_.store.schema();
  const double right = static_cast<double>(schema.columns);
  const double bottom = static_cast<double>(schema.rows);
  for (Point2& p : places) {
    // Far places are moved to just outside the raster's border, where there is no data.
    p = {std::clamp(std::floor(p[0] + 0.5), -1.0, right),
         std::clamp(std::floor(p[1] + 0.5), -1.0, bottom)};
  }
  read(part, places, part.columns);
}

template <class View>
void WaterMask<View>::fill_exactly(const LatticePart& part) {
  std::vector<Point2> places;
  places.reserve(part.columns * part.rows);
  for (std::size_t row = part.row; row < part.row + part.rows; ++row) {
    for (std::size_t column = part.column; column < part.column + part.columns; ++column) {
      places.push_back({longitude_[row * columns_ + column], latitude_[row * columns_ + column]});
    }
  }
  raster_.places.to_stored(places);
  look(part, places);
}

template <class View>
bool WaterMask<View>::is_filled(const LatticePart& part) {
  if (part.columns < kSmallestHeight || part.rows < kSmallestHeight) {
    fill_exactly(part);
    return true;
  }
  const std::size_t corner = part.row * columns_ + part.column;
  const std::size_t last = corner + (part.rows - 1) * columns_ + part.columns - 1;
  const double west = longitude_[corner], north = latitude_[corner];
  auto places =
      WaterPatch::places({west, north}, {longitude_[last] - west, latitude_[last] - north});
  raster_.places.to_stored(places);
  const std::optional<WaterPatch> patch = WaterPatch::through(places, kTolerance);
  if (!patch) return false;
  if (is_uniform(part, std::span(places).first(9))) return true;
  if (part.columns > kLargestHeight || part.rows > kLargestHeight) return false;
  std::vector<Point2> between(part.columns * part.rows);
  for (std::size_t j = 0; j < part.rows; ++j) {
    const double t = static_cast<double>(j) / static_cast<double>(part.rows - 1);
    const WaterPatch::Row row = patch->row(t);
    for (std::size_t i = 0; i < part.columns; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(part.columns - 1);
      between[j * part.columns + i] = {row(0, s), row(1, s)};
    }
  }
  look(part, between);
  return true;
}

/// Whether every `step`-th number is equally spaced.
bool even(std::span<const double> places, std::size_t step) {
  const std::size_t last = (places.size() - 1) / step;
  const double each = (places[last * step] - places[0]) / static_cast<double>(last);
  for (std::size_t i = 0; i <= last; ++i) {
    const double off = places[i * step] - places[0] - each * static_cast<double>(i);
    if (std::abs(off) > 1e-6 * std::abs(each)) return false;
  }
  return true;
}

/// Returns the number of places in the first row of a regular grid; 0 if the grid is not regular.
std::size_t columns_of(std::span<const double> longitude, std::span<const double> latitude) {
  std::size_t columns = 0;
  while (columns < latitude.size() && latitude[columns] == latitude[0]) ++columns;
  if (columns < 2 || latitude.size() < 2 * columns || latitude.size() % columns != 0) return 0;
  for (std::size_t i = columns; i < latitude.size(); ++i) {
    if (longitude[i] != longitude[i - columns] || latitude[i] != latitude[i / columns * columns]) {
      return 0;
    }
  }
  return even(longitude.first(columns), 1) && even(latitude, columns) ? columns : 0;
}

}  // namespace

void RasterTileSurface::water(std::span<const double> longitude, std::span<const double> latitude,
                              std::span<std::uint8_t> out) {
  if (out.empty()) return;
  const auto view = [this](const LatticeWindow& window) { return this->view(window); };
  const std::size_t columns = columns_of(longitude, latitude);
  const std::size_t width = columns > 0 ? columns : out.size();
  WaterMask mask(raster_, view, longitude, latitude, width, out);
  if (columns > 0) {
    mask.fill({0, 0, width, out.size() / width});
  } else {
    mask.fill_exactly({0, 0, width, 1});
  }
}

}  // namespace terrace::terrain
