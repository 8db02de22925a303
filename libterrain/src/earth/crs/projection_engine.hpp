// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "earth/crs/definition.hpp"
#include "earth/crs/proj_object.hpp"
#include "earth/crs/projection.hpp"

/// The choice between GeographicLib and PROJ. The table in projection_engine.cpp alone decides
/// which of them computes a projection:
///
/// | computed                                              | by            |
/// |---|---|
/// | a projection whose method is in the table             | GeographicLib |
/// | any other projection                                  | PROJ          |
/// | a change of datum (DatumChange)                       | PROJ          |
/// | a geoid from the database (EllipsoidalHeights)        | PROJ          |
/// | a geoid from a grid file of GeographicLib (GeoidGrid) | GeographicLib |
/// | geodesics (LineDistance)                              | GeographicLib |
///
/// The other rows have one engine each: GeographicLib has neither the database's operations nor
/// their grids, and its geodesics are exact everywhere.

namespace terrace::terrain {

/// A method that GeographicLib computes, with its parameters.
struct GeographicLibProjection {
  ProjectionMethod method;
  ProjectionParameters parameters;
};
/// Returns the projection if GeographicLib computes it; nullopt if PROJ does. first, second: the
/// directions of the projected system's axes, such as "east" and "north".
std::optional<GeographicLibProjection> geographiclib_projection(const PJ* conversion,
                                                                std::string_view first,
                                                                std::string_view second);

/// Returns the projection of a projected system: from longitudes (from its prime meridian) and
/// latitudes in degrees to metres. Throws: CrsError.
std::shared_ptr<const Projection> projection_of(const CrsDefinition& definition);
/// As projection_of(), but PROJ always computes it.
std::shared_ptr<const Projection> proj_projection_of(const CrsDefinition& definition);
/// Returns the projection as a PROJ pipeline, from longitudes and latitudes of the geographic
/// system, in its own unit and from its own meridian, to x and y. Throws: CrsError.
std::string proj_pipeline_of(const CrsDefinition& definition);

}  // namespace terrace::terrain
