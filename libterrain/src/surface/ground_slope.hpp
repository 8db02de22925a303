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

/// From coordinates of a store's CRS to stored coordinates, and from gradients per column and row
/// to gradients on the ground.
class GroundSlope {
 public:
  explicit GroundSlope(const stream::Store& store);

  /// Stored x,y (column and row of a raster). A place within a millionth of a cell of a raster's
  /// column or row is taken to lie on it: coordinates are rounded when they are written.
  /// Longitudes may be off by whole turns.
  [[nodiscard]] Point2 stored(const Point2& world) const;
  /// Back.
  [[nodiscard]] Point2 world(const Point2& stored) const;
  /// The place with the longitude that it has in the store.
  [[nodiscard]] Point2 turned(const Point2& world) const { return turns_(world); }

  /// Metres of height per metre on the ground going east and north (of the CRS), at that stored
  /// place. Metres on the ground are those of Ground: at the place's latitude where the CRS is
  /// geographic or Web Mercator; those of a projection are taken at the middle of 1/256 of the
  /// store's width and height.
  [[nodiscard]] tri::Gradient on_ground(const Point2& stored, const SurfacePoint& surface) const;

  /// Metres on the ground between two stored places, straight, as the place between them has it.
  [[nodiscard]] double metres(const Point2& a, const Point2& b) const;

  [[nodiscard]] const Ground& ground() const { return ground_; }

 private:
  stream::Placement placement_;
  Ground ground_;
  WholeTurns turns_;
  bool grid_;
  /// The map at the middle of each of kSide x kSide parts of the store's bounds, made when it is
  /// asked for: a projection's scale costs far more than a gradient.
  struct Table;
  [[nodiscard]] GroundMap map_at(const Point2& stored) const;

  GroundMap map_{};  ///< where it is the same everywhere
  std::shared_ptr<Table> table_;
};

/// Whether two stored places are more than so many metres apart on the ground.
std::function<bool(const Point2&, const Point2&)> longer_than(const stream::Store& store,
                                                              double metres);

}  // namespace terrace::terrain
