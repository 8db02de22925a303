// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "earth/crs/projection.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/crs.hpp"

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

/// PROJ's database is not found, or a read of it failed: nothing is known of any system, which must
/// not be taken for an unknown system.
class CrsDatabaseError : public stream::Error {
 public:
  using stream::Error::Error;
};

/// One that says two things at once: nothing may be done with it until it is known which is meant.
class ContradictoryCrs : public CrsError {
 public:
  using CrsError::CrsError;
};

/// A text that is not the definition or name of a system.
class UnreadableCrs : public CrsError {
 public:
  using CrsError::CrsError;
};

/// A local (engineering) system, which has a unit but no place on the earth.
class LocalCrs : public CrsError {
 public:
  explicit LocalCrs(const stream::Crs& crs)
      : LocalCrs(crs, "the CRS \"" + crs.name + "\" is a local one, without a place on the earth",
                 "name one that has: EPSG:n") {}
  /// As stores record it.
  [[nodiscard]] const stream::Crs& crs() const { return crs_; }

 protected:
  LocalCrs(stream::Crs crs, const std::string& cause, std::string remedy)
      : CrsError(cause, std::move(remedy)), crs_(std::move(crs)) {}

 private:
  stream::Crs crs_;
};

/// A geocentric system: x, y and z count from the middle of the earth, so z is not a height. Its
/// points are stored like those of a local system.
class GeocentricCrs : public LocalCrs {
 public:
  explicit GeocentricCrs(const stream::Crs& crs)
      : LocalCrs(crs,
                 "the CRS \"" + crs.name +
                     "\" is geocentric, with x, y and z from the middle of the earth",
                 "take a geographic or projected one, by `crs` where a file is mistaken; cs2cs "
                 "converts points") {}
};

/// The name of a vertical system of which only the unit is known, as GDAL writes it.
inline constexpr char kUnknownHeights[] = "unknown";

/// "metre", "foot", "US survey foot", ...: those that metres_in_unit() knows; else empty.
std::string unit_name(double metres);
/// "feet", "US survey feet", "metres".
std::string plural_unit(const std::string& unit);

/// "ellipsoidal", "orthometric", or empty: as stores record it.
std::string name_of(Heights heights);

/// A CRS taken apart: plain data, read from PROJ. Angles in degrees, lengths in metres.
struct CrsDefinition {
  /// The horizontal system's code, such as "EPSG" and "32632"; empty if it has none.
  std::string authority, code;
  std::string name;
  std::string wkt;  ///< of the horizontal system without heights, WKT 2
  bool geographic = true;

  std::string base_wkt;  ///< of the geographic system below, without heights
  int base_epsg = 0;     ///< 0: none
  std::string datum;
  Ellipsoid ellipsoid;
  double prime_meridian = 0.0;
  double degrees_per_unit = 1;  ///< of the geographic system's coordinates
  double metres_per_unit = 1;   ///< of a projected system's
  /// Said beside the system, by TOWGS84 or --towgs84: it goes before all operations of the
  /// database.
  std::optional<DatumShift> shift;

  /// The projection where GeographicLib has it; PROJ computes the others from `wkt`.
  std::optional<ProjectionMethod> method;
  ProjectionParameters parameters;

  Heights heights = Heights::unknown;
  /// Of a vertical system, or of the horizontal one with a third axis.
  std::string height_wkt;
  std::string vertical_name;
  int vertical_epsg = 0;
  double metres_per_height = 0;  ///< 0: unknown

  /// The code if it is EPSG's; else 0.
  [[nodiscard]] int epsg() const;
  /// "EPSG:32632 (WGS 84 / UTM zone 32N)", "\"ETRS89 / LCC\"", "without a name".
  [[nodiscard]] std::string title() const;
};

/// What the user writes: anything that a file may hold (see definition_of_contents), or the name of
/// a file. Throws: CrsError.
CrsDefinition definition_of_text(const std::string& text);
/// What a file holds, which never leads to another file: WKT (version 1, OGC's, GDAL's and ESRI's,
/// or 2), PROJJSON, a PROJ string, a code such as "EPSG:32632+5773", "ESRI:54030", a URN or URL of
/// the OGC, or a name. Text of more than 64 KiB, 512 parts or 32 levels is refused. Throws:
/// CrsError.
CrsDefinition definition_of_contents(const std::string& text);
/// The contents of such a file, without a byte order mark and white space around them; of a larger
/// file only as much as shows that it is too large.
std::string contents_of_file(const std::string& name);
/// The local or geocentric system that such a text describes; nothing if it is another or none.
std::optional<stream::Crs> local_crs_named(const std::string& text);
/// The same for what a source or a store says.
std::optional<stream::Crs> local_crs_of(const stream::Crs& crs);
/// The system of an EPSG code: geographic, projected or compound. Throws: CrsError.
CrsDefinition definition_of_epsg(int code);
/// Sets the vertical part from the code of a vertical system. Throws: CrsError.
void set_vertical_epsg(CrsDefinition& definition, int code);
/// Leaves what heights refer to unsaid.
void forget_heights(CrsDefinition& definition);
/// Writes a unit of heights of that many metres into the definition's WKT, with a vertical system
/// named "unknown" if none is known.
void write_height_unit(CrsDefinition& definition, double metres);
/// The same for the WKT of a local system.
std::string with_height_unit(const stream::Crs& local, double metres);
/// The system as WKT 2 (ISO 19162:2019), with a shift as a bound CRS.
std::string wkt_of(const CrsDefinition& definition);
/// The same as WKT 1, as GDAL writes it; empty where that cannot say it, as is known by reading it.
std::string wkt1_of(const CrsDefinition& definition);
/// Whether both texts, when they are read, give the same code, places and kind of heights.
bool mean_the_same(const std::string& wkt, const std::string& other);

/// What a source or a store says, whichever way; nothing if it says nothing of a CRS, or names a
/// local or geocentric one. Throws: CrsError.
std::optional<CrsDefinition> definition_of(const stream::Crs& crs);

/// The projection of a system that is not geographic: from longitudes (from its prime meridian) and
/// latitudes in degrees to metres. Throws: CrsError.
std::shared_ptr<const Projection> projection_of(const CrsDefinition& definition);
/// The same, by PROJ whatever the method.
std::shared_ptr<const Projection> proj_projection_of(const CrsDefinition& definition);

/// Whether coordinates of both mean the same places on the earth's surface, but for names.
bool same_places(const CrsDefinition& a, const CrsDefinition& b);
/// Whether both have the same datum, prime meridians aside: no operation leads from one to the
/// other.
bool same_datum(const CrsDefinition& a, const CrsDefinition& b);

}  // namespace terrace::terrain
