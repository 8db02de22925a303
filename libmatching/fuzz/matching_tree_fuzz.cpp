// SPDX-License-Identifier: Apache-2.0
// Builds trees of small sets with many duplicates and ties. Checks the invariants of the tree, each
// level against dynamic programming over subsets, and queries against all points and against a tree
// of another shape.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "../tests/matching_oracles.hpp"
#include "../tests/tree_oracles.hpp"
#include "terrace/matching/matching_tree.hpp"
#include "terrace/matching/triangle_hierarchy.hpp"

namespace {

using namespace terrace::matching;

void require(bool holds) {
  if (!holds) std::abort();
}

template <class Tree>
void check_rows(const Tree& tree, std::size_t n) {
  require(tree.rows.size() == (n == 0 ? 0 : n - 1) && tree.positions.size() == tree.rows.size());
  require(tree.root == (n == 0 ? kNone : 2 * n - 2));
  std::vector<std::uint32_t> size(2 * n, 1), level(2 * n, 0), parents(2 * n, 0);
  for (std::size_t r = 0; r + 1 < n; ++r) {
    const MatchingTreeRow& row = tree.rows[r];
    require(row.a < row.b && row.b < n + r && row.distance >= 0.0);
    require(++parents[row.a] == 1 && ++parents[row.b] == 1);
    size[n + r] = size[row.a] + size[row.b];
    level[n + r] = row.level;
    require(row.size == size[n + r] && row.level > std::max(level[row.a], level[row.b]));
  }
}

template <class Point>
void check_levels(const MatchingTree<Point>& tree, const std::vector<Point>& points) {
  const std::size_t n = points.size();
  std::vector<Point> all = points;
  all.insert(all.end(), tree.positions.begin(), tree.positions.end());
  std::vector<std::uint32_t> present;
  for (std::uint32_t i = 0; i < n; ++i) present.push_back(i);
  std::size_t row = 0;
  while (present.size() > 1) {
    std::vector<Point> places;
    for (const std::uint32_t v : present) places.push_back(all[v]);
    double cost = 0.0;
    for (std::size_t pairs = present.size() / 2; pairs > 0; --pairs, ++row) {
      const MatchingTreeRow& made = tree.rows[row];
      require(std::erase(present, made.a) == 1 && std::erase(present, made.b) == 1);
      present.push_back(static_cast<std::uint32_t>(n + row));
      cost += made.distance;
    }
    require(std::abs(cost - oracles::point_optimum(places)) <= 1e-9 * (1.0 + cost));
  }
}

void check_queries(const std::vector<Point3>& points, const std::vector<TreeChildren>& rows) {
  const PointHierarchy<3> by_matching(rows, points);
  const PointHierarchy<3> chained(oracles::chain_tree(points.size()), points);
  std::vector<Triangle> triangles;
  for (std::uint32_t k = 0; k + 2 < points.size(); ++k) triangles.push_back({k, k + 1, k + 2});
  const std::vector<Point3> middles = centroids(points, triangles);
  const TriangleHierarchy surface(oracles::matching_rows(middles), points, triangles);
  const TriangleHierarchy surface_chained(oracles::chain_tree(triangles.size()), points, triangles);
  std::vector<Neighbour> found;
  for (const Point3& p : points) {
    const Point3 query{p[1], p[2] - 1.0, 0.5 * p[0]};
    const auto all = oracles::by_distance(points, query);
    require(by_matching.nearest(query) == all[0]);
    by_matching.nearest(query, 3, found);
    require(std::equal(found.begin(), found.end(), all.begin()));
    Ray ray{{-1.0, -2.0, p[0]}, {p[0] + 1.0, p[1] - 1.0, p[2] - 2.0}};
    require(by_matching.hit(ray, 0.5) == chained.hit(ray, 0.5));
    require(surface.hit(ray) == surface_chained.hit(ray));
    require(surface.nearest(query) == surface_chained.nearest(query));
  }
}

}  // namespace

// The first byte selects the coordinates' scale. Two bytes per point follow.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  std::vector<Point2> flat;
  std::vector<Point3> points;
  std::vector<double> weights;
  std::vector<std::uint32_t> labels;
  const double unit = data[0] & 1 ? 1e300 : 1.0;
  for (std::size_t k = 1; k + 1 < size && points.size() < 60; k += 2) {
    const auto x = static_cast<double>(data[k] % 8), y = static_cast<double>(data[k] / 32);
    flat.push_back({x, y});
    points.push_back({x, y, static_cast<double>(data[k + 1] % 8)});
    weights.push_back(1.0 + static_cast<double>(data[k + 1] / 64));
    labels.push_back(data[k + 1] / 8 % 4 * 1000u);
  }
  std::vector<Point3> scaled = points;
  for (Point3& p : scaled) {
    for (double& c : p) c *= unit;
  }
  MatchingTreeOptions<Point3> options;
  options.labels = labels;
  options.weights = weights;
  const MatchingTree<Point3> clustered = make_matching_tree(scaled, options);
  check_rows(clustered, points.size());
  options.threads = 2;
  const MatchingTree<Point3> scaled_tree = make_matching_tree(scaled, options);
  require(scaled_tree.rows == clustered.rows && scaled_tree.positions == clustered.positions);
  if (!points.empty()) check_queries(points, tree_children(clustered.rows));
  if (flat.size() > 12) flat.resize(12);
  const MatchingTree<Point2> planar_tree = make_matching_tree(std::span<const Point2>(flat));
  check_rows(planar_tree, flat.size());
  check_levels(planar_tree, flat);
  return 0;
}
