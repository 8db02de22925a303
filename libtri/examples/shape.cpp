// SPDX-License-Identifier: Apache-2.0
// Restores the surface of a dumbbell from its points alone. Then samples a part more densely and
// lets the shape follow the changes of the triangulation.
#include "terrace/tri/shape.hpp"

#include <cmath>
#include <cstdio>
#include <vector>

namespace tri = terrace::tri;

// A point of the dumbbell: `along` from end to end and `round` the axis, both from 0 to 1.
static tri::Point3 on_dumbbell(double along, double round) {
  const double t = 3.141592653589793 * along, angle = 6.283185307179586 * round;
  const double radius = std::sin(t) * (0.55 - 0.25 * std::cos(4 * t));
  return {radius * std::cos(angle), radius * std::sin(angle), -1.5 * std::cos(t)};
}

int main() {
  std::vector<tri::Point3> points;
  for (int i = 0; i < 4000; ++i) points.push_back(on_dumbbell((i + 0.5) / 4000, 0.618034 * i));

  // Restores it in one call.
  const tri::SurfaceMeasures coarse = tri::measure(tri::restore_surface(points).surface);
  std::printf("%zu faces, area %.3f, volume %.3f, %zu component, Euler characteristic %d\n",
              coarse.faces, coarse.area, coarse.volume, coarse.components,
              static_cast<int>(coarse.euler_characteristic));

  // Uses a triangulation that changes.
  tri::Delaunay3<double> triangulation;
  triangulation.build(points);
  tri::Shape3<double> shape;
  triangulation.start_journal();
  shape.restore(triangulation);

  std::vector<tri::Point3> detail;
  for (int i = 0; i < 400; ++i) detail.push_back(on_dumbbell(0.3 + i / 4000.0, 0.381966 * i));
  triangulation.insert(detail, {}, triangulation.nearest(detail[0]));
  tri::Delaunay3<double>::Changes changes;
  triangulation.take_changes(changes);
  shape.update(triangulation, changes);

  const tri::ShapeSurface finer = shape.surface(triangulation);
  std::printf("with detail: %zu faces, %zu of %zu tetrahedra kept, %zu vertices not on it\n",
              finer.surface.faces.size(), shape.kept_count(), triangulation.tetrahedron_count(),
              shape.lost_vertices().size());
  const tri::SurfaceMeasures measured = tri::measure(finer.surface);
  return coarse.closed && coarse.euler_characteristic == 2 && measured.closed ? 0 : 1;
}
