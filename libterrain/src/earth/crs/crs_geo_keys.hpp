// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "earth/crs/crs_definition.hpp"

namespace terrace::terrain {

/// The keys beside an EPSG code must not say anything else than `definition`, which is the code's:
/// kind, unit, geographic system, parameters. Throws: CrsError, naming both.
void check_geo_keys(const stream::Crs& crs, const CrsDefinition& definition);

}  // namespace terrace::terrain
