// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include <terrace/stream/store.hpp>

#include "earth/ground.hpp"
#include "sample/raster_grid.hpp"
#include "terrace/terrain/raster.hpp"

namespace terrace::terrain {

/// Slope, aspect or hillshade of the heights around a cell, see write_raster().
class RasterShader {
 public:
  /// value: any but the height. crs: of the grid.
  RasterShader(const RasterGrid& grid, const stream::StoreSchema& schema, const stream::Crs& crs,
               RasterValue value);

  /// Metres per cell going east and north, and per unit of height, at a cell.
  struct Scale {
    double east = 1, north = 1, up = 1;
  };
  [[nodiscard]] Scale scale(double column, double row) const;

  /// z: the middle one of 3 x 3 heights by rows that are `stride` apart. NaN: no value.
  [[nodiscard]] double operator()(const double* z, std::ptrdiff_t stride, const Scale& s) const;

  /// What had to be assumed of units; empty if nothing.
  [[nodiscard]] const std::string& assumption() const { return ground_.assumption(); }

 private:
  RasterValue value_;
  Ground ground_;
};

}  // namespace terrace::terrain
