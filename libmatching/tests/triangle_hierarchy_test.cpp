// SPDX-License-Identifier: Apache-2.0
#include "terrace/matching/triangle_hierarchy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "matching_oracles.hpp"
#include "tree_oracles.hpp"

namespace terrace::matching {
namespace {

using oracles::uniform;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Mesh {
  std::vector<Point3> corners;
  std::vector<Triangle> triangles;

  [[nodiscard]] std::array<Point3, 3> of(std::uint32_t k) const {
    return {corners[triangles[k][0]], corners[triangles[k][1]], corners[triangles[k][2]]};
  }
};

/// Makes triangles of any shape. On a small grid many have no area, coincide, or lie in a ray's
/// plane.
Mesh random_mesh(std::size_t n, bool grid, std::mt19937_64& random) {
  Mesh mesh;
  mesh.corners.resize(3 * n);
  for (Point3& p : mesh.corners) {
    for (double& c : p) c = grid ? static_cast<double>(random() % 4) : uniform(random);
  }
  for (std::uint32_t k = 0; k < n; ++k) mesh.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
  if (grid) return mesh;
  for (std::uint32_t k = 0; k < n; ++k) {
    for (std::uint32_t c = 1; c < 3; ++c) {
      for (std::size_t d = 0; d < 3; ++d) {
        mesh.corners[3 * k + c][d] =
            mesh.corners[3 * k][d] + 0.6 * (mesh.corners[3 * k + c][d] - 0.5);
      }
    }
  }
  return mesh;
}

/// Makes a closed surface around the origin: a subdivided octahedron with corners on a bumpy
/// sphere.
Mesh ball_mesh(int divisions, std::mt19937_64& random) {
  Mesh mesh;
  mesh.corners = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (std::uint32_t x : {0u, 1u}) {
    for (std::uint32_t y : {2u, 3u}) {
      for (std::uint32_t z : {4u, 5u}) mesh.triangles.push_back({x, y, z});
    }
  }
  for (int round = 0; round < divisions; ++round) {
    std::vector<std::pair<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t>> rows;
    const auto middle = [&](std::uint32_t i, std::uint32_t j) {
      const auto edge = std::minmax(i, j);
      for (const auto& [key, value] : rows) {
        if (key.first == edge.first && key.second == edge.second) return value;
      }
      Point3 p;
      for (std::size_t d = 0; d < 3; ++d) p[d] = 0.5 * (mesh.corners[i][d] + mesh.corners[j][d]);
      mesh.corners.push_back(p);
      rows.push_back(
          {{edge.first, edge.second}, static_cast<std::uint32_t>(mesh.corners.size() - 1)});
      return rows.back().second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  for (Point3& p : mesh.corners) {
    const double length = std::hypot(p[0], p[1], p[2]) / (1.0 + 0.05 * uniform(random));
    for (double& c : p) c /= length;
  }
  return mesh;
}

TriangleHierarchy by_matching(const Mesh& mesh) {
  return TriangleHierarchy(oracles::matching_rows(centroids(mesh.corners, mesh.triangles)),
                           mesh.corners, mesh.triangles);
}

TriangleHierarchy at_random(const Mesh& mesh, std::mt19937_64& random) {
  HierarchyOptions options;
  options.leaf_size = 1 + static_cast<std::uint32_t>(random() % 4);
  return TriangleHierarchy(oracles::random_tree(mesh.triangles.size(), random), mesh.corners,
                           mesh.triangles, options);
}

Ray random_ray(bool grid, std::mt19937_64& random) {
  Ray ray;
  for (std::size_t d = 0; d < 3; ++d) {
    ray.origin[d] = grid ? static_cast<double>(random() % 7) - 2.0 : 4.0 * uniform(random) - 1.5;
    ray.direction[d] =
        grid ? static_cast<double>(random() % 5) - 2.0 : uniform(random) - ray.origin[d];
  }
  if (ray.direction == Point3{0, 0, 0}) ray.direction[2] = -1.0;
  return ray;
}

TEST(TriangleHierarchy, FindsTheFirstTriangle) {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const bool grid = seed % 2 == 0;
    const Mesh mesh = random_mesh(1 + random() % 150, grid, random);
    const TriangleHierarchy hierarchy = by_matching(mesh), other = at_random(mesh, random);
    for (int q = 0; q < 60; ++q) {
      Ray ray = random_ray(grid, random);
      if (q % 3 == 0) ray.t_min = 0.5 * uniform(random);
      if (q % 4 == 0) ray.t_max = uniform(random);
      const auto hit = hierarchy.hit(ray);
      EXPECT_EQ(other.hit(ray), hit);
      // Which of two touching triangles comes first is tested above, by comparing trees.
      if (grid) continue;
      double sure = kInfinity, possible = kInfinity;
      for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
        const auto in = oracles::crossing(ray, mesh.of(k), -1e-9L);
        const auto out = oracles::crossing(ray, mesh.of(k), 1e-9L);
        if (in) sure = std::min(sure, *in);
        if (out) possible = std::min(possible, *out);
      }
      if (hit) {
        ++hits;
        EXPECT_GE(hit->t, possible - 1e-9);
        EXPECT_LE(hit->t, sure + 1e-9);
        const auto own = oracles::crossing(ray, mesh.of(hit->index), 1e-9L);
        ASSERT_TRUE(own);
        EXPECT_NEAR(hit->t, *own, 1e-9);
      } else {
        EXPECT_EQ(sure, kInfinity);
      }
    }
  }
  EXPECT_GT(hits, 300u);
}

// Rays in the plane of all triangles, up to rounding. Where such a triangle is hit depends on the
// implementation, but it must be the same for every tree.
TEST(TriangleHierarchy, EdgeOnHitsDoNotDependOnTheTree) {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    std::array<Point3, 2> axes;
    for (Point3& axis : axes) {
      for (double& c : axis) c = uniform(random) - 0.5;
    }
    const auto in_plane = [&] {
      const double u = uniform(random), v = uniform(random);
      Point3 p;
      for (std::size_t d = 0; d < 3; ++d) p[d] = u * axes[0][d] + v * axes[1][d];
      return p;
    };
    Mesh mesh;
    for (std::uint32_t k = 0; k < 60; ++k) {
      for (int corner = 0; corner < 3; ++corner) mesh.corners.push_back(in_plane());
      mesh.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
    }
    const TriangleHierarchy hierarchy = by_matching(mesh), other = at_random(mesh, random);
    for (int q = 0; q < 200; ++q) {
      Ray ray{in_plane(), in_plane()};
      for (std::size_t d = 0; d < 3; ++d) ray.direction[d] -= ray.origin[d];
      const auto hit = hierarchy.hit(ray);
      EXPECT_EQ(other.hit(ray), hit);
      hits += hit.has_value() ? 1 : 0;
    }
  }
  EXPECT_GT(hits, 1000u);
}

// With integers below 2^20 and rays along an axis the computation is exact, so the test can be too.
TEST(TriangleHierarchy, HitsEdgesAndCornersOfAGrid) {
  Mesh mesh;
  for (std::uint32_t y = 0; y < 9; ++y) {
    for (std::uint32_t x = 0; x < 9; ++x) {
      mesh.corners.push_back({static_cast<double>(x), static_cast<double>(y),
                              static_cast<double>((3 * x + 5 * y) % 4)});
      if (x == 8 || y == 8) continue;
      const std::uint32_t at = 9 * y + x;
      mesh.triangles.push_back({at, at + 1, at + 10});
      mesh.triangles.push_back({at, at + 10, at + 9});
    }
  }
  const TriangleHierarchy hierarchy = by_matching(mesh);
  for (int y = -1; y <= 17; ++y) {
    for (int x = -1; x <= 17; ++x) {
      SCOPED_TRACE(testing::Message() << "at " << x << ", " << y << " halves");
      const bool inside = x >= 0 && x <= 16 && y >= 0 && y <= 16;
      const Ray down{{0.5 * x, 0.5 * y, 10.0}, {0.0, 0.0, -1.0}};
      const auto hit = hierarchy.hit(down);
      ASSERT_EQ(hit.has_value(), inside);
      if (!inside) continue;
      EXPECT_GE(hit->t, 7.0);
      EXPECT_LE(hit->t, 10.0);
      const Ray up{{0.5 * x, 0.5 * y, -10.0}, {0.0, 0.0, 4.0}};
      EXPECT_NEAR(hierarchy.hit(up)->t, (20.0 - hit->t) / 4.0, 1e-12);
      if (x % 2 == 0 && y % 2 == 0) {
        EXPECT_EQ(hit->t, 10.0 - static_cast<double>((3 * (x / 2) + 5 * (y / 2)) % 4));
      }
    }
  }
}

TEST(TriangleHierarchy, RaysNeverLeaveAClosedSurface) {
  std::mt19937_64 random(4);
  const Mesh mesh = ball_mesh(3, random);
  const TriangleHierarchy hierarchy = by_matching(mesh);
  for (int q = 0; q < 20000; ++q) {
    Ray ray;
    for (double& c : ray.origin) c = 0.4 * (uniform(random) - 0.5);
    // Aims at corners and edge midpoints, as rounded, and at other places.
    const Triangle& triangle = mesh.triangles[random() % mesh.triangles.size()];
    for (std::size_t d = 0; d < 3; ++d) {
      const double first = mesh.corners[triangle[0]][d], second = mesh.corners[triangle[1]][d];
      ray.direction[d] = q % 3 == 0   ? uniform(random) - 0.5
                         : q % 3 == 1 ? first - ray.origin[d]
                                      : 0.5 * (first + second) - ray.origin[d];
    }
    ASSERT_TRUE(hierarchy.hit(ray)) << "ray " << q;
  }
}

/// Finds the distance to a triangle by searching ever smaller regions around the best place.
double distance_by_search(const Point3& place, const std::array<Point3, 3>& corners) {
  double best = kInfinity, u0 = 0.0, v0 = 0.0, width = 1.0;
  for (int round = 0; round < 60; ++round, width *= 0.6) {
    const double u_begin = u0, v_begin = v0;
    for (int i = -6; i <= 6; ++i) {
      for (int j = -6; j <= 6; ++j) {
        const double u = std::clamp(u_begin + width * i / 6.0, 0.0, 1.0);
        const double v = std::clamp(v_begin + width * j / 6.0, 0.0, 1.0 - u);
        Point3 at;
        for (std::size_t d = 0; d < 3; ++d) {
          at[d] = corners[0][d] + u * (corners[1][d] - corners[0][d]) +
                  v * (corners[2][d] - corners[0][d]);
        }
        const double expected_distance = oracles::distance(at, place);
        if (expected_distance < best) {
          best = expected_distance;
          u0 = u;
          v0 = v;
        }
      }
    }
  }
  return best;
}

TEST(TriangleHierarchy, FindsTheNearestTriangle) {
  for (std::uint64_t seed = 1; seed <= 16; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const bool grid = seed % 2 == 0;
    const Mesh mesh = random_mesh(1 + random() % 25, grid, random);
    const TriangleHierarchy hierarchy = by_matching(mesh), other = at_random(mesh, random);
    for (int q = 0; q < 8; ++q) {
      const Point3 query = random_ray(grid, random).origin;
      const auto near = hierarchy.nearest(query);
      ASSERT_TRUE(near);
      EXPECT_EQ(other.nearest(query), near);
      double least = kInfinity;
      for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
        least = std::min(least, distance_by_search(query, mesh.of(k)));
      }
      EXPECT_NEAR(near->distance, least, 1e-7);
      EXPECT_NEAR(near->distance, distance_by_search(query, mesh.of(near->index)), 1e-7);
    }
  }
}

