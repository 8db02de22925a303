// SPDX-License-Identifier: Apache-2.0
#include "tile/make/tiled_raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

namespace terrace::terrain {

Point2 world_place(const stream::Placement& placement, double column, double row) {
  const stream::Point3 p = world_point(placement, {column, row, 0.0});
  return {p[0], p[1]};
}

double wrapped(double longitude) {
  if (longitude >= -180.0 && longitude <= 180.0) return longitude;
  return longitude - 360.0 * std::floor((longitude + 180.0) / 360.0);
}

namespace {

/// Lattice coordinates (column, row) of places in the CRS, in place, and back.
void to_lattice(const stream::Placement& placement, std::span<Point2> places) {
  for (Point2& p : places) p = stored_place(placement, p);
}

/// A longitude of the turn that a raster in degrees is in: in it, or as near to it as can be. Both
/// numbers of the line of 180 degrees give the same.
double in_turn(const TiledRaster& raster, double longitude) {
  const double first = raster.first_longitude, last = raster.last_longitude;
  const double after = longitude - 360.0 * std::floor((longitude - first) / 360.0);
  return after > last && after - last > first + 360.0 - after ? after - 360.0 : after;
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
  const stream::StoreSchema& schema = raster.store.schema();
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
                         .remedy = "build the store anew with the right `crs`"});
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

/// Places of a box, by rows.
struct PlaceGrid {
  GeographicBox box;
  unsigned across = 1, down = 1;  ///< steps

  [[nodiscard]] std::vector<Point2> places() const {
    std::vector<Point2> places;
    for (unsigned j = 0; j <= down; ++j) {
      for (unsigned i = 0; i <= across; ++i) {
        places.push_back({box.west + (box.east - box.west) * i / across,
                          box.south + (box.north - box.south) * j / down});
      }
    }
    return places;
  }
  /// The largest of a coordinate of what became of the places; infinite where one has none. Between
  /// places a quadratic function is an eighth of it off a straight line.
  [[nodiscard]] double second_difference(std::span<const Point2> made, std::size_t axis) const {
    double largest = 0.0;
    const auto look = [&](std::size_t at, std::size_t step) {
      const double own =
          std::abs(made[at - step][axis] - 2.0 * made[at][axis] + made[at + step][axis]);
      largest = own <= largest ? largest : own;
      if (std::isnan(own)) largest = std::numeric_limits<double>::infinity();
    };
    for (std::size_t j = 0; j <= down; ++j) {
      for (std::size_t i = 0; i <= across; ++i) {
        const std::size_t at = j * (across + 1) + i;
        if (i > 0 && i < across) look(at, 1);
        if (j > 0 && j < down) look(at, across + 1);
      }
    }
    return largest;
  }
};

}  // namespace

TiledRaster::TiledRaster(const stream::Store& tiled, CoordinateSystem system,
                         EllipsoidalHeights heights)
    : store(tiled),
      crs(std::move(system)),
      placement(tiled.schema()),
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
  const std::array<double, 6>& world = placement.world.xy;
  upright = crs.is_geographic() && crs.counts_as_wgs84() && world[1] == 0.0 && world[3] == 0.0;
  find_turn(*this);
  find_bounds(*this);
}

void find_on_lattice(const TiledRaster& raster, std::span<Point2> places) {
  raster.crs.from_geographic(places);
  if (raster.crs.is_geographic()) {
    for (Point2& p : places) p[0] = in_turn(raster, p[0]);
  }
  to_lattice(raster.placement, places);
}

LatticeWindow window_around(const TiledRaster& raster, const GeographicBox& box) {
  // Only where the raster is: far from it a projection may have no places.
  const GeographicBox& all = raster.bounds;
  const GeographicBox part{std::max(box.west, all.west), std::max(box.south, all.south),
                           std::min(box.east, all.east), std::min(box.north, all.north)};
  if (!(part.west <= part.east && part.south <= part.north)) return {};
  const bool straight = raster.crs.is_geographic();
  // Up to here second differences tell how much projections bulge.
  constexpr double kNear = 1.0;
  constexpr unsigned kManySteps = 24, kFewSteps = 6;
  const bool near = part.east - part.west <= kNear && part.north - part.south <= kNear;
  const auto steps_of = [&](double degrees) {
    return straight || degrees <= raster.spacing ? 1U : near ? kFewSteps : kManySteps;
  };
  const PlaceGrid grid{part, steps_of(part.east - part.west), steps_of(part.north - part.south)};
  std::vector<Point2> places = grid.places();
  raster.crs.from_geographic(places);
  if (straight) places = in_all_turns(raster, places);
  to_lattice(raster.placement, places);
  stream::Box3 around;
  for (const Point2& p : places) around.include(stream::Point3{p[0], p[1], 0.0});
  if (around.empty()) return {};
  LatticeWindow window;
  const auto span = [&](std::size_t axis, std::uint64_t count, std::int64_t& first,
                        std::int64_t& size) {
    // What bulges between the places looked at.
    double margin = straight ? 0.0 : (around.max[axis] - around.min[axis]) / kManySteps;
    if (near && !straight) margin = 2.0 * grid.second_difference(places, axis);
    const double last = static_cast<double>(count - 1);
    const double low = std::clamp(std::floor(around.min[axis] - 1.0 - margin), 0.0, last);
    const double high = std::clamp(std::ceil(around.max[axis] + 1.0 + margin), 0.0, last);
    first = static_cast<std::int64_t>(low);
    size = static_cast<std::int64_t>(high - low) + 1;
  };
  span(0, raster.store.schema().columns, window.column, window.columns);
  span(1, raster.store.schema().rows, window.row, window.rows);
  return window;
}

}  // namespace terrace::terrain
