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

#include <terrace/stream/point.hpp>
#include <terrace/stream/source.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/region.hpp"

/// Coordinate reference systems, and the ways between them.

namespace terrace::terrain {

struct CrsDefinition;
class DatumChange;

/// What heights refer to.
enum class Heights : std::uint8_t {
  unknown,
  ellipsoidal,  ///< the ellipsoid
  orthometric,  ///< mean sea level, by some geoid or levelling
};

/// To WGS 84's geocentric axes: translation in metres, rotation in arc-seconds and scale in parts
/// per million, as a position vector transformation (EPSG 9606), the order of TOWGS84 in WKT.
using DatumShift = std::array<double, 7>;

/// Degrees. west is greater than east across the antimeridian.
struct GeographicArea {
  double west = 0, south = 0, east = 0, north = 0;
};

/// A coordinate reference system: what x and y mean on the earth. Definitions and datums are
/// PROJ's, projections GeographicLib's where it has them, else PROJ's.
///
/// x is always the longitude or easting, y the latitude or northing, in the system's own units
/// (degrees, metres, feet). To WGS 84 leads one operation for the whole area; wgs84_note() names
/// it.
///
/// Copies are cheap; const members may be called by several threads at once.
class CoordinateSystem {
 public:
  /// EPSG:4326.
  CoordinateSystem();
  /// Throws: CrsError if the projection cannot be computed.
  explicit CoordinateSystem(const CrsDefinition& definition);

  /// What a user writes: "EPSG:n", "EPSG:n+m" (horizontal and vertical), a code of another
  /// authority ("ESRI:54030"), a name, WKT, PROJJSON, or the name of a file with one of these two
  /// (.prj, .wkt). shift: for a datum that does not count as WGS 84; it overrides PROJ's
  /// operations. Throws: UsageError, naming the code or text and the remedy.
  static CoordinateSystem parse(const std::string& text,
                                const std::optional<DatumShift>& shift = std::nullopt);
  /// What a source or a store records. nullopt if it does not name a CRS.
  /// file: named in errors. Throws: stream::Error for one that is unknown, incomplete, or says two
  /// things that contradict each other.
  static std::optional<CoordinateSystem> of(const stream::Crs& crs, const std::string& file);
  /// The same system for data that lie in a box of it: operations are chosen for that area.
  [[nodiscard]] CoordinateSystem over(const stream::Box3& box) const;

  [[nodiscard]] bool is_geographic() const;
  /// "EPSG:32632 (WGS 84 / UTM zone 32N)", "\"ETRS89 / LCC\"".
  [[nodiscard]] std::string title() const;
  /// Metres in a unit of x and y; 0 if geographic.
  [[nodiscard]] double metres_per_unit() const;
  /// The y of the north pole where y is a latitude, else infinite.
  [[nodiscard]] double most_latitude() const;
  /// What leads once around the earth along x, in its unit: 360 degrees, or the width of a
  /// Mercator map; 0 if x does not lead around.
  [[nodiscard]] double turn() const;
  [[nodiscard]] Heights heights() const;
  /// Metres in a unit of heights, if known.
  [[nodiscard]] std::optional<double> metres_per_height() const;

  /// As stores and files record it: code, name, WKT, units.
  [[nodiscard]] stream::Crs crs() const;
  /// The same with the GeoKeys that a system without an EPSG code needs in a GeoTIFF.
  [[nodiscard]] stream::Crs crs_with_keys() const;
  /// The same with WKT 1 (OGC 01-009), which LAS asks for; with WKT 2 where that cannot say it.
  [[nodiscard]] stream::Crs crs_with_wkt1() const;

  /// What the user should know of it: "EPSG:... to WGS 84 by \"...\" within 2 m"; empty if no
  /// conversion is needed or possible.
  [[nodiscard]] std::string wgs84_note() const;
  /// Whether longitudes and latitudes of WGS 84 can be had.
  [[nodiscard]] bool reaches_wgs84() const;
  /// Whether those of its own datum are taken as they are.
  [[nodiscard]] bool counts_as_wgs84() const;

