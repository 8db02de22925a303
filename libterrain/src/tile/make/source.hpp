// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/tiles.hpp"
#include "tile/make/surface.hpp"

namespace terrace::terrain {

/// Threads and memory for making or checking tiles.
struct TileResources {
  std::uint64_t memory_bytes = 0;
  unsigned threads = 1;
};

/// Returns the resources that the context allows. Throws: stream::Error, naming `path`, if the
/// memory does not suffice for one thread.
TileResources tile_resources(const Context& context, const std::string& path);

/// The surfaces of a store, one per thread, and the data that they share.
class TileSource {
 public:
  virtual ~TileSource() = default;
  [[nodiscard]] const std::vector<std::unique_ptr<TileSurface>>& surfaces() const {
    return surfaces_;
  }

 protected:
  std::vector<std::unique_ptr<TileSurface>> surfaces_;
};

/// Opens the surfaces of a raster or of irregular points. Reads the store once or twice. Throws:
/// UsageError for invalid options, or options that do not apply to this kind of store;
/// stream::Error if the store's positions cannot be converted to longitude and latitude, or if it
/// is damaged; stream::Stopped.
std::unique_ptr<TileSource> open_tile_source(const stream::Store& store,
                                             const TilesRequest& request,
                                             const TileResources& resources,
                                             const Context& context);

}  // namespace terrace::terrain
