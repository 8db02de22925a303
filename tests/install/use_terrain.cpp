// SPDX-License-Identifier: GPL-3.0-or-later
// Needs PROJ for a reference system and GEOS for a polygon.
#include <string>

#include <terrace/terrain/crs.hpp>
#include <terrace/terrain/region.hpp>

int main() {
  using namespace terrace::terrain;
  if (CoordinateSystem::parse("EPSG:32632").metres_per_unit() != 1.0) return 1;
  return Region::of_polygons({{{{0, 0}, {2, 0}, {1, 2}}}}, 0, 1).covers({1, 1}) ? 0 : 1;
}