  /// x, y to longitude and latitude of WGS 84 in degrees, in place, and back. What has no place
  /// there, as a latitude beyond a pole, becomes NaN. Longitudes lie in [-180, 180], but those of a
  /// geographic system that counts as WGS 84 are left as they are (0 to 360 stays so). 0.6 to 5
  /// million places per second. Throws: stream::Error if no operation leads there.
  void to_geographic(std::span<Point2> places) const;
  void from_geographic(std::span<Point2> places) const;
  [[nodiscard]] Point2 to_geographic(Point2 place) const;
  [[nodiscard]] Point2 from_geographic(Point2 place) const;

  /// The same on the system's own datum and ellipsoid (from Greenwich), without a shift.
  void to_own_geographic(std::span<Point2> places) const;
  void from_own_geographic(std::span<Point2> places) const;

  /// Whether both are the same system but for names: coordinates need no conversion.
  [[nodiscard]] bool same_places(const CoordinateSystem& other) const;
  /// Where the data lie, if over() said it; on the system's own datum.
  [[nodiscard]] const std::optional<GeographicArea>& area() const { return area_; }

  /// What this library knows it by.
  [[nodiscard]] const CrsDefinition& definition() const;
  /// The way to WGS 84, found when it is first asked for.
  [[nodiscard]] const DatumChange& to_wgs84() const;

 private:
  struct Data;
  struct LazyChange;

  std::shared_ptr<const Data> data_;
  std::optional<GeographicArea> area_;
  std::shared_ptr<LazyChange> wgs84_;
};

/// Whether both describe the same system of places and heights: by code or in full, in WKT of any
/// version or GeoKeys, with the units spelt out or not. Of systems that are not known only equal
/// descriptions do. For stream::SourceOptions::same_crs.
bool same_crs(const stream::Crs& a, const stream::Crs& b);

/// What is named as for CoordinateSystem::parse, or a local (engineering) system, as stores and
/// files record it. Throws: UsageError.
stream::Crs crs_named(const std::string& text);

/// From one system to another, by one operation between their datums.
class Transformation {
 public:
  /// The operation is chosen for the area of the first that has one.
  /// Throws: stream::Error if none leads from one datum to the other.
  Transformation(CoordinateSystem from, CoordinateSystem to);

  /// x, y in place; NaN where there is no place.
  void forward(std::span<Point2> places) const;
  void reverse(std::span<Point2> places) const;

  [[nodiscard]] const CoordinateSystem& from() const { return from_; }
  [[nodiscard]] const CoordinateSystem& to() const { return to_; }
  /// Whether nothing is done: both are the same.
  [[nodiscard]] bool identity() const { return same_; }
  /// What the user should know of the operation; empty if coordinates stay on their datum.
  [[nodiscard]] std::string note() const;

