// SPDX-License-Identifier: Apache-2.0
#include "tile/make/tiled_raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

#include "base/digest.hpp"
#include "earth/crs/definition.hpp"

namespace terrace::terrain {
namespace {

/// Returns the store. Throws: stream::Error if it is a single line of samples.
const stream::Store& checked(const stream::Store& store) {
  if (store.schema().columns >= 2 && store.schema().rows >= 2) return store;
  throw stream::Error(store.path().string(),
                      "a raster of one line of samples has no surface to tile");
}

/// Number of steps along a box in which a projected raster's places are sampled. Boxes wider than
/// this (degrees) may have places outside the raster where its projection is discontinuous.
constexpr unsigned kDigestSteps = 8;
constexpr double kSmooth = 1.0;
/// Distance in samples that includes the samples around a place, plus a margin for rounding.
constexpr double kDigestMargin = 2.0;
/// Memory in bytes of cached heights per thread.
constexpr std::uint64_t kHeightsOfThread = std::uint64_t{24} << 20;

void add_raster(const TiledRaster& raster, Digest& digest) {
  const stream::StoreSchema& schema = raster.store.schema();
  digest.add(schema.columns);
  digest.add(schema.rows);
  for (const double number : schema.world.xy) digest.add(number);
  const stream::Channel& height = schema.coordinates[2];
  digest.add(std::uint64_t{static_cast<std::uint8_t>(height.type)});
  digest.add(height.scale);
  digest.add(height.offset);
  const stream::Crs crs = raster.places.crs().crs();
  digest.add(static_cast<std::uint64_t>(crs.epsg));
  digest.add(crs.wkt);
  raster.add_to(digest);
}

/// Returns the box of a non-empty window of samples.
StoredBox box_of(const LatticeWindow& window) {
  return {{static_cast<double>(window.column), static_cast<double>(window.row)},
          {static_cast<double>(window.column + window.columns - 1),
           static_cast<double>(window.row + window.rows - 1)}};
}

/// Adds the part of the outline that affects places in and around a box. It does not change if the
/// outline changes elsewhere.
void add_outline(const PointHull& hull, const StoredBox& box, double rim, Digest& digest) {
  digest.add(rim);
  const double around = rim + 2.5;
  std::vector<Point2> part(hull.corners().begin(), hull.corners().end());
  for (unsigned side = 0; side < 4 && !hull.is_flat(); ++side) {
    const std::size_t axis = side / 2, other = 1 - axis;
    const bool upper = side % 2 == 1;
    const double bound = upper ? box.max[axis] + around : box.min[axis] - around;
    const auto keeps = [&](const Point2& p) { return upper ? p[axis] <= bound : p[axis] >= bound; };
    std::vector<Point2> kept;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Point2 &a = part[i], &b = part[(i + 1) % part.size()];
      if (keeps(a)) kept.push_back(a);
      if (keeps(a) == keeps(b)) continue;
      Point2 cut{};
      cut[axis] = bound;
      cut[other] = a[other] + (bound - a[axis]) / (b[axis] - a[axis]) * (b[other] - a[other]);
      kept.push_back(cut);
    }
    part = std::move(kept);
  }
  std::rotate(part.begin(), std::min_element(part.begin(), part.end()), part.end());
  for (const Point2& corner : part) {
    digest.add(corner[0]);
    digest.add(corner[1]);
  }
}

/// Adds the samples of a window, and the fill where it is used.
void add_window(const TiledRaster& raster, const LatticeWindow& window, Digest& digest) {
  digest.add(raster.blocks.digest(window));
  if (raster.flat_fill) return;
  bool filled = false;
  raster.blocks.for_each_incomplete(window, [&](const LatticeWindow& block) {
    digest.add(raster.fill.digest(box_of(block)));
    filled = true;
  });
  // The parts beyond the raster's borders.
  const stream::StoreSchema& schema = raster.store.schema();
  const auto columns = static_cast<std::int64_t>(schema.columns);
  const auto rows = static_cast<std::int64_t>(schema.rows);
  const std::int64_t right = window.column + window.columns - columns;
  const std::int64_t bottom = window.row + window.rows - rows;
  for (const LatticeWindow& strip :
       {LatticeWindow{window.column, window.row, -window.column, window.rows},
        LatticeWindow{columns, window.row, right, window.rows},
        LatticeWindow{window.column, window.row, window.columns, -window.row},
        LatticeWindow{window.column, rows, window.columns, bottom}}) {
    if (strip.columns <= 0 || strip.rows <= 0) continue;
    digest.add(raster.fill.digest(box_of(strip)));
    filled = true;
  }
  if (!filled) return;
  add_outline(raster.hull, box_of(window), raster.rim, digest);
}

/// Returns the lattice around places, at most two samples beyond its borders, where places further
/// away are evaluated. It always includes a part of the raster.
LatticeWindow window_of(const TiledRaster& raster, const stream::Box3& around, double margin) {
  const stream::StoreSchema& schema = raster.store.schema();
  LatticeWindow window;
  const auto span = [&](std::size_t axis, std::uint64_t count, std::int64_t& first,
                        std::int64_t& size) {
    const double last = static_cast<double>(count - 1);
    const double low = std::clamp(std::floor(around.min[axis] - margin), -2.0, last);
    const double high = std::clamp(std::ceil(around.max[axis] + margin), 0.0, last + 2.0);
    first = static_cast<std::int64_t>(low);
    size = static_cast<std::int64_t>(high - low) + 1;
  };
  span(0, schema.columns, window.column, window.columns);
  span(1, schema.rows, window.row, window.rows);
  return window;
}

void add_everything(const TiledRaster& raster, Digest& digest) {
  const stream::StoreSchema& schema = raster.store.schema();
  const auto columns = static_cast<std::int64_t>(schema.columns);
  const auto rows = static_cast<std::int64_t>(schema.rows);
  add_window(raster, {-2, -2, columns + 4, rows + 4}, digest);
}

/// Returns places of the box in the raster's CRS, `steps` steps along each axis; empty if one has
/// no image.
std::vector<Point2> places_of(const TiledRaster& raster, const GeographicBox& box, unsigned steps) {
  std::vector<Point2> places;
  for (unsigned j = 0; j <= steps; ++j) {
    for (unsigned i = 0; i <= steps; ++i) {
      double longitude = box.west + (box.east - box.west) * i / steps;
      // A raster in degrees may be in any turn; projections require the first.
      if (!raster.places.crs().is_geographic()) longitude = std::remainder(longitude, 360.0);
      const double latitude = box.south + (box.north - box.south) * j / steps;
      places.push_back({longitude, std::clamp(latitude, -90.0, 90.0)});
    }
  }
  raster.places.crs().from_geographic(places);
  const bool good = std::all_of(places.begin(), places.end(), [](const Point2& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]);
  });
  return good ? places : std::vector<Point2>{};
}

