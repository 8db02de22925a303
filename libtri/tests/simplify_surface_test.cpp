// SPDX-License-Identifier: Apache-2.0
// Measures simplified surfaces by brute force, from every vertex of the full surface to every
// triangle and back.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "shape/surface_distance.hpp"
#include "shape/triangle_distance.hpp"
#include "terrace/tri/surface_simplification.hpp"

namespace terrace::tri {
namespace surface_simplification {
namespace {

using Face = std::array<std::uint32_t, 3>;

double random_number(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// The distance of a point from a triangle by bisection along both of its parameters, which is
/// independent of normals and planes: the distance from a segment is convex in its end.
double distance_by_search(const Point3& p, const Point3& a, const Point3& b, const Point3& c) {
  const auto mix = [](const Point3& u, const Point3& v, double t) {
    return Point3{u[0] + t * (v[0] - u[0]), u[1] + t * (v[1] - u[1]), u[2] + t * (v[2] - u[2])};
  };
  const auto least = [](const auto& f) {
    double low = 0.0, high = 1.0;
    for (int i = 0; i < 45; ++i) {
      const double third = (high - low) / 3.0;
      (f(low + third) <= f(high - third) ? high : low) =
          f(low + third) <= f(high - third) ? high - third : low + third;
    }
    return std::min({f(0.0), f(1.0), f(0.5 * (low + high))});
  };
  return least([&](double s) {
    const Point3 from = mix(a, b, s), to = mix(a, c, s);
    return least([&](double t) {
      const Point3 d = shape::minus(mix(from, to, t), p);
      return std::sqrt(shape::dot(d, d));
    });
  });
}

double distance_from(const Surface& surface, const Point3& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const Face& f : surface.faces) {
    least = std::min(least, shape::TriangleDistance(surface.points[f[0]], surface.points[f[1]],
                                                    surface.points[f[2]])
                                .square(p));
  }
  return std::sqrt(least);
}

/// A torus or, with `open`, a part of it that is a disc, with a bumpy radius.
Surface torus(std::uint32_t around, std::uint32_t across, double bumps, bool open) {
  Surface surface;
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t k = 0; k < across; ++k) {
      const double u = 2.0 * std::numbers::pi * i / around, v = 2.0 * std::numbers::pi * k / across;
      const double r = 1.0 + bumps * std::sin(3.0 * u) * std::cos(2.0 * v);
      surface.points.push_back({(4.0 + r * std::cos(v)) * std::cos(u),
                                (4.0 + r * std::cos(v)) * std::sin(u), r * std::sin(v)});
    }
  }
  for (std::uint32_t i = 0; i < around - (open ? around / 2 : 0); ++i) {
    for (std::uint32_t k = 0; k < across - (open ? across / 2 : 0); ++k) {
      const auto at = [&](std::uint32_t a, std::uint32_t b) {
        return (a % around) * across + b % across;
      };
      surface.faces.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      surface.faces.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  return surface;
}

/// Expects what simplify_surface() promises of every result, and returns it.
SimplifiedSurface checked(const Surface& full, const SimplificationOptions& options) {
  SimplifiedSurface out = tri::simplify_surface(full, options);
  EXPECT_EQ(out.input.size(), out.surface.points.size());
  EXPECT_TRUE(std::is_sorted(out.input.begin(), out.input.end()));
  for (std::size_t i = 0; i < out.input.size(); ++i) {
    EXPECT_EQ(out.surface.points[i], full.points[out.input[i]]);
  }
  EXPECT_LE(out.max_distance, options.max_error);
  Box3 box;
  std::vector<bool> used(full.points.size(), false);
  for (const Face& f : full.faces) {
    for (const std::uint32_t v : f) {
      used[v] = true;
      box.include(full.points[v]);
    }
  }
  double size = 0.0;
  for (std::size_t k = 0; k < 3 && !full.faces.empty(); ++k) {
    size = std::max({size, std::abs(box.min[k]), std::abs(box.max[k])});
  }
  const double rounding = 1e-12 * size;
  for (std::size_t v = 0; v < full.points.size(); ++v) {
    if (!used[v]) continue;
    EXPECT_LE(distance_from(out.surface, full.points[v]), out.max_distance + rounding);
  }
  const SurfaceMeasures before = measure(full), after = measure(out.surface);
  EXPECT_EQ(after.components, before.components);
  EXPECT_EQ(after.euler_characteristic, before.euler_characteristic);
  EXPECT_EQ(after.closed, before.closed);
  EXPECT_EQ(after.border_edges == 0, before.border_edges == 0);
  EXPECT_LE(after.non_manifold_edges, before.non_manifold_edges);
  return out;
}

TEST(TriangleDistanceTest, AgreesWithASearch) {
  constexpr unsigned kSeed = 11;
  std::mt19937_64 random(kSeed);
  const auto point = [&] {
    // Many coordinates are equal, so that degenerate triangles occur.
    Point3 p;
    for (double& c : p)
      c = random() % 3 == 0 ? static_cast<double>(random() % 3) : 3.0 * random_number(random);
    return p;
  };
  for (int round = 0; round < 200 / TERRACE_TEST_SHARE; ++round) {
    const Point3 a = point(), b = random() % 8 == 0 ? a : point();
    const Point3 c = random() % 8 == 0 ? b : point();
    const Point3 p = point();
    EXPECT_NEAR(std::sqrt(shape::TriangleDistance(a, b, c).square(p)),
                distance_by_search(p, a, b, c), 1e-7)
        << "seed " << kSeed << ", round " << round;
  }
}

TEST(SurfaceDistanceTest, FindsTheNearestFace) {
  constexpr unsigned kSeed = 12;
  std::mt19937_64 random(kSeed);
  const Surface surface = torus(23, 17, 0.3, false);
  const shape::SurfaceDistance distance(surface.points, surface.faces);
  for (int round = 0; round < 300 / TERRACE_TEST_SHARE; ++round) {
    const Point3 p{12.0 * random_number(random) - 6.0, 12.0 * random_number(random) - 6.0,
                   4.0 * random_number(random) - 2.0};
    const double expected = distance_from(surface, p);
    EXPECT_DOUBLE_EQ(std::sqrt(distance.square(p, 1e9)), expected) << "seed " << kSeed;
    EXPECT_EQ(distance.square(p, 0.25 * expected * expected), 0.25 * expected * expected);
  }
}

TEST(SimplifySurfaceTest, KeepsTheBoundAndTheTopology) {
  for (const bool open : {false, true}) {
    const Surface full = torus(30, 20, 0.2, open);
    std::size_t vertices = full.points.size() + 1;
    for (const double bound : {0.0, 0.03, 0.3, 1.0}) {
      const SimplifiedSurface out = checked(full, {.max_error = bound});
      EXPECT_LE(out.surface.points.size(), vertices) << "bound " << bound;
      vertices = out.surface.points.size();
      EXPECT_TRUE(bound != 0.3 || vertices < full.points.size() / 4) << vertices;
    }
  }
}

TEST(SimplifySurfaceTest, StaysNearTheFullSurfaceBetweenItsVertices) {
  constexpr unsigned kSeed = 13;
  constexpr int kPlaces = 4000;
  std::mt19937_64 random(kSeed);
  const Surface full = torus(72, 48, 0.2, false);
  const shape::SurfaceDistance distance(full.points, full.faces);
  for (const double bound : {0.02, 0.1, 0.3, 0.6}) {
    const SimplifiedSurface out = tri::simplify_surface(full, {.max_error = bound});
    const auto& points = out.surface.points;
    std::vector<double> areas;
    double area = 0.0;
    for (const Face& f : out.surface.faces) {
      const Point3 n = shape::cross(shape::minus(points[f[1]], points[f[0]]),
                                    shape::minus(points[f[2]], points[f[0]]));
      areas.push_back(area += std::sqrt(shape::dot(n, n)));
    }
    int beyond = 0;
    for (int i = 0; i < kPlaces; ++i) {
      const auto at = std::lower_bound(areas.begin(), areas.end(), area * random_number(random));
      const Face& f = out.surface.faces[static_cast<std::size_t>(
          std::min<std::ptrdiff_t>(at - areas.begin(), std::ssize(areas) - 1))];
      const double r = std::sqrt(random_number(random)), s = random_number(random);
      Point3 p{};
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = (1 - r) * points[f[0]][k] + r * (1 - s) * points[f[1]][k] + r * s * points[f[2]][k];
      }
      if (std::sqrt(distance.square(p, 1e9)) > bound) ++beyond;
    }
    EXPECT_LE(beyond, kPlaces / 1000) << "bound " << bound << ", seed " << kSeed;
  }
}

TEST(SimplifySurfaceTest, FlatPartsCostNothing) {
  Surface full;
  constexpr std::uint32_t kSide = 15;
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) full.points.push_back({1.0 * x, 1.0 * y, 7.0});
  }
  for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
    for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
      const std::uint32_t a = y * kSide + x;
      full.faces.push_back({a, a + 1, a + kSide + 1});
      full.faces.push_back({a, a + kSide + 1, a + kSide});
    }
  }
  const SimplifiedSurface out = checked(full, {.max_error = 0.0});
  EXPECT_LE(out.surface.points.size(), 12U);
  EXPECT_NEAR(measure(out.surface).area, (kSide - 1.0) * (kSide - 1.0), 1e-9);
}

