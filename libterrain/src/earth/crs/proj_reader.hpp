// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "earth/crs/definition.hpp"
#include "earth/crs/proj_object.hpp"

namespace terrace::terrain {

/// Reads a CRS of any kind into its parts, without looking up or checking a code. Throws: CrsError
/// for a kind that is not on a plane.
AnyCrs read_crs(const PJ* crs);
/// As read_crs(), for a CRS that must be on the earth.
inline CrsDefinition read_definition(const PJ* crs) { return on_earth(read_crs(crs)); }
/// Reads the vertical part. Throws: CrsError for a CRS that does not measure heights.
void read_vertical_crs(const PJ* crs, CrsDefinition& definition);
/// Replaces a definition by the definition of its EPSG code. A code in the definition must not
/// contradict it. A definition without a code gets the equivalent code if there is exactly one.
/// Throws: ContradictoryCrs.
void settle_code(CrsDefinition& definition);

}  // namespace terrace::terrain
