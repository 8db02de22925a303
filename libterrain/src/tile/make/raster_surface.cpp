// SPDX-License-Identifier: Apache-2.0
#include "tile/make/raster_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace terrace::terrain {
namespace {

/// Memory for decoded clusters of a surface.
constexpr std::uint64_t kDecodedBytes = std::uint64_t{8} << 20;

/// The places along one axis of a window that are in a range.
struct Part {
  std::size_t first = 0, count = 0;
  bool descending = false;
};

/// Returns nullopt if they are not consecutive and monotone.
std::optional<Part> part_between(std::span<const double> places, double low, double high) {
  Part part;
  while (part.first < places.size() && !(places[part.first] >= low && places[part.first] <= high)) {
    ++part.first;
  }
  const std::span<const double> following = places.subspan(part.first);
  while (part.count < following.size() && following[part.count] >= low &&
         following[part.count] <= high) {
    ++part.count;
  }
  if (std::any_of(following.begin() + static_cast<std::ptrdiff_t>(part.count), following.end(),
                  [&](double place) { return place >= low && place <= high; })) {
    return std::nullopt;
  }
  if (part.count < 2) return part;
  part.descending = following[1] < following[0];
  for (std::size_t i = 1; i < part.count; ++i) {
    if (!(part.descending ? following[i] < following[i - 1] : following[i] > following[i - 1]))
      return std::nullopt;
  }
  return part;
}

/// Copies the part's places in ascending order.
void take(std::span<const double> places, const Part& part, std::vector<double>& out) {
  const std::span<const double> selected = places.subspan(part.first, part.count);
  out.assign(selected.begin(), selected.end());
  if (part.descending) std::reverse(out.begin(), out.end());
}

}  // namespace

RasterTileSurface::RasterTileSurface(const TiledRaster& raster)
    : raster_(raster), reader_(raster.store, kDecodedBytes) {}

RasterTileSurface::View RasterTileSurface::view(const LatticeWindow& window) {
  const std::int64_t column = window.column - loaded_.column, row = window.row - loaded_.row;
  const bool holds = column >= 0 && row >= 0 && column + window.columns <= loaded_.columns &&
                     row + window.rows <= loaded_.rows;
  if (holds) return {heights_.data() + row * loaded_.columns + column, loaded_.columns};
  loaded_ = {};  // so that nothing is held if reading fails
  heights_.resize(window.size());
  raster_.height_cache.heights(reader_, window, heights_);
  loaded_ = window;
  return {heights_.data(), loaded_.columns};
}

const LatticeWindow& RasterTileSurface::window_around(const GeographicBox& box) {
  if (!around_ || around_->first != box) around_ = {box, raster_.window_around(box)};
  return around_->second;
}

void RasterTileSurface::expect(const GeographicBox& box) {
  LatticeWindow window = window_around(box);
  if (window.size() == 0) return;
  // Include the surroundings of places on the box's sides, also outside the raster.
  window = {window.column - 3, window.row - 3, window.columns + 6, window.rows + 6};
  view(window);
}

HeightRange RasterTileSurface::above_ellipsoid(const HeightBlocks::Range& range,
                                               bool filled) const {
  HeightRange out;
  const double low = range.low * raster_.vertical.metres_per_unit();
  const double high = range.high * raster_.vertical.metres_per_unit();
  out.low = std::min(low, high);
  out.high = std::max(low, high);
  if (filled) {
    out.low = std::min(out.low, raster_.height_beyond());
    out.high = std::max(out.high, raster_.height_beyond());
  }
  if (raster_.vertical.has_geoid()) {
    out.low += kLowestGeoid;
    out.high += kHighestGeoid;
  }
  return out;
}

