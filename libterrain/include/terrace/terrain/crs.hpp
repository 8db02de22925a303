// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <terrace/base/stop_check.hpp>
#include <terrace/stream/message.hpp>
#include <terrace/stream/point.hpp>
#include <terrace/stream/source.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/region.hpp"

/// Coordinate reference systems and conversions between them.

namespace terrace::terrain {

struct CrsDefinition;
class DatumChange;

/// The reference surface of heights.
enum class Heights : std::uint8_t {
  unknown,
  ellipsoidal,  ///< the ellipsoid
  orthometric,  ///< mean sea level, from a geoid or levelling
};

/// Shift to WGS 84's geocentric axes: translation in metres, rotation in arc-seconds and scale in
/// parts per million, as a position vector transformation (EPSG 9606), in the order of TOWGS84 in
/// WKT.
using DatumShift = std::array<double, 7>;

/// An area in degrees. west is greater than east if the area crosses the antimeridian.
struct GeographicArea {
  double west = 0, south = 0, east = 0, north = 0;
};

/// A coordinate reference system: what x and y mean on the earth. PROJ provides definitions and
/// datums. GeographicLib computes the projections that it supports, PROJ the others.
///
/// x is always the longitude or easting and y the latitude or northing, in the system's own units
/// (degrees, metres, feet). A single operation for the whole area converts to WGS 84; wgs84_note()
/// names it.
///
/// Copies are cheap. Several threads may call const members at once.
class CoordinateSystem {
 public:
  /// EPSG:4326.
  CoordinateSystem();
  /// Throws: CrsError if the projection cannot be computed.
  explicit CoordinateSystem(const CrsDefinition& definition);

  /// Reads a CRS as users write it: "EPSG:n", "EPSG:n+m" (horizontal and vertical), a code of
  /// another authority ("ESRI:54030"), a name, WKT, PROJJSON, or the name of a file with WKT or
  /// PROJJSON (.prj, .wkt). shift: the shift of a datum that does not count as WGS 84. It overrides
  /// PROJ's operations. Throws: UsageError, naming the code or text and the remedy.
  static CoordinateSystem parse(const std::string& text,
                                const std::optional<DatumShift>& shift = std::nullopt);
  /// Reads a CRS as a source or store records it. Returns nullopt if `crs` does not name one.
  /// file: named in errors. Throws: stream::Error if the CRS is unknown, incomplete or contradicts
  /// itself.
  static std::optional<CoordinateSystem> of(const stream::Crs& crs, const std::string& file);
  /// Returns the same system for data inside a box; operations are chosen for that area.
  [[nodiscard]] CoordinateSystem over(const stream::Box3& box) const;

  [[nodiscard]] bool is_geographic() const;
  /// A title such as "EPSG:32632 (WGS 84 / UTM zone 32N)" or "\"ETRS89 / LCC\"".
  [[nodiscard]] std::string title() const;
  /// Metres per unit of x and y; 0 if geographic.
  [[nodiscard]] double metres_per_unit() const;
  /// The y of the north pole if y is a latitude, otherwise infinite.
  [[nodiscard]] double most_latitude() const;
  /// Length of a full turn around the earth along x, in its unit: 360 degrees, or the width of a
  /// Mercator map; 0 if x does not go around the earth.
  [[nodiscard]] double turn() const;
  [[nodiscard]] Heights heights() const;
  /// Metres per unit of height, if known.
  [[nodiscard]] std::optional<double> metres_per_height() const;

  /// The record of this system in stores and files: code, name, WKT, units.
  [[nodiscard]] stream::Crs crs() const;
  /// The record of crs() with the GeoKeys that a system without an EPSG code needs in a GeoTIFF.
  [[nodiscard]] stream::Crs crs_with_keys() const;
  /// The record of crs() with WKT 1 (OGC 01-009), which LAS requires, or with WKT 2 if WKT 1 cannot
  /// express the system.
  [[nodiscard]] stream::Crs crs_with_wkt1() const;

  /// Returns a note for the user on the conversion: "EPSG:... to WGS 84 by \"...\" within 2 m";
  /// empty if no conversion is needed or possible.
  [[nodiscard]] std::string wgs84_note() const;
  /// Whether longitudes and latitudes of WGS 84 can be computed.
  [[nodiscard]] bool reaches_wgs84() const;
  /// Whether longitudes and latitudes of the CRS's datum are used as WGS 84 without a shift.
  [[nodiscard]] bool counts_as_wgs84() const;

