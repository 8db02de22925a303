// SPDX-License-Identifier: GPL-3.0-or-later
// Points of a torus. Its surface comes back from the points alone; then a part is sampled more
// densely, and the shape follows the triangulation's changes.
#include "terrace/tri/shape.hpp"

#include <cmath>
#include <cstdio>
#include <vector>

#include "terrace/tri/reconstruct.hpp"

namespace tri = terrace::tri;

// Angles round the axis and round the tube, in turns.
static tri::Point3 on_torus(double round, double tube) {
  const double a = 6.283185307179586 * round, b = 6.283185307179586 * tube;
  const double radius = 1.0 + 0.4 * std::cos(b);
  return {radius * std::cos(a), radius * std::sin(a), 0.4 * std::sin(b)};
}

int main() {
  std::vector<tri::Point3> points;
  for (int i = 0; i < 90; ++i)
    for (int j = 0; j < 36; ++j)
      points.push_back(on_torus((i + 0.37 * (j % 2)) / 90.0, (j + 0.01 * i) / 36.0));

  // In one call.
  const tri::SurfaceMeasures torus = tri::measure(tri::reconstruct_surface(points).surface);
  std::printf("%zu faces, volume %.3f of %.3f, %zu component, Euler characteristic %d\n",
              torus.faces, torus.volume, 2 * 9.869604401089358 * 0.16, torus.components,
              static_cast<int>(torus.euler_characteristic));

  // With a triangulation that changes.
  tri::Delaunay3<double> triangulation;
  triangulation.build(points);
  tri::Shape3<double> shape;
  triangulation.start_journal();
  shape.restore(triangulation);

  std::vector<tri::Point3> detail;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j)
      detail.push_back(on_torus((i + 0.21) / 180.0, (j + 0.17 + 0.02 * i) / 72.0));
  triangulation.insert(detail, {}, triangulation.nearest(detail[0]));
  tri::Delaunay3<double>::Changes changes;
  triangulation.take_changes(changes);
  shape.update(triangulation, changes);

  const tri::ShapeSurface finer = shape.surface(triangulation);
  std::printf("with detail: %zu faces, %zu of %zu tetrahedra kept, %zu vertices put back\n",
              finer.surface.faces.size(), shape.kept_count(), triangulation.tetrahedron_count(),
              shape.rescued_count());
  const tri::SurfaceMeasures measured = tri::measure(finer.surface);
  return torus.closed && torus.euler_characteristic == 0 && measured.closed ? 0 : 1;
}
