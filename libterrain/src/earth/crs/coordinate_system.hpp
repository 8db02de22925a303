// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/projection.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::terrain {

/// A coordinate reference system: what x and y mean on the earth.
///
/// x is always the longitude or easting, y the latitude or northing, in the system's own units
/// (degrees, metres, feet). WGS 84 stands for the datums within a few metres of it (ETRS89, NAD83,
/// GDA2020, ...), which are not told apart: uncertainty() says what that may cost. Systems of other
/// datums (ED50, OSGB36, ...) have only their own longitudes and latitudes unless they were given a
/// shift to WGS 84.
///
/// Copies are cheap; const members may be called by several threads at once.
class CoordinateSystem {
 public:
  /// EPSG:4326.
  CoordinateSystem();
  explicit CoordinateSystem(const CrsDefinition& definition);

  /// What a user writes: "EPSG:n", "EPSG:n+m" (horizontal and vertical), WKT, or the name of a file
  /// with WKT (.prj, .wkt). shift: of `--towgs84`, for a datum that is not WGS 84's.
  /// Throws: UsageError, naming the code or text and the remedy.
  static CoordinateSystem parse(const std::string& text,
                                const std::optional<DatumShift>& shift = std::nullopt);
  /// What a source or a store records. Nothing if it says nothing of a CRS.
  /// file: named in errors. Throws: stream::Error for one that is unknown, incomplete, or says two
  /// things that contradict each other.
  static std::optional<CoordinateSystem> of(const stream::Crs& crs, const std::string& file);

  [[nodiscard]] const CrsDefinition& definition() const { return definition_; }
  [[nodiscard]] bool is_geographic() const { return !definition_.method.has_value(); }
  /// "EPSG:32632 (WGS 84 / UTM zone 32N)", "\"ETRS89 / LCC\"".
  [[nodiscard]] std::string title() const;
  /// Metres in a unit of x and y; 0 if geographic.
  [[nodiscard]] double metres_per_unit() const;
  [[nodiscard]] Heights heights() const { return definition_.heights; }
  /// Metres in a unit of heights, if known.
  [[nodiscard]] std::optional<double> metres_per_height() const;

  /// As stores and files record it: code, name, WKT, units.
  [[nodiscard]] stream::Crs crs() const;

  /// Whether longitudes and latitudes of WGS 84 can be had.
  [[nodiscard]] bool reaches_wgs84() const;
  /// Metres by which the datum may differ from WGS 84; 0 if it is not another one, or was shifted.
  [[nodiscard]] double uncertainty() const;

  /// x, y to longitude and latitude of WGS 84 in degrees, in place, and back. What has no place
  /// there becomes NaN. Longitudes lie in [-180, 180], but those of a geographic system in degrees
  /// are left as they are (0 to 360 stays so). Some 2 to 5 million places per second.
  /// Throws: stream::Error if the datum is another and has no shift.
  void to_geographic(std::span<Point2> places) const;
  void from_geographic(std::span<Point2> places) const;
  [[nodiscard]] Point2 to_geographic(Point2 place) const;
  [[nodiscard]] Point2 from_geographic(Point2 place) const;

  /// The same on the system's own datum and ellipsoid (from Greenwich): no shift, no condition.
  void to_own_geographic(std::span<Point2> places) const;
  void from_own_geographic(std::span<Point2> places) const;

  /// Whether both are the same system but for names: coordinates need no conversion.
  [[nodiscard]] bool same_places(const CoordinateSystem& other) const;

 private:
  struct Shift;
  void require_wgs84() const;

  CrsDefinition definition_;
  std::shared_ptr<const Projection> projection_;  ///< none: geographic
  std::shared_ptr<const Shift> shift_;
};

/// x, y of `from` to x, y of `to`, in place; nothing is done where they are the same. Systems of
/// one datum need no shift. Throws: as to_geographic.
void transform(const CoordinateSystem& from, const CoordinateSystem& to, std::span<Point2> places);

/// "dx,dy,dz" or "dx,dy,dz,rx,ry,rz,ds" of `--towgs84`. Throws: UsageError.
DatumShift parse_datum_shift(const std::string& text);

}  // namespace terrace::terrain