  /// Convert x, y to longitude and latitude of WGS 84 in degrees, in place, and back. Places
  /// without an image, such as a latitude beyond a pole, become NaN. Longitudes are in [-180, 180],
  /// except that a geographic system that counts as WGS 84 keeps its own (0 to 360 stays so). 0.6
  /// to 5 million places per second. Throws: stream::Error if no operation leads to WGS 84.
  void to_geographic(std::span<Point2> places) const;
  void from_geographic(std::span<Point2> places) const;
  [[nodiscard]] Point2 to_geographic(Point2 place) const;
  [[nodiscard]] Point2 from_geographic(Point2 place) const;

  /// As to_geographic() and from_geographic(), but on the system's own datum and ellipsoid, from
  /// Greenwich and without a shift.
  void to_own_geographic(std::span<Point2> places) const;
  void from_own_geographic(std::span<Point2> places) const;

  /// Whether both systems are equal apart from their names, so that coordinates need no conversion.
  [[nodiscard]] bool same_places(const CoordinateSystem& other) const;
  /// The area of the data on the system's own datum, if over() set it.
  [[nodiscard]] const std::optional<GeographicArea>& area() const { return area_; }

  /// The definition that this library computes with.
  [[nodiscard]] const CrsDefinition& definition() const;
  /// The change of datum to WGS 84, computed on first use.
  [[nodiscard]] const DatumChange& to_wgs84() const;

 private:
  struct Data;
  struct LazyChange;

  std::shared_ptr<const Data> data_;
  std::optional<GeographicArea> area_;
  std::shared_ptr<LazyChange> wgs84_;
};

/// Whether both records describe the same system of places and heights. One may be a code, WKT of
/// any version or GeoKeys, with or without explicit units. Unknown systems match only if their
/// descriptions are equal. Can serve as stream::SourceOptions::same_crs.
bool same_crs(const stream::Crs& a, const stream::Crs& b);

/// Returns a CRS named as for CoordinateSystem::parse(), or a local (engineering) system, in the
/// form that stores and files record. Throws: UsageError.
stream::Crs crs_named(const std::string& text);

/// Converts from one system to another, by a single operation between their datums.
class Transformation {
 public:
  /// Chooses the operation for the area of the first system that has an area.
  /// Throws: stream::Error if no operation leads from one datum to the other.
  Transformation(CoordinateSystem from, CoordinateSystem to);

  /// Convert x, y in place; NaN where a place has no image.
  void forward(std::span<Point2> places) const;
  void reverse(std::span<Point2> places) const;

  [[nodiscard]] const CoordinateSystem& from() const { return from_; }
  [[nodiscard]] const CoordinateSystem& to() const { return to_; }
  /// Whether both systems are the same, so that nothing is converted.
  [[nodiscard]] bool identity() const { return same_; }
  /// Returns a note for the user on the operation; empty if coordinates stay on their datum.
  [[nodiscard]] std::string note() const;

