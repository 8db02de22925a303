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
  /// Per zoom the tiles that are there, sorted by row, then column.
  std::vector<std::vector<TileAddress>> tiles;
  std::vector<stream::Problem> problems;
  /// Files that a killed run was writing: beside the set, not in it.
  std::uint64_t torn = 0;
};

/// Compares layer.json with the files: each tile that it names is there, each that is there is
/// named once. Throws: stream::Error if the folder cannot be read;
/// stream::Stopped.
TileInventory take_inventory(const std::string& folder, const TileLayer& layer,
                             const Context& context);

}  // namespace terrace::terrain
