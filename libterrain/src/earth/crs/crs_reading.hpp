// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/proj_object.hpp"

namespace terrace::terrain {

/// Takes a CRS of any kind apart, as it stands: no code is looked for, none is checked.
/// Throws: CrsError for a kind that has no place in a plane.
CrsDefinition read_crs(const PJ* crs);
/// The vertical part. Throws: CrsError if it is not one of heights.
void read_vertical_crs(const PJ* crs, CrsDefinition& definition);
/// An EPSG code that is written in the definition must not contradict it; a definition without a
/// code gets the one that means the same, if there is exactly one. Either way the code's own
/// definition is taken. Throws: ContradictoryCrs.
void settle_code(CrsDefinition& definition);

/// The projection as a pipeline of PROJ's, from longitudes and latitudes of the geographic system
/// in its own unit and from its own meridian, to x and y. Throws: CrsError.
std::string proj_pipeline_of(const CrsDefinition& definition);

}  // namespace terrace::terrain
