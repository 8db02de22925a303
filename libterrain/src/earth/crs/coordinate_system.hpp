// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/datum_change.hpp"
#include "earth/crs/projection.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::terrain {

/// A coordinate reference system: what x and y mean on the earth. Definitions and datums are
/// PROJ's, projections GeographicLib's where it has them, else PROJ's.
///
/// x is always the longitude or easting, y the latitude or northing, in the system's own units
/// (degrees, metres, feet). To WGS 84 leads one operation for the whole area; to_wgs84() names it.
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
  /// (.prj, .wkt). shift: of `--towgs84`, for a datum that does not count as WGS 84; it goes before
  /// PROJ's operations. Throws: UsageError, naming the code or text and the remedy.
  static CoordinateSystem parse(const std::string& text,
                                const std::optional<DatumShift>& shift = std::nullopt);
  /// What a source or a store records. Nothing if it says nothing of a CRS.
  /// file: named in errors. Throws: stream::Error for one that is unknown, incomplete, or says two
  /// things that contradict each other.
  static std::optional<CoordinateSystem> of(const stream::Crs& crs, const std::string& file);
  /// The same system for data that lie in a box of it: operations are chosen for that area.
  [[nodiscard]] CoordinateSystem over(const stream::Box3& box) const;

  [[nodiscard]] const CrsDefinition& definition() const { return data_->definition; }
  [[nodiscard]] bool is_geographic() const { return definition().geographic; }
  /// "EPSG:32632 (WGS 84 / UTM zone 32N)", "\"ETRS89 / LCC\"".
  [[nodiscard]] std::string title() const { return definition().title(); }
  /// Metres in a unit of x and y; 0 if geographic.
  [[nodiscard]] double metres_per_unit() const;
  [[nodiscard]] Heights heights() const { return definition().heights; }
  /// Metres in a unit of heights, if known.
  [[nodiscard]] std::optional<double> metres_per_height() const;

  /// As stores and files record it: code, name, WKT, units.
  [[nodiscard]] stream::Crs crs() const;
  /// The same with the GeoKeys that a system without an EPSG code needs in a GeoTIFF.
  [[nodiscard]] stream::Crs crs_with_keys() const;

  /// The way to WGS 84, found when it is first asked for.
  [[nodiscard]] const DatumChange& to_wgs84() const;
  /// What the user should know of it: "EPSG:... to WGS 84 by \"...\" within 2 m"; empty if nothing
  /// is done or nothing can be.
  [[nodiscard]] std::string wgs84_note() const;
  /// Whether longitudes and latitudes of WGS 84 can be had.
  [[nodiscard]] bool reaches_wgs84() const { return to_wgs84().possible(); }
  /// Whether those of its own datum are taken as they are.
  [[nodiscard]] bool counts_as_wgs84() const {
    return to_wgs84().possible() && to_wgs84().identity();
  }

  /// x, y to longitude and latitude of WGS 84 in degrees, in place, and back. What has no place
  /// there becomes NaN. Longitudes lie in [-180, 180], but those of a geographic system that counts
  /// as WGS 84 are left as they are (0 to 360 stays so). 0.6 to 5 million places per second.
  /// Throws: stream::Error if no operation leads there.
  void to_geographic(std::span<Point2> places) const;
  void from_geographic(std::span<Point2> places) const;
  [[nodiscard]] Point2 to_geographic(Point2 place) const;
  [[nodiscard]] Point2 from_geographic(Point2 place) const;

  /// The same on the system's own datum and ellipsoid (from Greenwich): no shift, no condition.
  void to_own_geographic(std::span<Point2> places) const;
  void from_own_geographic(std::span<Point2> places) const;

  /// Whether both are the same system but for names: coordinates need no conversion.
  [[nodiscard]] bool same_places(const CoordinateSystem& other) const;
  /// Where the data lie, if over() said it; on the system's own datum.
  [[nodiscard]] const std::optional<GeographicArea>& area() const { return area_; }

 private:
  struct Data {
    CrsDefinition definition;
    std::shared_ptr<const Projection> projection;  ///< none: geographic
  };
  struct LazyChange;

  std::shared_ptr<const Data> data_;
  std::optional<GeographicArea> area_;
  std::shared_ptr<LazyChange> wgs84_;
};

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
  DatumChange change_;
};

/// x, y of `from` to x, y of `to`, in place; nothing is done where they are the same. For many
/// calls a Transformation is faster. Throws: as Transformation.
void transform(const CoordinateSystem& from, const CoordinateSystem& to, std::span<Point2> places);

/// "dx,dy,dz" or "dx,dy,dz,rx,ry,rz,ds" of `--towgs84`. Throws: UsageError.
DatumShift parse_datum_shift(const std::string& text);

}  // namespace terrace::terrain
