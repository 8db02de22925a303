// SPDX-License-Identifier: GPL-3.0-or-later
#include "ground_slope.hpp"

#include <cmath>

#include "world.hpp"

namespace terrace::tools {

GroundSlope::GroundSlope(const stream::Store& store)
    : placement_(placement_of(store.schema())),
      ground_(placement_),
      grid_(store.schema().grid),
      same_everywhere_(ground_.same_everywhere()) {
  if (same_everywhere_) map_ = ground_.map({});
}

Point2 GroundSlope::stored(const Point2& world) const {
  const std::array<double, 6>& m = placement_.world.xy;
  const double x = world[0] - m[2], y = world[1] - m[5];
  Point2 place;
  if (m[1] == 0 && m[3] == 0) {
    place = {x / m[0], y / m[4]};
  } else {
    const double determinant = m[0] * m[4] - m[1] * m[3];
    place = {(m[4] * x - m[1] * y) / determinant, (m[0] * y - m[3] * x) / determinant};
  }
  if (grid_) {
    for (double& c : place) {
      const double whole = std::nearbyint(c);
      if (std::abs(c - whole) <= 1e-6) c = whole;
    }
  }
  return place;
}

Point2 GroundSlope::world(const Point2& stored) const {
  const stream::Point3 p = world_point(placement_, {stored[0], stored[1], 0});
  return {p[0], p[1]};
}

tri::Gradient GroundSlope::on_ground(const Point2& stored, const SurfacePoint& surface) const {
  GroundMap here;
  if (!same_everywhere_) {
    const stream::Point3 p{stored[0], stored[1], 0};
    here = ground_.map({p, p});
  }
  const GroundMap& m = same_everywhere_ ? map_ : here;
  // ground = A * stored, so the gradient goes by the inverse of A's transpose.
  const double metres = m[8] / placement_.coordinates[2].scale;
  const double factor = metres / (m[0] * m[4] - m[1] * m[3]);
  return {(m[4] * surface.per_column - m[3] * surface.per_row) * factor,
          (m[0] * surface.per_row - m[1] * surface.per_column) * factor};
}

}  // namespace terrace::tools