/// In degrees, uses the turn nearest to the raster's own longitudes.
void add_in_all_turns(const TiledRaster& raster, const stream::Box3& box, double margin,
                      Digest& digest) {
  const auto [first, last] = raster.places.longitudes();
  const double gap = std::max(0.0, 360.0 - (last - first)) / 2.0 + 1e-6;
  for (int turn = -2; turn <= 2; ++turn) {
    const double west = std::max(box.min[0] + 360.0 * turn, first - gap);
    const double east = std::min(box.max[0] + 360.0 * turn, last + gap);
    if (west > east) continue;
    stream::Box3 around;
    for (const double x : {west, east}) {
      for (const double y : {box.min[1], box.max[1]}) {
        const Point2 place = stored_place(raster.store.schema(), {x, y});
        around.include(stream::Point3{place[0], place[1], 0.0});
      }
    }
    add_window(raster, window_of(raster, around, margin), digest);
  }
}

}  // namespace

TiledRaster::TiledRaster(const stream::Store& tiled, CoordinateSystem system,
                         EllipsoidalHeights heights, unsigned threads)
    : TiledStore(checked(tiled), std::move(system), std::move(heights)),
      geography(places.crs(), tiled.schema().world),
      blocks(tiled, threads),
      height_cache(tiled, kHeightsOfThread * threads),
      hull(tiled, 0) {
  const auto columns = static_cast<std::int64_t>(tiled.schema().columns);
  const auto rows = static_cast<std::int64_t>(tiled.schema().rows);
  // TiledStore has found a sample with data.
  everywhere = blocks.range({0, 0, columns, rows}).value();
  const std::array<double, 6>& world = tiled.schema().world.xy;
  const CoordinateSystem& crs = places.crs();
  upright = crs.is_geographic() && crs.counts_as_wgs84() && world[1] == 0.0 && world[3] == 0.0;
  spacing = places.lattice_spacing();
  rim = rim_of_outline();
}

