// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "earth/crs/projection.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// A CRS that cannot be used as described: unknown, incomplete or contradictory. what() is the
/// cause.
class CrsError : public std::runtime_error {
 public:
  CrsError(const std::string& cause, stream::Message remedy)
      : std::runtime_error(cause), remedy_(std::move(remedy)) {}
  [[nodiscard]] const stream::Message& remedy() const { return remedy_; }

 private:
  stream::Message remedy_;
};

/// Returns the usual remedy for a CRS that cannot be used.
inline stream::Message remedy_by_code() {
  return stream::message("name the system by its code: {crs} EPSG:n");
}

/// PROJ's database was not found, or reading it failed. Then every system looks unknown, which must
/// not be reported as an unknown system.
class CrsDatabaseError : public stream::Error {
 public:
  using stream::Error::Error;
};

/// A definition that contradicts itself; the user must say which part is meant.
class ContradictoryCrs : public CrsError {
 public:
  using CrsError::CrsError;
};

/// Name that GDAL gives a vertical system if only its unit is known.
inline constexpr char kUnknownHeights[] = "unknown";

/// Returns the name of a unit that metres_in_unit() knows, such as "metre", "foot" or "US survey
/// foot"; empty for other units.
std::string unit_name(double metres);
/// As unit_name(), but returns a number such as "0.3047995 m" for other units, so that every record
/// names a unit.
std::string recorded_unit(double metres);
/// Returns the plural of a unit's name: "feet", "US survey feet", "metres".
std::string plural_unit(const std::string& unit);

/// Returns "ellipsoidal", "orthometric" or an empty string, as stores record it.
std::string name_of(Heights heights);

/// The parts of a CRS as plain data, read from PROJ. Angles are in degrees, lengths in metres.
struct CrsDefinition {
  /// The horizontal system's code, such as "EPSG" and "32632"; empty if it has none.
  std::string authority, code;
  std::string name;
  std::string wkt;  ///< WKT 2 of the horizontal system without heights
  bool geographic = true;

  std::string base_wkt;  ///< WKT of the underlying geographic system, without heights
  int base_epsg = 0;     ///< 0: no code
  std::string datum;
  Ellipsoid ellipsoid;
  double prime_meridian = 0.0;
  double degrees_per_unit = 1;  ///< per unit of the geographic system's coordinates
  double metres_per_unit = 1;   ///< per unit of a projected system's coordinates
  /// A shift given with the system, by TOWGS84 or --towgs84; it overrides all operations of the
  /// database.
  std::optional<DatumShift> shift;

  /// The projection, if GeographicLib computes it (projection_engine.hpp); PROJ computes the others
  /// from `wkt`.
  std::optional<ProjectionMethod> method;
  ProjectionParameters parameters;

  Heights heights = Heights::unknown;
  /// WKT of a vertical system, or of a horizontal system with a third axis.
  std::string height_wkt;
  std::string vertical_name;
  int vertical_epsg = 0;
  double metres_per_height = 0;  ///< 0: unknown

  /// The code if its authority is EPSG; otherwise 0.
  [[nodiscard]] int epsg() const;
  /// A title such as "EPSG:32632 (WGS 84 / UTM zone 32N)", "\"ETRS89 / LCC\"" or "without a name".
  [[nodiscard]] std::string title() const;
};

/// A local (engineering) system, which has units but no place on the earth, or a geocentric system.
/// Geocentric x, y and z are measured from the centre of the earth, so z is not a height. Stores
/// treat the points of both in the same way.
struct LocalCrs {
  stream::Crs crs;  ///< the record of this system in stores
  bool is_geocentric = false;
};
/// A system of any kind.
using AnyCrs = std::variant<CrsDefinition, LocalCrs>;
/// Returns the definition of a system on the earth. Throws: CrsError for a local one.
CrsDefinition on_earth(AnyCrs system);

/// Reads the text of a user: anything that a file may contain (see crs_of_contents), or the name of
/// a file. Throws: CrsError.
AnyCrs crs_of_text(const std::string& text);
/// Reads the contents of a file, which never refer to another file: WKT (version 1 by OGC, GDAL or
/// ESRI, or version 2), PROJJSON, a PROJ string, a code such as "EPSG:32632+5773" or "ESRI:54030",
/// a URN or URL of the OGC, or a name. Refuses text of more than 64 KiB, 512 parts or 32 levels.
/// Throws: CrsError.
AnyCrs crs_of_contents(const std::string& text);
/// Reads contents as crs_of_contents() does, for a system that must be on the earth.
inline CrsDefinition definition_of_contents(const std::string& text) {
  return on_earth(crs_of_contents(text));
}
/// Returns the contents of such a file, without a byte order mark and surrounding white space. If
/// the file is too large, returns only enough of it for crs_of_contents() to refuse it.
std::string contents_of_file(const std::string& name);
/// Returns the system of an EPSG code: geographic, projected, compound or geocentric. Throws:
/// CrsError.
AnyCrs crs_of_epsg(int code);
inline CrsDefinition definition_of_epsg(int code) { return on_earth(crs_of_epsg(code)); }
/// Sets the vertical part to the system of a vertical EPSG code. Throws: CrsError.
void set_vertical_epsg(CrsDefinition& definition, int code);
/// Marks the reference surface of heights as unknown.
void forget_heights(CrsDefinition& definition);
/// Writes a unit of heights, given in metres, into the definition's WKT. Adds a vertical system
/// named "unknown" if none is known.
void write_height_unit(CrsDefinition& definition, double metres);
/// Returns the WKT of a local system with a unit of heights, given in metres.
std::string with_height_unit(const stream::Crs& local, double metres);
/// Returns the system as WKT 2 (ISO 19162:2019), with a shift as a bound CRS.
std::string wkt_of(const CrsDefinition& definition);
/// Returns the system as WKT 1, as GDAL writes it. Reads the result back, and returns an empty
/// string if WKT 1 cannot express the system.
std::string wkt1_of(const CrsDefinition& definition);
/// Whether both texts, when read, have the same code, places and kind of heights.
bool mean_the_same(const std::string& wkt, const std::string& other);

/// Reads the CRS that a source or a store records, in whatever form. Returns nullopt if there is no
/// CRS. Throws: CrsError.
std::optional<AnyCrs> crs_of_record(const stream::Crs& crs);
/// As crs_of_record(), but also returns nullopt for a local or geocentric system.
std::optional<CrsDefinition> definition_of(const stream::Crs& crs);
/// As crs_of_record(), but returns nullopt for a system on the earth.
std::optional<LocalCrs> local_crs_of(const stream::Crs& crs);

/// Whether both systems are equal apart from their names, so that equal coordinates are equal
/// places on the earth.
bool same_places(const CrsDefinition& a, const CrsDefinition& b);
/// Whether both have the same datum, ignoring prime meridians, so that no operation is needed.
bool same_datum(const CrsDefinition& a, const CrsDefinition& b);

}  // namespace terrace::terrain
