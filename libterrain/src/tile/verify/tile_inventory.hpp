// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "tile/format/tile_address.hpp"
#include "tile/format/tile_layer.hpp"

namespace terrace::terrain {

/// The files of a tile set in its folder.
struct TileInventory {
  /// The existing tiles per zoom, sorted by row, then column.
  std::vector<std::vector<TileAddress>> tiles;
  std::vector<stream::Problem> problems;
  /// Temporary files of a killed run, which are not part of the set.
  std::uint64_t torn = 0;
};

/// Compares layer.json with the files: each listed tile must exist, and each existing tile must be
/// listed once. Throws: stream::Error if the folder cannot be read; stream::Stopped.
TileInventory take_inventory(const std::string& folder, const TileLayer& layer,
                             const Context& context);

}  // namespace terrace::terrain