std::optional<HeightRange> RasterTileSurface::range(const GeographicBox& box) {
  const LatticeWindow& window = window_around(box);
  if (window.size() == 0) return std::nullopt;
  const auto range = raster_.blocks.range(window);
  if (!range) return std::nullopt;
  HeightRange out = above_ellipsoid(*range, raster_.flat_fill.has_value());
  // A block of the lattice with all corners inside.
  if (const auto block = raster_.blocks.some_block_within(window)) {
    std::array<Point2, 4> corners;
    for (unsigned k = 0; k < 4; ++k) {
      corners[k] = {static_cast<double>(block->column + ((k & 1) != 0 ? block->columns - 1 : 0)),
                    static_cast<double>(block->row + ((k & 2) != 0 ? block->rows - 1 : 0))};
    }
    raster_.places.to_geographic(corners);
    const double margin = raster_.places.crs().is_geographic() ? 0.0 : raster_.spacing;
    out.certain = std::all_of(corners.begin(), corners.end(), [&](const Point2& p) {
      return p[0] >= box.west + margin && p[0] <= box.east - margin && p[1] >= box.south + margin &&
             p[1] <= box.north - margin;
    });
  }
  return out;
}

std::optional<HeightRange> RasterTileSurface::surface_range(const GeographicBox& box) {
  const GeographicBox all = bounds();
  if (box.west >= all.west && box.east <= all.east && box.south >= all.south &&
      box.north <= all.north) {
    const LatticeWindow window = raster_.window_around(box);
    const auto [last_column, last_row] = raster_.places.stored_bounds().max;
    const bool inside = window.column > 0 && window.row > 0 &&
                        static_cast<double>(window.column + window.columns) <= last_column &&
                        static_cast<double>(window.row + window.rows) <= last_row;
    if (inside && raster_.blocks.is_complete(window)) {
      if (const auto range = raster_.blocks.range(window)) return above_ellipsoid(*range, false);
    }
  }
  // Filled heights are between those of samples, but the samples may be anywhere.
  return above_ellipsoid(raster_.everywhere, true);
}