 private:
  CoordinateSystem from_, to_;
  bool same_;
  std::shared_ptr<const DatumChange> change_;
};

/// The CRS of a store. Throws: stream::Error if it has none, or one that is not known, or if a
/// latitude is beyond a pole. otherwise: what helps those without,
/// besides naming it when the store is built.
CoordinateSystem system_of(const stream::Store& store, const std::string& otherwise = {});

/// From a store's CRS to another, named as for CoordinateSystem::parse, by the operation that is
/// best where the store lies. shift: of the one whose datum does not count as WGS 84; of the named
/// one if neither does. Throws: UsageError for an unknown CRS, stream::Error if the store has
/// no CRS, or if nothing leads from one datum to the other.
Transformation transformation_to(const stream::Store& store, const std::string& named,
                                 const std::optional<DatumShift>& shift = std::nullopt);

/// Regions, of another CRS too, as regions in that of the data; made by default, it leaves them as
/// they are. Longitudes may be off by whole turns, and a box of a raster holds what is within a
/// millionth of a cell.
///
/// Unless a CRS is given for all regions, boxes and polygons of the caller's are in that of the
/// data, and GeoJSON is in the CRS that it names. GeoJSON that names none is in longitude and
/// latitude (RFC 7946) if the CRS of the data is known and its numbers can be that, else in the CRS
/// of the data.
class RegionConversion {
 public:
  RegionConversion() = default;
  /// Regions without a CRS of their own are in the store's. shift: see transformation_to().
  explicit RegionConversion(const stream::Store& store,
                            const std::optional<DatumShift>& shift = std::nullopt);
  /// to_regions: from the store's CRS to that of all regions.
  RegionConversion(const stream::Store& store, Transformation to_regions);
  /// For Region::restrict() of a source that is opened again. named: the CRS of the regions, as for
  /// CoordinateSystem::parse; empty: the source's own, be it known or not. shift: of --towgs84.
  /// Throws: UsageError for an unknown name, stream::Error if nothing leads from one CRS to the
  /// other.
  explicit RegionConversion(const stream::SourceInfo& source, const std::string& named = {},
                            const std::optional<DatumShift>& shift = {});
  /// False for a region that is nowhere on the globe in angles of any unit: in the CRS of its data
  /// it stays as it is, and a source need not be opened to learn its CRS.
  static bool may_turn(const Region& region);
  /// Outlines, a box's too, get so many corners that they run within a millionth of their length of
  /// the true curve. Throws: stream::Error if one leaves the places that the other CRS shows, or if
  /// a region's CRS is not known, or the data have none.
  [[nodiscard]] Region operator()(Region region) const;
  /// From the CRS of the data to that of a GeoJSON file, whose places are in `box`; nullopt if its
  /// places are in that of the data. Throws: as above.
  [[nodiscard]] std::optional<Transformation> to_places(const PlacesCrs& given,
                                                        const stream::Box3& box) const;
  /// Sets the function that receives notes: what was assumed about a GeoJSON file's CRS, and which
  /// operation converts from it.
  void on_note(std::function<void(const std::string&)> note) { note_ = std::move(note); }
  /// What the user should know of it; empty: nothing.
  [[nodiscard]] std::string note() const { return to_regions_ ? to_regions_->note() : ""; }

 private:
  void say(const std::string& line) const {
    if (note_ && !line.empty()) note_(line);
  }

  bool given_ = false;  ///< the CRS of all regions, whatever they say themselves
  std::optional<Transformation> to_regions_;
  std::function<std::optional<CoordinateSystem>()> system_;  ///< of the data, found when needed
  std::function<void(const std::string&)> note_;
  stream::Box3 bounds_;
  Point2 tolerance_{};
  double turn_ = 0;  ///< of longitudes; 0: none
};

/// Places of the store's CRS in another; made by default, it leaves them as they are. Heights stay.
class PlaceConversion {
 public:
  PlaceConversion() = default;
  explicit PlaceConversion(Transformation change);
  /// Longitudes go on beyond 180 degrees where the store lies across the antimeridian, so that
  /// neighbours stay together.
  PlaceConversion(Transformation change, const stream::Store& store);
  /// x and y in place. Throws: stream::Error for a point that has no place there.
  void operator()(std::span<stream::Point3> points) const;
  /// In place; NaN where there is no place.
  void operator()(std::span<Point2> places) const;
  /// A box around what becomes of the places in another; empty if they have none there.
  [[nodiscard]] stream::Box3 box_around(const stream::Box3& box) const;
  [[nodiscard]] bool has_effect() const { return change_.has_value(); }
  /// The CRS that it leads to; nullopt if it leaves places as they are.
  [[nodiscard]] std::optional<stream::Crs> crs() const;

 private:
  std::optional<Transformation> change_;
  double turn_ = 0, middle_ = 0;  ///< of longitudes that stay together; 0: they need not
};

/// "dx,dy,dz" or "dx,dy,dz,rx,ry,rz,ds"; nothing if the text is empty. Throws: UsageError.
std::optional<DatumShift> parse_datum_shift(const std::string& text);

}  // namespace terrace::terrain
