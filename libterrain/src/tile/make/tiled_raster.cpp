// SPDX-License-Identifier: Apache-2.0
#include "tile/make/tiled_raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

namespace terrace::terrain {
namespace {

/// Neighbouring samples are closer nowhere, in degrees along a parallel or meridian, as far as the
/// corners of 64 x 64 parts of the raster tell.
double lattice_spacing(const StoredPlaces& places) {
  constexpr std::size_t kSteps = 64;
  const std::array<double, 2> samples = places.stored_bounds().max;
  std::vector<Point2> corners;
  for (std::size_t j = 0; j <= kSteps; ++j) {
    for (std::size_t i = 0; i <= kSteps; ++i) {
      corners.push_back({samples[0] * static_cast<double>(i) / kSteps,
                         samples[1] * static_cast<double>(j) / kSteps});
    }
  }
  places.to_geographic(corners);
  double spacing = std::numeric_limits<double>::infinity();
  const auto step = [&](std::size_t from, std::size_t to, double samples_along) {
    const double wide = std::abs(corners[to][0] - corners[from][0]);
    const double length = std::max(wide, std::abs(corners[to][1] - corners[from][1]));
    // Between neighbours more than half of the globe: the line of 180 degrees lies between.
    if (!(wide <= 180.0) || !(length > 0.0)) return;
    spacing = std::min(spacing, length * static_cast<double>(kSteps) / samples_along);
  };
  for (std::size_t j = 0; j <= kSteps; ++j) {
    for (std::size_t i = 0; i <= kSteps; ++i) {
      const std::size_t at = j * (kSteps + 1) + i;
      if (i < kSteps) step(at, at + 1, samples[0]);
      if (j < kSteps) step(at, at + kSteps + 1, samples[1]);
    }
  }
  return spacing;
}

/// The same store, if it can be tiled.
const stream::Store& checked(const stream::Store& store) {
  if (store.schema().columns >= 2 && store.schema().rows >= 2) return store;
  throw stream::Error({.file = store.path().string(),
                       .where = {},
                       .cause = "a raster of one line of samples has no surface to tile",
                       .remedy = {}});
}

}  // namespace

TiledRaster::TiledRaster(const stream::Store& tiled, CoordinateSystem system,
                         EllipsoidalHeights heights)
    : TiledStore(checked(tiled), std::move(system), std::move(heights)),
      geography(places.crs(), tiled.schema().world),
      blocks(tiled) {
  const std::array<double, 6>& world = tiled.schema().world.xy;
  const CoordinateSystem& crs = places.crs();
  upright = crs.is_geographic() && crs.counts_as_wgs84() && world[1] == 0.0 && world[3] == 0.0;
  spacing = lattice_spacing(places);
  if (spacing < std::numeric_limits<double>::infinity()) return;
  throw stream::Error({.file = tiled.path().string(),
                       .where = {},
                       .cause = "its places cannot be told on the globe by " + crs.title(),
                       .remedy = "build the store anew with the right `crs`"});
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

}  // namespace terrace::terrain
