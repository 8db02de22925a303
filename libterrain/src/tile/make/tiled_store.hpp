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

/// What all threads know of a store that is tiled, of whatever kind.
struct TiledStore {
  stream::Store store;
  StoredPlaces places;
  EllipsoidalHeights vertical;
  StoreFill fill;
  double spacing = 0.0;  ///< see TileSurface::spacing()
  /// Heights where there are no samples: nullopt takes those around, else this height in metres.
  std::optional<double> flat_fill{};
  /// Where the surface has this height (in the store's unit) is water; nullopt: where a raster has
  /// no data.
  std::optional<double> water_height{};

  /// Reads a level of the store. Throws: stream::Error if no place of it can be told on the globe.
  TiledStore(const stream::Store& tiled, CoordinateSystem system, EllipsoidalHeights heights)
      : store(tiled), places(tiled, std::move(system)), vertical(std::move(heights)), fill(tiled) {}

  /// Heights of all samples, as a digest must know them.
  void add_to(Digest& digest) const {
    vertical.add_to(digest);
    for (const std::optional<double>& option : {flat_fill, water_height}) {
      digest.add(std::uint64_t{option.has_value()});
      digest.add(option.value_or(0.0));
    }
  }
};

}  // namespace terrace::terrain