template <class Visit>
void RasterTileSurface::visit_places(std::span<const double> longitude,
                                     std::span<const double> latitude, const Visit& visit) {
  constexpr std::int64_t kBlock = 128;          // places are handled block by block of the lattice
  constexpr std::int64_t kMaxInWindow = 32768;  // limit of a window for a run of places,
  constexpr std::int64_t kMaxPerPlace = 64;     // and per place in the run
  std::vector<Point2> places(longitude.size());
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = {longitude[i], latitude[i]};
  raster_.places.to_stored(places);
  const auto [last_column, last_row] = raster_.places.stored_bounds().max;
  // Places outside are moved to one sample from the lattice, where it is filled, and those beyond
  // the rim of the outline to two samples.
  for (Point2& p : places) {
    const double outside = std::max({-p[0], -p[1], p[0] - last_column, p[1] - last_row});
    const double margin = outside > raster_.rim ? 2.0 : 1.0;
    p = {std::clamp(p[0], -margin, last_column + margin),
         std::clamp(p[1], -margin, last_row + margin)};
  }
  std::vector<std::uint32_t> order(places.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto block = [&](std::uint32_t i) {
    return std::pair{static_cast<std::int64_t>(std::floor(places[i][1])) / kBlock,
                     static_cast<std::int64_t>(std::floor(places[i][0])) / kBlock};
  };
  const auto before = [&](std::uint32_t a, std::uint32_t b) { return block(a) < block(b); };
  // Places on sides are already in order.
  if (!std::is_sorted(order.begin(), order.end(), before)) {
    std::stable_sort(order.begin(), order.end(), before);
  }

  for (std::size_t from = 0; from < order.size();) {
    std::int64_t c0 = 0, r0 = 0, c1 = 0, r1 = 0;
    std::size_t to = from;
    for (; to < order.size(); ++to) {
      const Point2& p = places[order[to]];
      const auto column = static_cast<std::int64_t>(std::floor(p[0]));
      const auto row = static_cast<std::int64_t>(std::floor(p[1]));
      const bool first = to == from;
      const std::int64_t nc0 = first ? column : std::min(c0, column);
      const std::int64_t nr0 = first ? row : std::min(r0, row);
      const std::int64_t nc1 = first ? column + 1 : std::max(c1, column + 1);
      const std::int64_t nr1 = first ? row + 1 : std::max(r1, row + 1);
      const std::int64_t max_samples =
          std::min(kMaxInWindow, kMaxPerPlace * static_cast<std::int64_t>(to + 1 - from));
      if (!first && (nc1 - nc0 + 1) * (nr1 - nr0 + 1) > max_samples) break;
      c0 = nc0;
      r0 = nr0;
      c1 = nc1;
      r1 = nr1;
    }
    const LatticeWindow window{c0, r0, c1 - c0 + 1, r1 - r0 + 1};
    const View view = this->view(window);
    for (; from < to; ++from) {
      const Point2& p = places[order[from]];
      const auto column = static_cast<std::int64_t>(std::floor(p[0])) - window.column;
      const auto row = static_cast<std::int64_t>(std::floor(p[1])) - window.row;
      visit(order[from], p, view.first + row * view.stride + column, view.stride);
    }
  }
}

void RasterTileSurface::heights(std::span<const double> longitude, std::span<const double> latitude,
                                std::span<double> out) {
  const double metres = raster_.vertical.metres_per_unit();
  // Heights of samples in metres, and how much of the geoid each needs: flat fill is already
  // relative to the ellipsoid.
  geoid_shares_.assign(out.size(), 1.0);
  visit_places(longitude, latitude,
               [&](std::size_t i, const Point2& p, const double* at, std::int64_t stride) {
                 const double fx = p[0] - std::floor(p[0]), fy = p[1] - std::floor(p[1]);
                 // A sample without weight need not exist.
                 const auto weighed = [](double weight, double height) {
                   return weight > 0.0 ? weight * height : 0.0;
                 };
                 const double height =
                     weighed((1.0 - fy) * (1.0 - fx), at[0]) + weighed((1.0 - fy) * fx, at[1]) +
                     weighed(fy * (1.0 - fx), at[stride]) + weighed(fy * fx, at[stride + 1]);
                 out[i] = height * metres;
                 if (!std::isnan(height)) return;
                 // Missing samples are filled one by one, so that the surface passes through the
                 // existing ones.
                 out[i] = geoid_shares_[i] = 0.0;
                 for (unsigned k = 0; k < 4; ++k) {
                   const unsigned right = k & 1, down = k >> 1;
                   const double weight = (right != 0 ? fx : 1.0 - fx) * (down != 0 ? fy : 1.0 - fy);
                   if (!(weight > 0.0)) continue;
                   const double sample = at[down * stride + right];
                   const double column = std::floor(p[0]) + right, row = std::floor(p[1]) + down;
                   if (std::isnan(sample) &&
                       (raster_.flat_fill || !raster_.is_within_outline(column, row))) {
                     out[i] += weight * raster_.height_beyond();
                     continue;
                   }
                   out[i] +=
                       weight *
                       ((std::isnan(sample) ? raster_.fill.height(column, row) : sample) * metres);
                   geoid_shares_[i] += weight;
                 }
               });
  if (!raster_.vertical.has_geoid()) return;
  places_.resize(out.size());
  for (std::size_t i = 0; i < places_.size(); ++i) places_[i] = {longitude[i], latitude[i]};
  std::vector<double> geoid(out.size(), 0.0);
  raster_.vertical.add_geoid(places_, geoid);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] += geoid_shares_[i] * geoid[i];
}

SurfacePart RasterTileSurface::part(const GeographicBox& box) {
  if (SurfaceRows in_rows; rows(box, in_rows)) return in_rows;
  SurfaceGrid about;
  grid(box, window_around(box), about);
  return about;
}

