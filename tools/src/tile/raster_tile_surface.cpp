// SPDX-License-Identifier: GPL-3.0-or-later
#include "tile/raster_tile_surface.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include <terrace/stream/error.hpp>

namespace terrace::tools {
namespace {

/// Lattice coordinates (column, row) of places in the CRS, in place, and back.
void to_lattice(const Placement& placement, std::span<Point2> places) {
  for (Point2& p : places) p = stored_place(placement, p);
}

Point2 world_place(const Placement& placement, double column, double row) {
  const stream::Point3 p = world_point(placement, {column, row, 0.0});
  return {p[0], p[1]};
}

/// Longitudes in [-180, 180], whatever turn they were in.
double wrapped(double longitude) {
  if (longitude >= -180.0 && longitude <= 180.0) return longitude;
  return longitude - 360.0 * std::floor((longitude + 180.0) / 360.0);
}

/// A longitude of the turn that a raster in degrees is in: in it, or as near to it as can be. Both
/// numbers of the line of 180 degrees give the same.
double in_turn(const TiledRaster& raster, double longitude) {
  const double first = raster.first_longitude, last = raster.last_longitude;
  const double after = longitude - 360.0 * std::floor((longitude - first) / 360.0);
  return after > last && after - last > first + 360.0 - after ? after - 360.0 : after;
}

/// Places on the globe to those of the raster's lattice, in place.
void find_on_lattice(const TiledRaster& raster, std::span<Point2> places) {
  raster.crs.from_geographic(places);
  if (raster.crs.is_geographic()) {
    for (Point2& p : places) p[0] = in_turn(raster, p[0]);
  }
  to_lattice(raster.placement, places);
}

/// Corners of what a raster in degrees has of the box around some places, in all turns.
std::vector<Point2> in_all_turns(const TiledRaster& raster, std::span<const Point2> places) {
  constexpr double kRounding = 1e-9;
  stream::Box3 box;
  for (const Point2& p : places) box.include(stream::Point3{p[0], p[1], 0.0});
  std::vector<Point2> corners;
  for (int turn = -2; turn <= 2; ++turn) {
    const double west = std::max(box.min[0] + 360.0 * turn, raster.first_longitude - kRounding);
    const double east = std::min(box.max[0] + 360.0 * turn, raster.last_longitude + kRounding);
    if (west > east) continue;
    for (const double x : {west, east}) {
      for (const double y : {box.min[1], box.max[1]}) corners.push_back({x, y});
    }
  }
  return corners;
}

/// The raster's own longitudes, which may go beyond 180.
void find_turn(TiledRaster& raster) {
  if (!raster.crs.is_geographic()) return;
  const double columns = static_cast<double>(raster.store.schema().columns - 1);
  const double rows = static_cast<double>(raster.store.schema().rows - 1);
  const auto longitude = [&](double column, double row) {
    return world_place(raster.placement, column, row)[0];
  };
  std::tie(raster.first_longitude, raster.last_longitude) =
      std::minmax({longitude(0.0, 0.0), longitude(columns, 0.0), longitude(0.0, rows),
                   longitude(columns, rows)});
}

/// Where the raster lies on the globe, and how close its samples are.
void find_bounds(TiledRaster& raster) {
  constexpr std::int64_t kSteps = 64;
  const stream::Schema& schema = raster.store.schema();
  const double columns = static_cast<double>(schema.columns - 1);
  const double rows = static_cast<double>(schema.rows - 1);
  std::vector<Point2> places;
  for (std::int64_t j = 0; j <= kSteps; ++j) {
    for (std::int64_t i = 0; i <= kSteps; ++i) {
      places.push_back(world_place(raster.placement, columns * static_cast<double>(i) / kSteps,
                                   rows * static_cast<double>(j) / kSteps));
    }
  }
  raster.crs.to_geographic(places);
  const auto at = [&](std::int64_t i, std::int64_t j) {
    return places[static_cast<std::size_t>(j * (kSteps + 1) + i)];
  };
  constexpr double kFar = std::numeric_limits<double>::infinity();
  GeographicBox box{kFar, kFar, -kFar, -kFar};
  double step_lon = 0.0, step_lat = 0.0, spacing = kFar;
  bool crosses = false;
  for (std::int64_t j = 0; j <= kSteps; ++j) {
    for (std::int64_t i = 0; i <= kSteps; ++i) {
      const Point2 p{wrapped(at(i, j)[0]), at(i, j)[1]};
      if (!std::isfinite(p[0]) || !std::isfinite(p[1])) continue;
      box = {std::min(box.west, p[0]), std::min(box.south, p[1]), std::max(box.east, p[0]),
             std::max(box.north, p[1])};
      const auto step_to = [&](const Point2& next, double samples) {
        if (!std::isfinite(next[0]) || samples <= 0.0) return;
        const double d_lon = std::abs(wrapped(next[0]) - p[0]), d_lat = std::abs(next[1] - p[1]);
        // Between neighbours more than half of the globe: the line of 180 degrees lies between.
        if (d_lon > 180.0) {
          crosses = true;
          return;
        }
        step_lon = std::max(step_lon, d_lon);
        step_lat = std::max(step_lat, d_lat);
        const double length = std::max(d_lon, d_lat) * static_cast<double>(kSteps) / samples;
        if (length > 0.0) spacing = std::min(spacing, length);
      };
      if (i < kSteps) step_to(at(i + 1, j), columns);
      if (j < kSteps) step_to(at(i, j + 1), rows);
    }
  }
  if (!(box.west <= box.east) || !(spacing < kFar)) {
    throw stream::Error({.file = raster.store.path().string(),
                         .where = {},
                         .cause = "its places cannot be told on the globe by " + raster.crs.title(),
                         .remedy = "build the store anew with the right --crs"});
  }
  // Between the places looked at, the border of a projected raster may bulge by part of a step.
  const double share = raster.crs.is_geographic() ? 0.0 : 0.5;
  const double bulge_lon = std::min(share * step_lon, 1.0);
  const double bulge_lat = std::min(share * step_lat, 1.0);
  box = {std::max(-180.0, box.west - bulge_lon), std::max(-90.0, box.south - bulge_lat),
         std::min(180.0, box.east + bulge_lon), std::min(90.0, box.north + bulge_lat)};
  // A pole inside has all longitudes around it.
  for (const double pole : {-90.0, 90.0}) {
    std::array<Point2, 1> place{raster.crs.from_geographic(Point2{0.0, pole})};
    to_lattice(raster.placement, place);
    if (!raster.crs.is_geographic() && place[0][0] >= -1.0 && place[0][0] <= columns + 1.0 &&
        place[0][1] >= -1.0 && place[0][1] <= rows + 1.0) {
      (pole < 0.0 ? box.south : box.north) = pole;
      crosses = true;
    }
  }
  if (crosses) {
    box.west = -180.0;
    box.east = 180.0;
  }
  raster.bounds = box;
  raster.spacing = spacing;
}

}  // namespace

TiledRaster::TiledRaster(const stream::Store& tiled, CoordinateSystem system,
                         EllipsoidalHeights heights)
    : store(tiled),
      crs(std::move(system)),
      placement(placement_of(tiled.schema())),
      geography(crs, tiled.schema().world),
      vertical(std::move(heights)),
      fill(tiled),
      blocks(tiled) {
  if (tiled.schema().columns < 2 || tiled.schema().rows < 2) {
    throw stream::Error({.file = tiled.path().string(),
                         .where = {},
                         .cause = "a raster of one line of samples has no surface to tile",
                         .remedy = {}});
  }
  find_turn(*this);
  find_bounds(*this);
}

RasterTileSurface::RasterTileSurface(const TiledRaster& raster)
    : raster_(raster), reader_(raster.store, std::uint64_t{8} << 20) {}

LatticeWindow RasterTileSurface::window_around(const GeographicBox& box) const {
  // Only where the raster is: far from it a projection may have no places.
  const GeographicBox& all = raster_.bounds;
  const GeographicBox part{std::max(box.west, all.west), std::max(box.south, all.south),
                           std::min(box.east, all.east), std::min(box.north, all.north)};
  if (!(part.west <= part.east && part.south <= part.north)) return {};
  const stream::Schema& schema = raster_.store.schema();
  const bool straight = raster_.crs.is_geographic();
  const unsigned steps = straight ? 1 : 24;
  std::vector<Point2> places;
  for (unsigned j = 0; j <= steps; ++j) {
    for (unsigned i = 0; i <= steps; ++i) {
      places.push_back({part.west + (part.east - part.west) * i / steps,
                        part.south + (part.north - part.south) * j / steps});
    }
  }
  raster_.crs.from_geographic(places);
  if (straight) places = in_all_turns(raster_, places);
  to_lattice(raster_.placement, places);
  stream::Box3 around;
  for (const Point2& p : places) around.include(stream::Point3{p[0], p[1], 0.0});
  if (around.empty()) return {};
  LatticeWindow window;
  const auto span = [&](std::size_t axis, std::uint64_t count, std::int64_t& first,
                        std::int64_t& size) {
    // What bulges between the places looked at.
    const double margin = 1.0 + (straight ? 0.0 : (around.max[axis] - around.min[axis]) / steps);
    const double last = static_cast<double>(count - 1);
    const double low = std::clamp(std::floor(around.min[axis] - margin), 0.0, last);
    const double high = std::clamp(std::ceil(around.max[axis] + margin), 0.0, last);
    first = static_cast<std::int64_t>(low);
    size = static_cast<std::int64_t>(high - low) + 1;
  };
  span(0, schema.columns, window.column, window.columns);
  span(1, schema.rows, window.row, window.rows);
  return window;
}

void RasterTileSurface::samples(const GeographicBox& box, SurfaceSamples& out) {
  out.clear();
  const LatticeWindow window = window_around(box);
  if (window.size() == 0) return;
  const View view = this->view(window);
  longitude_.resize(window.size());
  latitude_.resize(window.size());
  raster_.geography.window(window.column, window.row, static_cast<std::size_t>(window.columns),
                           static_cast<std::size_t>(window.rows), longitude_, latitude_);
  for (std::int64_t row = 0, i = 0; row < window.rows; ++row) {
    for (std::int64_t column = 0; column < window.columns; ++column, ++i) {
      const double longitude = wrapped(longitude_[static_cast<std::size_t>(i)]);
      const double latitude = latitude_[static_cast<std::size_t>(i)];
      // Written so that NaN is outside.
      const bool inside = longitude >= box.west && longitude <= box.east && latitude >= box.south &&
                          latitude <= box.north;
      if (!inside) continue;
      const double height = view.first[row * view.stride + column];
      if (std::isnan(height)) {
        if (!raster_.flat_fill) continue;
        out.height.push_back(*raster_.flat_fill);
      } else {
        out.height.push_back(raster_.vertical.convert({longitude, latitude}, height));
      }
      out.longitude.push_back(longitude);
      out.latitude.push_back(latitude);
    }
  }
}

RasterTileSurface::View RasterTileSurface::view(const LatticeWindow& window) {
  const std::int64_t column = window.column - held_.column, row = window.row - held_.row;
  const bool holds = column >= 0 && row >= 0 && column + window.columns <= held_.columns &&
                     row + window.rows <= held_.rows;
  if (holds) return {heights_.data() + row * held_.columns + column, held_.columns};
  held_ = {};  // if reading fails nothing is held
  heights_.resize(window.size());
  reader_.heights(window, std::span<double>(heights_));
  held_ = window;
  return {heights_.data(), held_.columns};
}

void RasterTileSurface::expect(const GeographicBox& box) {
  LatticeWindow window = window_around(box);
  if (window.size() == 0) return;
  // What lies around places on the box's sides, outside the raster too.
  window = {window.column - 2, window.row - 2, window.columns + 4, window.rows + 4};
  view(window);
}

std::optional<HeightRange> RasterTileSurface::range(const GeographicBox& box) {
  const LatticeWindow window = window_around(box);
  if (window.size() == 0) return std::nullopt;
  const auto range = raster_.blocks.range(window);
  if (!range) return std::nullopt;
  HeightRange out;
  const double low = range->low * raster_.vertical.metres_per_unit();
  const double high = range->high * raster_.vertical.metres_per_unit();
  out.low = std::min(low, high);
  out.high = std::max(low, high);
  if (raster_.flat_fill) {
    out.low = std::min(out.low, *raster_.flat_fill);
    out.high = std::max(out.high, *raster_.flat_fill);
  }
  if (raster_.vertical.has_geoid()) {
    out.low += kLowestGeoid;
    out.high += kHighestGeoid;
  }
  // A block of the lattice all of whose corners are inside.
  if (const auto block = raster_.blocks.some_block_within(window)) {
    std::array<Point2, 4> corners;
    for (unsigned k = 0; k < 4; ++k) {
      corners[k] =
          world_place(raster_.placement,
                      static_cast<double>(block->column + ((k & 1) != 0 ? block->columns - 1 : 0)),
                      static_cast<double>(block->row + ((k & 2) != 0 ? block->rows - 1 : 0)));
    }
    raster_.crs.to_geographic(corners);
    const double margin = raster_.crs.is_geographic() ? 0.0 : raster_.spacing;
    out.certain = std::all_of(corners.begin(), corners.end(), [&](const Point2& p) {
      const double longitude = wrapped(p[0]);
      return longitude >= box.west + margin && longitude <= box.east - margin &&
             p[1] >= box.south + margin && p[1] <= box.north - margin;
    });
  }
  return out;
}

template <class Visit>
void RasterTileSurface::visit_places(std::span<const double> longitude,
                                     std::span<const double> latitude, const Visit& visit) {
  constexpr std::int64_t kBlock = 128;          // places are taken block by block of the lattice
  constexpr std::int64_t kMostSamples = 32768;  // of a window that is read for a run of them
  std::vector<Point2> places(longitude.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    // One of the two numbers that the line of 180 degrees has: tiles on both sides ask for it.
    const double turned = wrapped(longitude[i]);
    places[i] = {turned == 180.0 ? -180.0 : turned, std::clamp(latitude[i], -90.0, 90.0)};
  }
  find_on_lattice(raster_, places);
  const stream::Schema& schema = raster_.store.schema();
  const double last_column = static_cast<double>(schema.columns - 1);
  const double last_row = static_cast<double>(schema.rows - 1);
  for (Point2& p : places) {
    // What has no place, or one far off, is asked at the raster's border: it is filled there.
    if (!std::isfinite(p[0]) || !std::isfinite(p[1])) p = {-1.0, -1.0};
    p = {std::clamp(p[0], -1.0, last_column + 1.0), std::clamp(p[1], -1.0, last_row + 1.0)};
  }
  std::vector<std::uint32_t> order(places.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto block = [&](std::uint32_t i) {
    return std::pair{static_cast<std::int64_t>(std::floor(places[i][1])) / kBlock,
                     static_cast<std::int64_t>(std::floor(places[i][0])) / kBlock};
  };
  const auto before = [&](std::uint32_t a, std::uint32_t b) { return block(a) < block(b); };
  // Sides come in order already.
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
      if (!first && (nc1 - nc0 + 1) * (nr1 - nr0 + 1) > kMostSamples) break;
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
  visit_places(longitude, latitude,
               [&](std::size_t i, const Point2& p, const double* at, std::int64_t stride) {
                 const double fx = p[0] - std::floor(p[0]), fy = p[1] - std::floor(p[1]);
                 // A sample that has no weight need not be there.
                 const auto weighed = [](double weight, double height) {
                   return weight > 0.0 ? weight * height : 0.0;
                 };
                 const double height =
                     weighed((1.0 - fy) * (1.0 - fx), at[0]) + weighed((1.0 - fy) * fx, at[1]) +
                     weighed(fy * (1.0 - fx), at[stride]) + weighed(fy * fx, at[stride + 1]);
                 const Point2 place{longitude[i], latitude[i]};
                 if (!std::isnan(height)) {
                   out[i] = raster_.vertical.convert(place, height);
                   return;
                 }
                 // Samples that are not there are filled one by one: the surface goes through those
                 // that are, up to the last.
                 out[i] = 0.0;
                 for (unsigned k = 0; k < 4; ++k) {
                   const unsigned right = k & 1, down = k >> 1;
                   const double weight = (right != 0 ? fx : 1.0 - fx) * (down != 0 ? fy : 1.0 - fy);
                   if (weight > 0.0) {
                     const double sample = at[down * stride + right];
                     const Point2 corner{std::floor(p[0]) + right, std::floor(p[1]) + down};
                     out[i] += weight * corner_height(place, sample, corner);
                   }
                 }
               });
}

double RasterTileSurface::corner_height(const Point2& place, double sample,
                                        const Point2& corner) const {
  if (!std::isnan(sample)) return raster_.vertical.convert(place, sample);
  if (raster_.flat_fill) return *raster_.flat_fill;
  return raster_.vertical.convert(place, raster_.fill.height(corner[0], corner[1]));
}

void RasterTileSurface::water(std::span<const double> longitude, std::span<const double> latitude,
                              std::span<std::uint8_t> out) {
  visit_places(longitude, latitude,
               [&](std::size_t i, const Point2& p, const double* at, std::int64_t stride) {
                 const double height = at[(p[0] - std::floor(p[0]) >= 0.5 ? 1 : 0) +
                                          (p[1] - std::floor(p[1]) >= 0.5 ? stride : 0)];
                 const bool wet =
                     raster_.water_height ? height == *raster_.water_height : std::isnan(height);
                 out[i] = wet ? 1 : 0;
               });
}

}  // namespace terrace::tools
