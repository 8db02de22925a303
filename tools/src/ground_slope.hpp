// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <terrace/stream/store.hpp>
#include <terrace/tri/interpolation.hpp>

#include "ground.hpp"
#include "lattice_surface.hpp"
#include "region.hpp"

namespace terrace::tools {

/// From coordinates of a store's CRS to stored coordinates, and from gradients per column and row
/// to gradients on the ground.
class GroundSlope {
 public:
  explicit GroundSlope(const stream::Store& store);

  /// Stored x,y (column and row of a raster). A place within a millionth of a cell of a raster's
  /// column or row is taken to lie on it: coordinates are rounded when they are written.
  [[nodiscard]] Point2 stored(const Point2& world) const;
  /// Back.
  [[nodiscard]] Point2 world(const Point2& stored) const;

  /// Metres of height per metre on the ground going east and north (of the CRS), at that stored
  /// place. Metres on the ground are those of Ground: at the place's latitude where the CRS is
  /// geographic or Web Mercator, the map's own metres otherwise.
  [[nodiscard]] tri::Gradient on_ground(const Point2& stored, const SurfacePoint& surface) const;

  /// What had to be assumed of units; empty if nothing.
  [[nodiscard]] const std::string& assumption() const { return ground_.assumption(); }

 private:
  Placement placement_;
  Ground ground_;
  bool grid_;
  bool same_everywhere_;
  GroundMap map_{};  ///< where it is the same everywhere
};

}  // namespace terrace::tools