void RasterTileSurface::grid(const GeographicBox& box, const LatticeWindow& window,
                             SurfaceGrid& out) {
  out.columns = static_cast<std::size_t>(window.columns);
  out.longitude.resize(window.size());
  out.latitude.resize(window.size());
  out.height.resize(window.size());
  filled_.clear();
  if (window.size() == 0) return;
  const View view = this->view(window);
  raster_.geography.window(window.column, window.row, out.columns,
                           static_cast<std::size_t>(window.rows), out.longitude, out.latitude);
  const double metres = raster_.vertical.metres_per_unit();
  for (std::size_t i = 0; i < out.height.size(); ++i) {
    const double longitude = wrapped_longitude(out.longitude[i]), latitude = out.latitude[i];
    out.longitude[i] = longitude;
    // Comparisons with NaN are false, so it is outside.
    const bool inside = longitude >= box.west && longitude <= box.east && latitude >= box.south &&
                        latitude <= box.north;
    const double height = view.first[static_cast<std::int64_t>(i / out.columns) * view.stride +
                                     static_cast<std::int64_t>(i % out.columns)];
    out.height[i] = inside ? height * metres : std::numeric_limits<double>::quiet_NaN();
    if (raster_.flat_fill && inside && std::isnan(height)) filled_.push_back(i);
  }
  if (raster_.vertical.has_geoid()) {
    places_.resize(out.height.size());
    for (std::size_t i = 0; i < places_.size(); ++i) {
      places_[i] = {out.longitude[i], out.latitude[i]};
    }
    raster_.vertical.add_geoid(places_, out.height);
  }
  for (const std::size_t i : filled_) out.height[i] = *raster_.flat_fill;
}

void RasterTileSurface::samples(const GeographicBox& box, SurfaceSamples& out) {
  out.clear();
  grid(box, raster_.window_around(box), grid_);
  for (std::size_t i = 0; i < grid_.height.size(); ++i) {
    if (std::isnan(grid_.height[i])) continue;
    out.longitude.push_back(grid_.longitude[i]);
    out.latitude.push_back(grid_.latitude[i]);
    out.height.push_back(grid_.height[i]);
  }
}

bool RasterTileSurface::rows(const GeographicBox& box, SurfaceRows& out) {
  if (!raster_.upright) return false;
  out = {};
  const LatticeWindow& window = window_around(box);
  if (window.size() == 0) return true;
  const auto columns = static_cast<std::size_t>(window.columns);
  const auto rows = static_cast<std::size_t>(window.rows);
  std::vector<double> longitude(columns), latitude(rows), other(std::max(columns, rows));
  raster_.geography.window(window.column, window.row, columns, 1, longitude,
                           std::span(other).first(columns));
  raster_.geography.window(window.column, window.row, 1, rows, std::span(other).first(rows),
                           latitude);
  for (double& place : longitude) place = wrapped_longitude(place);
  const auto across = part_between(longitude, box.west, box.east);
  const auto down = part_between(latitude, box.south, box.north);
  if (!across || !down) return false;
  take(longitude, *across, out.longitude);
  take(latitude, *down, out.latitude);

  const View view = this->view(window);
  out.height.resize(across->count * down->count);
  const double metres = raster_.vertical.metres_per_unit();
  for (std::size_t i = 0; i < down->count; ++i) {
    const std::size_t row = down->first + (down->descending ? down->count - 1 - i : i);
    const double* const from =
        view.first + static_cast<std::int64_t>(row) * view.stride + across->first;
    double* const to = out.height.data() + i * across->count;
    for (std::size_t k = 0; k < across->count; ++k) to[k] = from[k] * metres;
    if (across->descending) std::reverse(to, to + across->count);
  }
  filled_.clear();
  if (raster_.flat_fill) {
    for (std::size_t i = 0; i < out.height.size(); ++i) {
      if (std::isnan(out.height[i])) filled_.push_back(i);
    }
  }
  if (raster_.vertical.has_geoid()) {
    places_.clear();
    for (const double north : out.latitude) {
      for (const double east : out.longitude) places_.push_back({east, north});
    }
    raster_.vertical.add_geoid(places_, out.height);
  }
  for (const std::size_t i : filled_) out.height[i] = *raster_.flat_fill;
  return true;
}

}  // namespace terrace::terrain
