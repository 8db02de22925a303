// SPDX-License-Identifier: Apache-2.0
// How a raster hands out its samples.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "tile/make/raster_tile_surface.hpp"

namespace terrace::terrain {
namespace {

/// The places along one axis of a window that lie in a range.
struct Part {
  std::size_t first = 0, count = 0;
  bool descending = false;
};

/// Nothing, if they are not one after the other.
std::optional<Part> part_between(std::span<const double> places, double low, double high) {
  Part part;
  while (part.first < places.size() && !(places[part.first] >= low && places[part.first] <= high)) {
    ++part.first;
  }
  const std::span<const double> rest = places.subspan(part.first);
  while (part.count < rest.size() && rest[part.count] >= low && rest[part.count] <= high) {
    ++part.count;
  }
  if (std::any_of(rest.begin() + static_cast<std::ptrdiff_t>(part.count), rest.end(),
                  [&](double place) { return place >= low && place <= high; })) {
    return std::nullopt;
  }
  if (part.count < 2) return part;
  part.descending = rest[1] < rest[0];
  for (std::size_t i = 1; i < part.count; ++i) {
    if (!(part.descending ? rest[i] < rest[i - 1] : rest[i] > rest[i - 1])) return std::nullopt;
  }
  return part;
}

/// The part's places ascending.
void take(std::span<const double> places, const Part& part, std::vector<double>& out) {
  const std::span<const double> own = places.subspan(part.first, part.count);
  out.assign(own.begin(), own.end());
  if (part.descending) std::reverse(out.begin(), out.end());
}

}  // namespace

bool RasterTileSurface::grid(const GeographicBox& box, SurfaceGrid& out) {
  const LatticeWindow window = raster_.window_around(box);
  out.columns = static_cast<std::size_t>(window.columns);
  out.longitude.resize(window.size());
  out.latitude.resize(window.size());
  out.height.resize(window.size());
  filled_.clear();
  if (window.size() == 0) return true;
  const View view = this->view(window);
  raster_.geography.window(window.column, window.row, out.columns,
                           static_cast<std::size_t>(window.rows), out.longitude, out.latitude);
  const double metres = raster_.vertical.metres_per_unit();
  for (std::size_t i = 0; i < out.height.size(); ++i) {
    const double longitude = wrapped_longitude(out.longitude[i]), latitude = out.latitude[i];
    out.longitude[i] = longitude;
    // Comparisons that NaN fails: it is outside.
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
  return true;
}

void RasterTileSurface::samples(const GeographicBox& box, SurfaceSamples& out) {
  out.clear();
  grid(box, grid_);
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
  const LatticeWindow window = raster_.window_around(box);
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
    if (raster_.vertical.has_geoid()) {
      places_.clear();
      for (const double place : out.longitude) places_.push_back({place, out.latitude[i]});
      raster_.vertical.add_geoid(places_, {to, across->count});
    }
    if (raster_.flat_fill) {
      for (std::size_t k = 0; k < across->count; ++k) {
        if (std::isnan(to[k])) to[k] = *raster_.flat_fill;
      }
    }
  }
  return true;
}

}  // namespace terrace::terrain
