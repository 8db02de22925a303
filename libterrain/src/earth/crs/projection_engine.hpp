// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "earth/crs/definition.hpp"
#include "earth/crs/proj_object.hpp"
#include "earth/crs/projection.hpp"

/// The choice between GeographicLib and PROJ. GeographicLib computes a projection if its method is
/// in the table of projection_engine.cpp and its axes and parameters are ones that it supports;
/// PROJ computes all others.
///
/// | computed                                              | by            |
/// |---|---|
/// | a projection that GeographicLib supports              | GeographicLib |
/// | any other projection                                  | PROJ          |
/// | a change of datum (DatumChange)                       | PROJ          |
/// | a geoid from the database (EllipsoidalHeights)        | PROJ          |
/// | a geoid from a grid file of GeographicLib (GeoidGrid) | GeographicLib |
/// | geodesics (LineDistance)                              | GeographicLib |
///
/// For everything else the engine is fixed. GeographicLib has no datum operations or grids of the
/// EPSG database; its geodesics are accurate for any two points.

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
/// system, in that system's angular unit, counted from its prime meridian, to x and y. Throws:
/// CrsError.
std::string proj_pipeline_of(const CrsDefinition& definition);

}  // namespace terrace::terrain
