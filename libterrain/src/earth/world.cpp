// SPDX-License-Identifier: Apache-2.0
#include "earth/world.hpp"

#include "terrace/stream/store.hpp"

namespace terrace::terrain {

Placement placement_of(const stream::SourceInfo& info) {
  return {.world = info.world, .coordinates = info.coordinates, .crs = info.crs};
}

Placement placement_of(const stream::Schema& schema) {
  return {.world = schema.world, .coordinates = schema.coordinates, .crs = schema.crs};
}

stream::Point3 world_point(const Placement& placement, const stream::Point3& stored) {
  const std::array<double, 6>& xy = placement.world.xy;
  return {stored[0] * xy[0] + stored[1] * xy[1] + xy[2],
          stored[0] * xy[3] + stored[1] * xy[4] + xy[5],
          stored[2] * placement.coordinates[2].scale + placement.coordinates[2].offset};
}

std::array<double, 2> stored_place(const Placement& placement, const std::array<double, 2>& world) {
  const std::array<double, 6>& xy = placement.world.xy;
  const double x = world[0] - xy[2], y = world[1] - xy[5];
  if (xy[1] == 0.0 && xy[3] == 0.0) return {x / xy[0], y / xy[4]};
  const double determinant = xy[0] * xy[4] - xy[1] * xy[3];
  return {(xy[4] * x - xy[1] * y) / determinant, (xy[0] * y - xy[3] * x) / determinant};
}

stream::Box3 world_box(const Placement& placement, const stream::Box3& stored) {
  stream::Box3 box;
  if (stored.empty()) return box;
  for (unsigned corner = 0; corner < 8; ++corner) {
    box.include(world_point(placement, {(corner & 1) != 0 ? stored.max[0] : stored.min[0],
                                        (corner & 2) != 0 ? stored.max[1] : stored.min[1],
                                        (corner & 4) != 0 ? stored.max[2] : stored.min[2]}));
  }
  return box;
}

}  // namespace terrace::terrain
