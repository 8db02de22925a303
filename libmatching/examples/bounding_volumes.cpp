// SPDX-License-Identifier: Apache-2.0
// Builds trees of repeated matching over points and over the triangles of a roof, then queries them
// for the nearest point and for the first hit of a ray.
#include <cstdio>
#include <vector>

#include <terrace/matching/matching_tree.hpp>
#include <terrace/matching/triangle_hierarchy.hpp>

int main() {
  using namespace terrace::matching;
  const std::vector<Point3> points{{0, 0, 0}, {4, 0, 0}, {4, 2, 0},
                                   {0, 2, 0}, {0, 1, 1}, {4, 1, 1}};

  const auto tree = make_matching_tree(std::span<const Point3>(points));
  for (const MatchingTreeRow& row : tree.rows) {
    std::printf("%u + %u, %g apart, %u points, level %u\n", row.a, row.b, row.distance, row.size,
                row.level);
  }
  const PointHierarchy<3> places(tree_children(tree.rows), points);
  const auto near = places.nearest({1, 1, 1.5});
  std::printf("nearest: %u at %g\n", near->index, near->distance);

  const std::vector<Triangle> roof{{0, 1, 5}, {0, 5, 4}, {2, 3, 4}, {2, 4, 5}};
  const std::vector<Point3> middles = centroids(points, roof);
  const auto rows = tree_children(make_matching_tree(std::span<const Point3>(middles)).rows);
  const TriangleHierarchy surface(rows, points, roof);
  const auto hit = surface.hit({{1, 0.5, 5}, {0, 0, -1}});
  std::printf("first below: triangle %u after %g\n", hit->index, hit->t);
  return near->index == 4 && hit->index == 1 && hit->t == 4.5 ? 0 : 1;
}
