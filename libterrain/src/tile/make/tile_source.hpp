// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/tiles.hpp"
#include "tile/make/tile_surface.hpp"

namespace terrace::terrain {

/// The resources of a job over tiles.
struct TileResources {
  std::uint64_t memory_bytes = 0;
  unsigned threads = 1;
};

/// As the context allows. path: named in errors. Throws: stream::Error if not even one thread has
/// the memory that it needs.
TileResources tile_resources(const Context& context, const std::string& path);

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
/// if no place of it has a longitude and latitude, or on a damaged one; stream::Stopped.
std::unique_ptr<TileSource> open_tile_source(const stream::Store& store,
                                             const TilesRequest& request,
                                             const TileResources& resources,
                                             const Context& context);

}  // namespace terrace::terrain
