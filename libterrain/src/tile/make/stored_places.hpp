// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "surface/store_window.hpp"
#include "terrace/terrain/crs.hpp"
#include "tile/format/tile_address.hpp"

namespace terrace::terrain {

/// Longitudes in [-180, 180], whatever turn they were in.
double wrapped_longitude(double longitude);

/// Where a store lies on the globe: its points, or the whole lattice of a raster. Const members may
/// be called by several threads at once.
class StoredPlaces {
 public:
  /// Throws: stream::Error if no place of the store can be told on the globe.
  StoredPlaces(const stream::Store& store, CoordinateSystem system);

  [[nodiscard]] const CoordinateSystem& crs() const { return crs_; }
  /// The bounds of all points, or of the lattice, in stored coordinates.
  [[nodiscard]] const StoredBox& stored_bounds() const { return stored_; }
  /// Around all of them on the globe, a little larger where the store is projected.
  [[nodiscard]] const GeographicBox& bounds() const { return bounds_; }
  /// West and east end of a store in degrees, in its own unit and turn: may go beyond 180 degrees.
  [[nodiscard]] std::array<double, 2> longitudes() const {
    return {first_longitude_, last_longitude_};
  }

  /// The boxes of stored coordinates outside of which no point of a geographic box lies: none if it
  /// does not meet bounds(). Two, apart from each other, where a store in degrees goes around the
  /// globe.
  [[nodiscard]] std::vector<StoredBox> windows(const GeographicBox& box) const;

  /// Stored x, y to longitude in [-180, 180] and latitude, in place; NaN: on no place.
  void to_geographic(std::span<Point2> places) const;
  /// Longitude and latitude to stored x, y, in place. Both numbers of the line of 180 degrees give
  /// the same; what has no place there goes to a corner outside stored_bounds().
  void to_stored(std::span<Point2> places) const;

 private:
  void find_bounds(const std::string& file);
  [[nodiscard]] Point2 world(const Point2& stored) const;
  [[nodiscard]] double in_turn(double longitude) const;

  CoordinateSystem crs_;
  stream::Placement placement_;
  StoredBox stored_;
  GeographicBox bounds_;
  /// For a store in degrees: its range of longitudes, and a full turn in its unit.
  double first_longitude_ = 0.0, last_longitude_ = 0.0, turn_ = 360.0;
  Point2 margin_{};  ///< stored: what converting there and back may be off, and more
};

}  // namespace terrace::terrain