TEST(TriangleHierarchy, HandlesAnyScale) {
  std::mt19937_64 random(6);
  const Mesh plain = random_mesh(80, false, random);
  const TriangleHierarchy usual = by_matching(plain);
  for (const int exponent : {-900, -200, 200, 900}) {
    SCOPED_TRACE(testing::Message() << "2^" << exponent);
    const auto scaled = [&](Point3 p) {
      for (double& c : p) c = std::ldexp(c, exponent);
      return p;
    };
    Mesh mesh = plain;
    for (Point3& p : mesh.corners) p = scaled(p);
    const TriangleHierarchy hierarchy = by_matching(mesh);
    for (int q = 0; q < 100; ++q) {
      const Ray ray = random_ray(false, random);
      EXPECT_EQ(hierarchy.hit({scaled(ray.origin), scaled(ray.direction)}), usual.hit(ray));
      EXPECT_EQ(hierarchy.nearest(scaled(ray.origin))->index, usual.nearest(ray.origin)->index);
    }
  }
}

TEST(TriangleHierarchy, RefusesBadInput) {
  const std::vector<Point3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Triangle> good{{0, 1, 2}}, bad{{0, 1, 3}};
  EXPECT_THROW((void)centroids(corners, bad), std::invalid_argument);
  EXPECT_THROW(TriangleHierarchy({}, corners, bad), std::invalid_argument);
  const TriangleHierarchy one({}, corners, good), none;
  EXPECT_EQ(one.hit({{0.25, 0.25, 2.0}, {0, 0, -2}}), (RayHit{0, 1.0}));
  EXPECT_FALSE(one.hit({{0.25, 0.25, 2.0}, {0, 0, -2}, 0.0, 0.99}));
  EXPECT_FALSE(one.hit({{0.25, 0.25, 2.0}, {0, 0, -2}, 1.01}));
  EXPECT_FALSE(one.hit({{-1.0, 0.25, 0.0}, {1, 0, 0}}));  // edge-on
  EXPECT_FALSE(none.hit({{0, 0, 0}, {0, 0, 1}}));
  EXPECT_FALSE(none.nearest({0, 0, 0}));
  EXPECT_THROW((void)one.hit({{0, 0, 1}, {0, 0, 0}}), std::invalid_argument);
  std::vector<Point3> broken = corners;
  for (std::size_t corner = 0; corner < 3; ++corner) {
    broken = corners;
    broken[corner][1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(TriangleHierarchy({}, broken, good), std::invalid_argument);
  }
}

}  // namespace
}  // namespace terrace::matching
