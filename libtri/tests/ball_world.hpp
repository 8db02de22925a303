// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "view_world.hpp"

/// Points on a body, and worlds of them.

namespace terrace::tri::test {

/// Points of a bumpy ball, integers stored as doubles.
inline std::vector<Point3> bumpy_ball(std::size_t count, std::mt19937_64& random) {
  std::vector<Point3> points(count);
  for (Point3& p : points) {
    double length = 0.0;
    do {
      length = 0.0;
      for (double& c : p) c = 2.0 * unit(random) - 1.0;
      for (const double c : p) length += c * c;
    } while (length > 1.0 || length < 0.01);
    const double bumps = 1.0 + 0.1 * p[0] * p[1] / length;
    for (double& c : p) c = std::round(0x1p20 + 0x1p19 * bumps * c / std::sqrt(length));
  }
  return points;
}

/// A world of points on a bumpy ball.
inline World ball_world(std::uint64_t seed, std::size_t count) {
  World world(seed, Shape::random, 1);
  const std::vector<Point3> points = bumpy_ball(count, world.random);
  world.source = make_hierarchy(points, 2, 8.0, world.random);
  fill_errors(world.source);
  world.box = {points[0], points[0]};
  for (const Point3& p : points) {
    for (std::size_t k = 0; k < 3; ++k) {
      world.box.min[k] = std::min(world.box.min[k], p[k]);
      world.box.max[k] = std::max(world.box.max[k], p[k]);
    }
  }
  return world;
}

}  // namespace terrace::tri::test
