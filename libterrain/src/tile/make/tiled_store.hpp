// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include <terrace/stream/store.hpp>

#include "base/digest.hpp"
#include "earth/geoid_heights.hpp"
#include "surface/store_fill.hpp"
#include "terrace/terrain/crs.hpp"
#include "tile/make/stored_places.hpp"

namespace terrace::terrain {

/// The data that all threads share when tiling a store, be it a raster or irregular points.
struct TiledStore {
  stream::Store store;
  StoredPlaces places;
  EllipsoidalHeights vertical;
  StoreFill fill;
  double spacing = 0.0;  ///< from TileSurface::spacing()
  /// The height in metres where there are no samples. If not set, heights within the outline of all
  /// samples are interpolated from surrounding samples.
  std::optional<double> flat_fill{};
  /// The height in metres beyond the outline, where no land is invented.
  [[nodiscard]] double height_beyond() const { return flat_fill.value_or(0.0); }
  /// Returns the distance by which heights continue beyond the outline, in stored units. It is an
  /// eighth to a half of the height by which the surface falls there, rounded to a power of four,
  /// and at least one and a half cells of a raster. Tiles round places, and a sample on the outline
  /// must not end up beyond it.
  [[nodiscard]] double rim_of_outline() const;
  /// The height of water surfaces, in the store's unit. If not set, water is where a raster has no
  /// data.
  std::optional<double> water_height{};

  /// Reads a level of the store. Throws: stream::Error if no place of it has a longitude and
  /// latitude.
  TiledStore(const stream::Store& tiled, CoordinateSystem system, EllipsoidalHeights heights)
      : store(tiled), places(tiled, std::move(system)), vertical(std::move(heights)), fill(tiled) {}

  /// Adds everything that the heights of all samples depend on, in addition to the samples.
  void add_to(Digest& digest) const {
    vertical.add_to(digest);
    for (const std::optional<double>& option : {flat_fill, water_height}) {
      digest.add(std::uint64_t{option.has_value()});
      digest.add(option.value_or(0.0));
    }
  }
};

}  // namespace terrace::terrain