 private:
  CoordinateSystem from_, to_;
  bool same_;
  std::shared_ptr<const DatumChange> change_;
};

/// Returns the CRS of a store. Throws: stream::Error if it has none, if it is unknown, or if a
/// latitude is beyond a pole. otherwise: a remedy to suggest for stores without a CRS, in addition
/// to naming it when the store is built.
CoordinateSystem system_of(const stream::Store& store, const stream::Message& otherwise = {});

/// Converts from a store's CRS to another, named as for CoordinateSystem::parse(), by the best
/// operation for the store's area. shift: belongs to the system whose datum does not count as WGS
/// 84, or to the named one if neither does. Throws: UsageError for an unknown CRS; stream::Error if
/// the store has no CRS, or if no operation leads from one datum to the other.
Transformation transformation_to(const stream::Store& store, const std::string& named,
                                 const std::optional<DatumShift>& shift = std::nullopt);

/// Converts regions, which may have another CRS, to the CRS of the data. A default-constructed
/// object leaves them unchanged. Longitudes may be off by whole turns. A box over a raster includes
/// cells within a millionth of a cell.
///
/// Unless one CRS is given for all regions, the caller's boxes and polygons are in the CRS of the
/// data, and GeoJSON is in the CRS that it names. GeoJSON that names none is in longitude and
/// latitude (RFC 7946) if the CRS of the data is known and the numbers can be degrees, otherwise in
/// the CRS of the data.
class RegionConversion {
 public:
  RegionConversion() = default;
  /// Assumes the store's CRS for regions that do not name one. shift: see transformation_to().
  explicit RegionConversion(const stream::Store& store,
                            const std::optional<DatumShift>& shift = std::nullopt);
  /// to_regions: from the store's CRS to the CRS of all regions.
  RegionConversion(const stream::Store& store, Transformation to_regions);
  /// For Region::restrict() of a source that is opened again. named: the CRS of the regions, as for
  /// CoordinateSystem::parse(). If it is empty, regions are in the CRS of the source, even if that
  /// is unknown. shift: the value of --towgs84. Throws: UsageError for an unknown name;
  /// stream::Error if no operation leads from one CRS to the other.
  explicit RegionConversion(const stream::SourceInfo& source, const std::string& named = {},
                            const std::optional<DatumShift>& shift = {});
  /// Returns false for a region that cannot be on the globe in angles of any unit. Such a region is
  /// already in the CRS of its data, so a source need not be opened to learn its CRS.
  static bool may_turn(const Region& region);
  /// Adds corners to outlines, including those of boxes, until they run within a millionth of their
  /// length of the true curve. Throws: stream::Error if an outline leaves the area of the other
  /// CRS, if a region's CRS is unknown, or if the data have no CRS.
  [[nodiscard]] Region operator()(Region region) const;
  /// Returns the conversion from the CRS of the data to the CRS of a GeoJSON file with places in
  /// `box`; nullopt if the file uses the CRS of the data. Throws: as above.
  [[nodiscard]] std::optional<Transformation> to_places(const PlacesCrs& places_crs,
                                                        const stream::Box3& box) const;
  /// Sets the function that receives notes: assumptions about the CRS of a GeoJSON file, and the
  /// operation that converts from it.
  void on_note(std::function<void(const std::string&)> note) { note_ = std::move(note); }
  /// Returns a note for the user on the conversion; empty if there is nothing to report.
  [[nodiscard]] std::string note() const { return to_regions_ ? to_regions_->note() : ""; }

 private:
  void say(const std::string& line) const {
    if (note_ && !line.empty()) note_(line);
  }

  bool overrides_ = false;  ///< one CRS for all regions, which overrides their own
  std::optional<Transformation> to_regions_;
  /// The system of the data, computed when needed.
  std::function<std::optional<CoordinateSystem>()> system_;
  std::function<void(const std::string&)> note_;
  stream::Box3 bounds_;
  Point2 tolerance_{};
  double turn_ = 0;  ///< a full turn of longitude; 0: no turns
};

/// Converts places of the store's CRS to another CRS. A default-constructed object leaves them
/// unchanged. Heights do not change.
class PlaceConversion {
 public:
  PlaceConversion() = default;
  explicit PlaceConversion(Transformation change);
  /// Longitudes continue beyond 180 degrees where the store crosses the antimeridian, so that
  /// neighbours stay together.
  PlaceConversion(Transformation change, const stream::Store& store);
  /// Converts x and y in place. Throws: stream::Error for a point without an image in the other
  /// CRS; whatever check_stop throws.
  void operator()(std::span<stream::Point3> points, const base::StopCheck& check_stop = {}) const;
  /// Converts in place; NaN where a place has no image.
  void operator()(std::span<Point2> places) const;
  /// Returns a box around the images of all places in `box`; empty if they have none.
  [[nodiscard]] stream::Box3 box_around(const stream::Box3& box) const;
  [[nodiscard]] bool has_effect() const { return change_.has_value(); }
  /// The CRS of the converted places; nullopt if places are left unchanged.
  [[nodiscard]] std::optional<stream::Crs> crs() const;

 private:
  std::optional<Transformation> change_;
  double turn_ = 0, middle_ = 0;  ///< longitudes to keep together; 0: no need
};

/// Parses "dx,dy,dz" or "dx,dy,dz,rx,ry,rz,ds"; nullopt if the text is empty. Throws: UsageError.
std::optional<DatumShift> parse_datum_shift(const std::string& text);

}  // namespace terrace::terrain