TEST(SimplifySurfaceTest, StopsAtThePoints) {
  const Surface full = torus(30, 20, 0.2, false);
  double before = 0.0;
  for (const std::size_t points : {300U, 100U, 40U}) {
    const SimplifiedSurface out = checked(full, {.max_points = points});
    EXPECT_EQ(out.surface.points.size(), points);
    EXPECT_GE(out.max_distance, before);
    before = out.max_distance;
  }
  // A torus has at least seven vertices.
  EXPECT_GE(checked(full, {.max_points = 1}).surface.points.size(), 7U);
}

TEST(SimplifySurfaceTest, EqualUnderShiftsAndPowersOfTwo) {
  const Surface full = torus(40, 30, 0.2, true);
  const SimplifiedSurface expected = checked(full, {.max_error = 0.0625});
  Surface scaled = full;
  for (Point3& p : scaled.points) {
    for (double& c : p) c *= 0x1p-60;
  }
  EXPECT_EQ(checked(scaled, {.max_error = 0.0625 * 0x1p-60}).input, expected.input);
  // Far from the origin, with coordinates that have few bits, so that the shift is exact.
  Surface coarse = full;
  for (Point3& p : coarse.points) {
    for (double& c : p) c = std::round(c * 0x1p20) * 0x1p-20;
  }
  Surface far = coarse;
  for (Point3& p : far.points) {
    for (double& c : p) c += 0x1p30;
  }
  EXPECT_EQ(tri::simplify_surface(far, {.max_error = 0.0625}).surface.faces,
            tri::simplify_surface(coarse, {.max_error = 0.0625}).surface.faces);
}

