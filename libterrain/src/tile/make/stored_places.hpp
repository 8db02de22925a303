// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "earth/geography.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/crs.hpp"
#include "tile/format/address.hpp"

namespace terrace::terrain {

/// Returns the same longitude in [-180, 180].
double wrapped_longitude(double longitude);

/// The location of a store's points, or of the lattice of a raster, on the globe. Several threads
/// may call const members at once.
class StoredPlaces {
 public:
  /// Throws: stream::Error if no place of the store has a longitude and latitude.
  StoredPlaces(const stream::Store& store, CoordinateSystem system);

  [[nodiscard]] const CoordinateSystem& crs() const { return crs_; }
  /// The bounds of all points, or of the lattice, in stored coordinates.
  [[nodiscard]] const StoredBox& stored_bounds() const { return stored_; }
  /// A box around all of them on the globe, slightly larger if the store is projected.
  [[nodiscard]] const GeographicBox& bounds() const { return bounds_; }
  /// The west and east end of a store in degrees, in its own unit and turn; they may be beyond the
  /// antimeridian.
  [[nodiscard]] std::array<double, 2> longitudes() const {
    return {first_longitude_, last_longitude_};
  }

  /// Whether the store is projected and continues beyond the edge of its map.
  [[nodiscard]] bool goes_around() const { return goes_around_; }

  /// For rasters: the smallest spacing of samples in degrees along a parallel or meridian,
  /// estimated at the corners of 64 x 64 parts.
  [[nodiscard]] double lattice_spacing() const;

  /// Returns the boxes of stored coordinates that contain all points of a geographic box: none if
  /// it does not meet bounds(), two if a store in degrees goes around the globe.
  [[nodiscard]] std::vector<StoredBox> windows(const GeographicBox& box) const;

  /// Converts stored x, y to longitude in [-180, 180] and latitude, in place. Places without them
  /// become NaN. Irregular points use BoxGeography, within its tolerance.
  void to_geographic(std::span<Point2> places) const;
  /// Converts longitude and latitude to stored x, y, in place. -180 and 180 give the same result.
  /// Places without an image become a corner outside stored_bounds(). Projected stores use
  /// polynomials, within a hundredth of a millimetre.
  void to_stored(std::span<Point2> places) const;

 private:
  void find_bounds(const std::string& file, bool is_lattice);
  void fit_polynomials(const stream::Store& store);
  /// Converts longitude and latitude to world x, y, in place.
  void from_geographic(std::span<Point2> places) const;
  [[nodiscard]] Point2 world(const Point2& stored) const;
  [[nodiscard]] double in_turn(double longitude) const;

  CoordinateSystem crs_;
  std::optional<BoxGeography> geography_;  ///< for irregular points
  PatchGrid plane_;                        ///< to shares of world_bounds_; for projected stores
  stream::Box3 world_bounds_{};
  stream::Placement placement_;
  StoredBox stored_;
  GeographicBox bounds_;
  /// For a store in degrees, or beyond the edge of a map: its range of x, and a full turn.
  double first_longitude_ = 0.0, last_longitude_ = 0.0, turn_ = 360.0;
  bool goes_around_ = false;
  Point2 margin_{};  ///< stored; larger than the error of converting there and back
  /// In degrees along a parallel or meridian: the shortest step of the grid that determines the
  /// bounds, along each stored axis.
  Point2 shortest_steps_{std::numeric_limits<double>::infinity(),
                         std::numeric_limits<double>::infinity()};
};

}  // namespace terrace::terrain
