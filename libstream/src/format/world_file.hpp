// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// A world file next to a raster: six numbers that map column and row to the centre of a cell.
struct WorldFile {
  std::string name;
  WorldTransform world;
};

/// The world file of a raster, under the names that GDAL looks for: NAME.tfw, NAME.tifw or NAME.wld
/// for NAME.tif, in lower or upper case. nullopt if there is none. Throws: Error if it is damaged.
std::optional<WorldFile> world_file_of(const std::string& file);

/// Georeferences a raster that is not georeferenced itself (see kNoGeoreferencing) by its world
/// file, if it has one. Throws: as world_file_of().
void place_by_world_file(const std::string& file, RasterInfo& info);

}  // namespace terrace::stream