TEST(SimplifySurfaceTest, DegenerateSurfaces) {
  EXPECT_TRUE(checked({}, {.max_error = 1.0}).surface.faces.empty());
  const Surface triangle{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}}, {{0, 1, 2}}};
  EXPECT_EQ(checked(triangle, {}).surface.points.size(), 3U);  // without the loose point
  const Surface tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                            {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  EXPECT_EQ(checked(tetrahedron, {}).surface.faces.size(), 4U);
  // Three sheets meet in an edge. Without a bound, one triangle remains.
  const Surface sheets{{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}},
                       {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}};
  EXPECT_EQ(checked(sheets, {}).surface.faces.size(), 1U);
  // All points at one place, and all on a line.
  Surface flat = torus(12, 9, 0.0, false);
  for (Point3& p : flat.points) p = {3, 3, 3};
  EXPECT_EQ(checked(flat, {.max_error = 0.0}).max_distance, 0.0);
  for (std::size_t i = 0; i < flat.points.size(); ++i)
    flat.points[i] = {static_cast<double>(i), 0, 0};
  checked(flat, {.max_error = 1.0});
}

TEST(SimplifySurfaceTest, RandomSoups) {
  for (unsigned seed = 0; seed < 60 / TERRACE_TEST_SHARE; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    Surface soup;
    const auto points = static_cast<std::uint32_t>(4 + random() % 20);
    for (std::uint32_t i = 0; i < points; ++i) {
      soup.points.push_back({static_cast<double>(random() % 4), static_cast<double>(random() % 4),
                             static_cast<double>(random() % 4)});
    }
    const std::size_t faces = 1 + random() % 30;
    while (soup.faces.size() < faces) {
      const auto corner = [&] { return static_cast<std::uint32_t>(random() % points); };
      const Face face{corner(), corner(), corner()};
      if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0])
        soup.faces.push_back(face);
    }
    const double bound = static_cast<double>(random() % 3);
    const SimplifiedSurface out = tri::simplify_surface(soup, {.max_error = bound});
    for (const Face& f : soup.faces) {
      for (const std::uint32_t v : f) {
        EXPECT_LE(distance_from(out.surface, soup.points[v]), out.max_distance + 1e-12);
      }
    }
    EXPECT_LE(out.max_distance, bound);
    EXPECT_LE(measure(out.surface).components, measure(soup).components);
  }
}

TEST(SimplifySurfaceTest, RefusesBadInput) {
  const Surface good{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  Surface bad = good;
  bad.faces[0][1] = 3;
  EXPECT_THROW(tri::simplify_surface(bad, {}), std::invalid_argument);
  bad.faces[0][1] = 0;
  EXPECT_THROW(tri::simplify_surface(bad, {}), std::invalid_argument);
  bad = good;
  bad.points[1][2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(tri::simplify_surface(bad, {}), std::invalid_argument);
  EXPECT_THROW(tri::simplify_surface(good, {.max_error = -1.0}), std::invalid_argument);
  EXPECT_THROW(tri::simplify_surface(good, {.max_error = std::numeric_limits<double>::quiet_NaN()}),
               std::invalid_argument);
}

TEST(SimplifySurfaceTest, Stops) {
  struct Stop {};
  int calls = 0;
  const auto stop = [&] {
    if (++calls == 1) throw Stop();
  };
  EXPECT_THROW(tri::simplify_surface(torus(60, 40, 0.2, false), {.check_stop = stop}), Stop);
}

}  // namespace
}  // namespace surface_simplification
}  // namespace terrace::tri
