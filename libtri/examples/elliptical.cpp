// SPDX-License-Identifier: Apache-2.0
// Makes edges follow a direction, everywhere or in two regions only, while detail is added and
// removed.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include <terrace/tri/metric.hpp>

namespace tri = terrace::tri;
using Point = std::array<double, 2>;

namespace {

/// Mean ratio of the extents, along and across a direction, of the edges of triangles inside a box.
template <class Triangulation>
double stretch(const Triangulation& t, const std::vector<std::array<tri::VertexId, 3>>& triangles,
               const tri::Box3& box, double degrees) {
  const double c = std::cos(degrees * 0.017453292519943295), s = std::sqrt(1 - c * c);
  double along = 0, across = 0;
  for (const auto& corners : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Point a = t.point(corners[i]), b = t.point(corners[(i + 1) % 3]);
      if (!box.covers({{a[0], a[1], 0}, {a[0], a[1], 0}})) continue;
      along += std::abs(c * (b[0] - a[0]) + s * (b[1] - a[1]));
      across += std::abs(c * (b[1] - a[1]) - s * (b[0] - a[0]));
    }
  }
  return along / across;
}

template <class Triangulation>
std::vector<std::array<tri::VertexId, 3>> all(const Triangulation& t) {
  std::vector<std::array<tri::VertexId, 3>> triangles;
  for (const tri::TriangleId id : t.all_triangles()) triangles.push_back(t.vertices(id));
  return triangles;
}

}  // namespace

int main() {
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<Point> points;
  for (int i = 0; i < 4000; ++i) points.push_back({100 * unit(), 100 * unit()});
  const tri::Box3 everything = tri::box2(0, 0, 100, 100);

  // One ellipse, four times as long as wide, with its long axis 30 degrees from +x.
  const tri::LinearMap2 ellipse = tri::ellipse_map(4, 1, 30);
  tri::Delaunay2<double, tri::EllipticalMetric2> slanted(ellipse);
  slanted.build(points);
  const double everywhere = stretch(slanted, all(slanted), everything, 30);
  std::printf("one ellipse: edges are %.2f times as long along it as across\n", everywhere);

  // The triangulation is dynamic: inserting points and removing them again restores it.
  const std::uint64_t before = slanted.hash();
  std::vector<Point> detail;
  for (int i = 0; i < 500; ++i) detail.push_back({40 + 10 * unit(), 40 + 10 * unit()});
  std::vector<tri::Delaunay2<double, tri::EllipticalMetric2>::Insertion> inserted(detail.size());
  slanted.insert(detail, inserted);
  std::vector<tri::VertexId> added;
  for (const auto& [vertex, created] : inserted)
    if (created) added.push_back(vertex);
  slanted.remove(added);
  const bool same = slanted.hash() == before;
  std::printf("detail added and removed: %s triangles\n", same ? "the same" : "NOT the same");

  // Two regions, each with its own ellipse, Euclidean outside.
  tri::Delaunay2<double> plain;
  plain.build(points);
  const tri::Box3 left = tri::box2(10, 10, 45, 90), right = tri::box2(55, 10, 90, 90);
  const tri::MetricField2 field({{left, ellipse}, {right, tri::ellipse_map(1, 4, 0)}});
  const auto triangles = tri::metric_triangles(plain, field);
  const double left_stretch = stretch(plain, triangles, left, 30);
  const double right_stretch = stretch(plain, triangles, right, 90);
  const double outside = stretch(plain, triangles, tri::box2(0, 92, 100, 100), 30);
  std::printf("regions: %.2f times on the left, %.2f times upright on the right, %.2f outside\n",
              left_stretch, right_stretch, outside);
  const bool passed = same && everywhere > 2 && left_stretch > 2 && right_stretch > 2 &&
                      outside < 1.5 && triangles.size() == plain.triangle_count();
  return passed ? EXIT_SUCCESS : EXIT_FAILURE;
}
