// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include <terrace/stream/store.hpp>
#include <terrace/tri/interpolation.hpp>

#include "earth/ground.hpp"
#include "earth/whole_turns.hpp"
#include "surface/lattice_surface.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Converts coordinates of a store's CRS to stored coordinates, and gradients per column and row to
/// gradients on the ground.
class GroundSlope {
 public:
  explicit GroundSlope(const stream::Store& store);

  /// Returns stored x and y (column and row for a raster). A place within a millionth of a cell of
  /// a raster's column or row is treated as on it, because written coordinates are rounded.
  /// Longitudes may be off by whole turns.
  [[nodiscard]] Point2 stored(const Point2& world) const;
  /// Returns the place of the CRS at stored x and y.
  [[nodiscard]] Point2 world(const Point2& stored) const;
  /// Returns the place with its longitude as in the store.
  [[nodiscard]] Point2 turned(const Point2& world) const { return turns_(world); }

  /// Returns metres of height per metre on the ground towards east and north (of the CRS), at a
  /// stored place. Metres on the ground follow Ground: at the place's latitude if the CRS is
  /// geographic or Web Mercator; for a projection, at the middle of 1/256 of the store's width and
  /// height.
  [[nodiscard]] tri::Gradient on_ground(const Point2& stored, const SurfacePoint& surface) const;

  /// Returns metres on the ground between two stored places along a straight line, with the scale
  /// at their middle.
  [[nodiscard]] double metres(const Point2& a, const Point2& b) const;

  [[nodiscard]] const Ground& ground() const { return ground_; }

 private:
  stream::Placement placement_;
  Ground ground_;
  WholeTurns turns_;
  bool grid_;
  /// A map for the middle of each of kSide x kSide parts of the store's bounds, computed on demand,
  /// because a projection's scale costs far more than a gradient.
  struct Table;
  [[nodiscard]] GroundMap map_at(const Point2& stored) const;

  GroundMap map_{};  ///< used if it is the same everywhere
  std::shared_ptr<Table> table_;
};

/// Returns a function that tests if two stored places are more than `metres` apart on the ground.
std::function<bool(const Point2&, const Point2&)> longer_than(const stream::Store& store,
                                                              double metres);

}  // namespace terrace::terrain
