// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "format/raster_points.hpp"
#include "terrace/stream/raster.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// The georeference assumed for a raster without one: cells of 1 x 1 with y = -row.
inline constexpr WorldTransform kPlainWorld{{1, 0, 0, 0, -1, 0}};
/// The corresponding comment.
inline const std::string kNoGeoreferencing =
    "no georeferencing: a plain grid with cells of 1 x 1, y = -row";

/// A world file next to a raster: six numbers that map column and row to the centre of a cell.
struct WorldFile {
  std::string name;
  WorldTransform world;
};

/// Returns the world file of a raster, under the names that GDAL looks for: NAME.tfw, NAME.tifw or
/// NAME.wld for NAME.tif, in lower or upper case. nullopt if there is none. Throws: Error if it is
/// damaged.
std::optional<WorldFile> world_file_of(const std::string& file);

/// Georeferences a raster that is not georeferenced itself (see kNoGeoreferencing) by its world
/// file, if it has one. Throws: as world_file_of().
void place_by_world_file(const std::string& file, RasterInfo& info);

/// Opens a raster and applies GDAL's sidecar FILE.aux.xml, if it exists: the CRS, the
/// georeferencing, and the band's nodata value, scale, offset and unit. As in GDAL, the sidecar
/// overrides a GeoTIFF except for scale and offset, adds only what files of other formats lack, and
/// is ignored for virtual rasters. Notes report differences; a comment reports a sidecar that
/// cannot be read.
std::unique_ptr<Raster> open_with_aux_xml(const OpenRaster& open, const std::string& file,
                                          const RasterOptions& options);

}  // namespace terrace::stream
