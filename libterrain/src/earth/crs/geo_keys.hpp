// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "earth/crs/definition.hpp"

/// GeoTIFF keys by their numbers: OGC 19-008r4 (GeoTIFF 1.1), annex; 2062 is GDAL's.

namespace terrace::terrain {

/// Returns the system that GeoTIFF keys without an EPSG code describe by parameters. Throws:
/// CrsError.
CrsDefinition definition_of_geo_keys(const stream::Crs& crs);

/// Checks that the keys next to an EPSG code do not contradict `definition`, the definition of the
/// code. Compares kind, unit, geographic system and parameters. Throws: CrsError, naming the key
/// and the code.
void check_geo_keys(const stream::Crs& crs, const CrsDefinition& definition);

/// Returns the keys for a system without an EPSG code: its ellipsoid and unit, or its WKT in ESRI's
/// form in a citation, which GDAL and definition_of() read.
std::vector<stream::GeoKey> geo_keys_of(const CrsDefinition& definition);

}  // namespace terrace::terrain
