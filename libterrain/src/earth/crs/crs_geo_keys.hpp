// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "earth/crs/crs_definition.hpp"

/// The keys of a GeoTIFF by their numbers: OGC 19-008r4 (GeoTIFF 1.1), annex; 2062 is GDAL's.

namespace terrace::terrain {

/// The system that the keys of a GeoTIFF describe by parameters (no EPSG code in them).
/// Throws: CrsError.
CrsDefinition definition_of_geo_keys(const stream::Crs& crs);

/// The keys beside an EPSG code must not say anything else than `definition`, which is the code's:
/// kind, unit, geographic system, parameters. Throws: CrsError, naming both.
void check_geo_keys(const stream::Crs& crs, const CrsDefinition& definition);

/// The keys for a system without an EPSG code: its ellipsoid and unit, or its WKT as ESRI writes it
/// into a citation, which GDAL and definition_of() read.
std::vector<stream::GeoKey> geo_keys_of(const CrsDefinition& definition);

}  // namespace terrace::terrain
