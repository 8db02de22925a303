// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "earth/crs/projection.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::terrain {

/// A coordinate reference system that cannot be used as it is described: unknown, incomplete or
/// contradictory. what() is the cause.
class CrsError : public std::runtime_error {
 public:
  CrsError(const std::string& cause, std::string remedy)
      : std::runtime_error(cause), remedy_(std::move(remedy)) {}
  [[nodiscard]] const std::string& remedy() const { return remedy_; }

 private:
  std::string remedy_;
};

/// One that says two things at once: nothing may be done with it until it is known which is meant.
class ContradictoryCrs : public CrsError {
 public:
  using CrsError::CrsError;
};

/// What heights refer to.
enum class Heights : std::uint8_t {
  unknown,
  ellipsoidal,  ///< the ellipsoid
  orthometric,  ///< mean sea level, by some geoid or levelling
};
/// "ellipsoidal", "orthometric", or empty: as stores record it.
std::string name_of(Heights heights);

/// To WGS 84's geocentric axes: translation in metres, rotation in arc-seconds and scale in parts
/// per million, as a position vector transformation (EPSG 9606), the order of TOWGS84 in WKT.
using DatumShift = std::array<double, 7>;

/// A CRS taken apart. Angles in degrees, lengths in metres.
struct CrsDefinition {
  int epsg = 0;  ///< of the horizontal system; 0: none
  std::string name;

  int base_epsg = 0;  ///< of the geographic system below
  std::string base_name, datum;
  Ellipsoid ellipsoid;
  double prime_meridian = 0.0;
  /// Metres that positions may be off if the datum is taken as WGS 84; negative: another datum.
  double uncertainty = -1.0;
  std::optional<DatumShift> shift;

  std::optional<ProjectionMethod> method;  ///< none: geographic
  ProjectionParameters parameters;
  std::string conversion;       ///< name of the projection with its parameters
  double degrees_per_unit = 1;  ///< of a geographic system's coordinates
  double metres_per_unit = 1;   ///< of a projected system's

  Heights heights = Heights::unknown;
  int vertical_epsg = 0;
  std::string vertical_name;
  double metres_per_height = 0;  ///< 0: unknown
};

/// The system of an EPSG code: geographic, projected or compound. Throws: CrsError.
CrsDefinition definition_of_epsg(int code);
/// Sets the vertical part from the code of a vertical system. Throws: CrsError.
void set_vertical_epsg(CrsDefinition& definition, int code);
/// The system that WKT describes: version 1 (OGC, GDAL's and ESRI's) or 2. Throws: CrsError.
CrsDefinition definition_of_wkt(const std::string& text);
/// The system as WKT 2 (ISO 19162:2019), with a shift as a bound CRS.
std::string wkt_of(const CrsDefinition& definition);
/// The system that the keys of a GeoTIFF describe by parameters (no EPSG code in them).
/// Throws: CrsError.
CrsDefinition definition_of_geo_keys(const stream::Crs& crs);

/// What a source or a store says, whichever way; nothing if it says nothing of a CRS.
/// Throws: CrsError.
std::optional<CrsDefinition> definition_of(const stream::Crs& crs);

/// The datum by the name or the ellipsoid of it that files without codes use: uncertainty, and
/// base_epsg where there is one. Leaves another datum negative.
void recognise_datum(CrsDefinition& definition);

}  // namespace terrace::terrain
