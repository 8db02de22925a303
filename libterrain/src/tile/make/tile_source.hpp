// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "tile/make/tile_surface.hpp"

namespace terrace::terrain {

struct TileSourceOptions {
  std::string vertical, geoid;       ///< as in EllipsoidalHeights
  std::string fill = "interpolate";  ///< of `terrace tile --fill`
  std::string water;                 ///< of `terrace tile --water`
  std::uint64_t memory_bytes = 0;
  unsigned threads = 1;
};

/// The surfaces of a store, one per thread, and what they share.
class TileSource {
 public:
  virtual ~TileSource() = default;
  [[nodiscard]] const std::vector<std::unique_ptr<TileSurface>>& surfaces() const {
    return surfaces_;
  }

 protected:
  std::vector<std::unique_ptr<TileSurface>> surfaces_;
};

/// The source for a raster or for irregular points. Reads the store once or twice.
/// Throws: UsageError for options that make no sense or not for this kind of store; stream::Error
/// if no place of it can be told on the globe, or on a damaged one; stream::Stopped.
std::unique_ptr<TileSource> open_tile_source(const stream::Store& store,
                                             const TileSourceOptions& options,
                                             const Context& context);

}  // namespace terrace::terrain
