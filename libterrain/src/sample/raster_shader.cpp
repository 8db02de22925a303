// SPDX-License-Identifier: Apache-2.0
#include "sample/raster_shader.hpp"

#include <cmath>
#include <numbers>

#include <terrace/tri/interpolation.hpp>

namespace terrace::terrain {
namespace {

stream::Placement placement(const RasterGrid& grid, const stream::StoreSchema& schema,
                            const stream::Crs& crs) {
  stream::Placement placement = schema;
  placement.world.xy = {grid.step_x, 0, grid.x, 0, grid.step_y, grid.y};
  // Heights are scaled already.
  placement.coordinates[2].scale = 1;
  placement.coordinates[2].offset = 0;
  placement.crs = crs;
  // Heights keep their unit where x and y get another.
  if (placement.crs.vertical_unit.empty()) placement.crs.vertical_unit = schema.crs.vertical_unit;
  return placement;
}

}  // namespace

RasterShader::RasterShader(const RasterGrid& grid, const stream::StoreSchema& schema,
                           const stream::Crs& crs, RasterValue value)
    : value_(value), ground_(placement(grid, schema, crs)) {}

RasterShader::Scale RasterShader::scale(double column, double row) const {
  const stream::Point3 here{column, row, 0};
  const GroundMap map = ground_.map({here, here});
  return {map[0], -map[4], map[8]};
}

double RasterShader::operator()(const double* z, std::ptrdiff_t stride, const Scale& s) const {
  const double *n = z - stride, *p = z + stride;
  const double gx = s.up * ((n[1] + 2 * z[1] + p[1]) - (n[-1] + 2 * z[-1] + p[-1])) / (8 * s.east);
  const double gy = s.up * ((n[-1] + 2 * n[0] + n[1]) - (p[-1] + 2 * p[0] + p[1])) / (8 * s.north);
  if (!(gx == gx && gy == gy && z[0] == z[0])) return NAN;
  if (value_ == RasterValue::slope) return tri::slope_degrees({gx, gy});
  if (value_ == RasterValue::aspect) return tri::aspect_degrees({gx, gy});
  // Towards the light: half north-west, as high as far.
  const double light =
      (0.5 * gx - 0.5 * gy + std::numbers::sqrt2 / 2) / std::sqrt(1 + gx * gx + gy * gy);
  return light <= 0 ? 1 : 1 + 254 * light;
}

}  // namespace terrace::terrain
