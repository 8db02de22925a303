// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {

void to_world(const Placement& placement, PointBlock& block) {
  const std::array<double, 6>& m = placement.world.xy;
  // Without a transform, coordinates must keep every bit (1 * -0.0 + 0 would not).
  if (placement.world != WorldTransform{}) {
    for (Point3& p : block.positions) {
      const double x = p[0] * m[0] + p[1] * m[1] + m[2];
      const double y = p[0] * m[3] + p[1] * m[4] + m[5];
      p[0] = x;
      p[1] = y;
    }
  }
  const Channel& height = placement.coordinates[2];
  if (height.scale != 1.0 || height.offset != 0.0) {
    for (Point3& p : block.positions) p[2] = p[2] * height.scale + height.offset;
  }
}

}  // namespace terrace::stream