bool TiledRaster::is_within_outline(double column, double row) const {
  const stream::StoreSchema& schema = store.schema();
  // visit_places() moves places beyond the rim to two samples outside the lattice.
  if (column < -1 || row < -1 || column > static_cast<double>(schema.columns) ||
      row > static_cast<double>(schema.rows)) {
    return false;
  }
  return hull.distance({column, row}) <= rim;
}

LatticeWindow TiledRaster::window_around(const GeographicBox& box) const {
  const std::vector<StoredBox> parts = places.windows(box);
  if (parts.empty()) return {};
  std::array<std::int64_t, 2> first{}, size{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    double low = parts.front().min[axis], high = parts.front().max[axis];
    for (const StoredBox& part : parts) {
      low = std::min(low, part.min[axis]);
      high = std::max(high, part.max[axis]);
    }
    const double last = places.stored_bounds().max[axis];
    first[axis] = static_cast<std::int64_t>(std::max(std::floor(low - 1.0), 0.0));
    size[axis] = static_cast<std::int64_t>(std::min(std::ceil(high + 1.0), last)) - first[axis] + 1;
  }
  return {first[0], first[1], size[0], size[1]};
}

std::uint64_t TiledRaster::digest(const GeographicBox& box) const {
  Digest sum;
  add_raster(*this, sum);
  const CrsDefinition& crs = places.crs().definition();
  const bool geographic = places.crs().is_geographic();
  const bool straight = geographic && places.crs().counts_as_wgs84();
  const GeographicBox& all = places.bounds();
  const bool inside = box.west >= all.west && box.east <= all.east && box.south >= all.south &&
                      box.north <= all.north;
  const bool smooth =
      geographic ? crs.degrees_per_unit == 1.0 : inside || box.east - box.west <= kSmooth;
  const unsigned steps = straight ? 1 : kDigestSteps;
  std::vector<Point2> looked_at;
  if (smooth && !places.goes_around()) looked_at = places_of(*this, box, steps);
  if (looked_at.empty()) {
    add_everything(*this, sum);
    return sum.value();
  }
  if (!geographic) {
    for (Point2& p : looked_at) p = stored_place(store.schema(), p);
  }
  stream::Box3 around;
  for (const Point2& p : looked_at) around.include(stream::Point3{p[0], p[1], 0.0});
  // Allow for the bulge between the sampled places.
  const auto bulge = [&](std::size_t axis) {
    return straight ? 0.0 : (around.max[axis] - around.min[axis]) / steps;
  };
  for (const std::size_t axis : {std::size_t{0}, std::size_t{1}}) {
    const double more = bulge(axis);
    around.min[axis] -= more;
    around.max[axis] += more;
  }
  if (geographic) {
    add_in_all_turns(*this, around, kDigestMargin, sum);
  } else {
    add_window(*this, window_of(*this, around, kDigestMargin), sum);
  }
  return sum.value();
}

}  // namespace terrace::terrain
