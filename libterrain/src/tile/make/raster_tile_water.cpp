// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tile/make/raster_tile_surface.hpp"

namespace terrace::terrain {
namespace {

/// Largest error of an interpolated place, in samples, at the places where it is checked.
constexpr double kTolerance = 0.005;
/// Sizes of a part of a mask, in cells: smaller parts are converted cell by cell, larger ones are
/// divided unless they are uniform.
constexpr std::size_t kSmallestHeight = 8, kLargestHeight = 64;
/// The most samples to read at once, unless a single cell needs more.
constexpr std::size_t kMostWaterSamples = 65536;

/// Parameters at which a quadratic through values at 0, 1/2 and 1 is farthest from a cubic.
constexpr double kWorst = 0.2113248654051871;

/// A rectangle of cells.
struct WaterPart {
  std::size_t column, row, columns, rows;
};

/// The polynomial of second degree in both directions through 3 x 3 values. Row k of the
/// coefficients contains those of t^k, in powers of s along the row.
struct QuadraticPatch {
  std::array<std::array<double, 3>, 3> coefficients{};

  /// values: at 0, 1/2 and 1 along each axis, row by row.
  explicit QuadraticPatch(const std::array<double, 9>& values) {
    const auto through = [](double a, double b, double c) {
      return std::array{a, 4.0 * b - 3.0 * a - c, 2.0 * (a - 2.0 * b + c)};
    };
    std::array<std::array<double, 3>, 3> along{};
    for (std::size_t j = 0; j < 3; ++j) {
      along[j] = through(values[3 * j], values[3 * j + 1], values[3 * j + 2]);
    }
    for (std::size_t m = 0; m < 3; ++m) {
      const auto down = through(along[0][m], along[1][m], along[2][m]);
      for (std::size_t k = 0; k < 3; ++k) coefficients[k][m] = down[k];
    }
  }
  /// The coefficients along the row at t.
  [[nodiscard]] std::array<double, 3> at_row(double t) const {
    std::array<double, 3> row{};
    for (std::size_t m = 0; m < 3; ++m) {
      row[m] = (coefficients[2][m] * t + coefficients[1][m]) * t + coefficients[0][m];
    }
    return row;
  }
  static double value(const std::array<double, 3>& row, double s) {
    return (row[2] * s + row[1]) * s + row[0];
  }
  [[nodiscard]] double value(double s, double t) const { return value(at_row(t), s); }
};

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

  void fill(const WaterPart& part);
  /// Fills the part cell by cell.
  void fill_exactly(const WaterPart& part);

 private:
  /// Whether all cells with places between these are equal; if so, sets them.
  bool is_uniform(const WaterPart& part, std::span<const Point2> nodes);
  /// Rounds the places of a part to the nearest samples, row by row, and reads those.
  void look(const WaterPart& part, std::span<Point2> places);
  void read(const WaterPart& part, std::span<const Point2> places, std::size_t stride);
  void set(const WaterPart& part, bool wet) {
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
bool WaterMask<View>::is_uniform(const WaterPart& part, std::span<const Point2> nodes) {
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
void WaterMask<View>::read(const WaterPart& part, std::span<const Point2> places,
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
  if (window.size() > kMostWaterSamples && (part.columns > 1 || part.rows > 1)) {
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
void WaterMask<View>::look(const WaterPart& part, std::span<Point2> places) {
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
void WaterMask<View>::fill_exactly(const WaterPart& part) {
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
void WaterMask<View>::fill(const WaterPart& part) {
  if (part.columns < kSmallestHeight || part.rows < kSmallestHeight) return fill_exactly(part);
  const std::size_t corner = part.row * columns_ + part.column;
  const std::size_t last = corner + (part.rows - 1) * columns_ + part.columns - 1;
  const double west = longitude_[corner], width = longitude_[last] - west;
  const double north = latitude_[corner], height = latitude_[last] - north;
  std::array<Point2, 13> places;
  for (std::size_t k = 0; k < 9; ++k) {
    places[k] = {west + 0.5 * static_cast<double>(k % 3) * width,
                 north + 0.5 * static_cast<double>(k / 3) * height};
  }
  const auto worst = [](bool far) { return far ? 1.0 - kWorst : kWorst; };
  for (std::size_t k = 0; k < 4; ++k) {
    places[9 + k] = {west + worst((k & 1) != 0) * width, north + worst((k & 2) != 0) * height};
  }
  raster_.places.to_stored(places);
  std::array<double, 9> x{}, y{};
  for (std::size_t k = 0; k < 9; ++k) {
    x[k] = places[k][0];
    y[k] = places[k][1];
  }
  const QuadraticPatch column(x), row(y);
  bool good = true;
  for (std::size_t k = 0; k < 4; ++k) {
    const double s = worst((k & 1) != 0), t = worst((k & 2) != 0);
    // `!(x <= y)` also rejects NaN.
    good = good && std::abs(column.value(s, t) - places[9 + k][0]) <= kTolerance &&
           std::abs(row.value(s, t) - places[9 + k][1]) <= kTolerance;
  }
  if (good && is_uniform(part, std::span(places).first(9))) return;
  if (!good || part.columns > kLargestHeight || part.rows > kLargestHeight) {
    const std::size_t left = part.columns / 2, upper = part.rows / 2;
    fill({part.column, part.row, left, upper});
    fill({part.column + left, part.row, part.columns - left, upper});
    fill({part.column, part.row + upper, left, part.rows - upper});
    fill({part.column + left, part.row + upper, part.columns - left, part.rows - upper});
    return;
  }
  std::vector<Point2> between(part.columns * part.rows);
  for (std::size_t j = 0; j < part.rows; ++j) {
    const double t = static_cast<double>(j) / static_cast<double>(part.rows - 1);
    const std::array<double, 3> a = column.at_row(t), b = row.at_row(t);
    for (std::size_t i = 0; i < part.columns; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(part.columns - 1);
      between[j * part.columns + i] = {QuadraticPatch::value(a, s), QuadraticPatch::value(b, s)};
    }
  }
  look(part, between);
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

/// Returns the number of places in the first row of a regular grid; 0 if it is not one.
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
