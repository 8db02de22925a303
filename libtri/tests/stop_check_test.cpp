// SPDX-License-Identifier: Apache-2.0
// Long work calls its check at intervals, and what the check throws ends it.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/stop_check.hpp>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/delaunay3.hpp"
#include "terrace/tri/dynamic_surface.hpp"
#include "terrace/tri/grid_tin.hpp"
#include "terrace/tri/interpolation.hpp"
#include "terrace/tri/metric.hpp"
#include "terrace/tri/point_tin.hpp"
#include "terrace/tri/regional_delaunay2.hpp"
#include "terrace/tri/shape.hpp"
#include "terrace/tri/smoothing.hpp"

namespace terrace::tri {
namespace {

struct Stop {};
using Work = std::function<void(const base::StopCheck&)>;

/// work: with one thread, so that the calls are the same each time.
void expect_stops(const Work& work, std::size_t least_calls) {
  std::size_t calls = 0;
  work([&] { ++calls; });
  const std::size_t all = calls;
  ASSERT_GE(all, least_calls);
  for (const std::size_t last : {std::size_t{1}, (all + 1) / 2, all}) {
    calls = 0;
    EXPECT_THROW(work([&] {
                   if (++calls == last) throw Stop();
                 }),
                 Stop);
    EXPECT_EQ(calls, last) << "of " << all;
  }
}

template <std::size_t N, class Coord>
std::vector<std::array<Coord, N>> some(std::size_t count) {
  std::mt19937_64 random(1);
  std::vector<std::array<Coord, N>> points(count);
  for (auto& p : points) {
    for (Coord& c : p) c = static_cast<Coord>(random() % 1000000);
  }
  return points;
}

template <class Triangulation>
void expect_building_stops(const std::vector<typename Triangulation::Point>& points,
                           std::size_t least_calls) {
  expect_stops(
      [&](const base::StopCheck& check) {
        Triangulation triangulation;
        triangulation.set_check_stop(check);
        triangulation.build(points);
      },
      least_calls);
  expect_stops(
      [&](const base::StopCheck& check) {
        Triangulation triangulation;
        triangulation.build(std::span(points).first(9));
        triangulation.set_check_stop(check);
        std::vector<typename Triangulation::Insertion> inserted(points.size());
        triangulation.insert(points, inserted);
      },
      least_calls);
}

TEST(StopCheck, EndsTriangulations) {
  expect_building_stops<Delaunay2<double>>(some<2, double>(20000), 80);
  expect_building_stops<Delaunay2<std::int32_t>>(some<2, std::int32_t>(20000), 80);
  expect_building_stops<Delaunay3<double>>(some<3, double>(20000), 300);
  expect_building_stops<Delaunay3<std::int32_t>>(some<3, std::int32_t>(20000), 300);
}

TEST(StopCheck, EndsTriangulationsOfAwkwardPoints) {
  std::vector<std::array<double, 2>> line, circle, equal(20000, {3, 4});
  for (int i = 0; i < 20000; ++i) {
    line.push_back({static_cast<double>(i * 7919 % 20000), 5});
    circle.push_back({std::cos(0.0001 * i), std::sin(0.0001 * i)});
  }
  for (const auto& points : {line, circle, equal}) {
    expect_stops(
        [&](const base::StopCheck& check) {
          Delaunay2<double> triangulation;
          triangulation.set_check_stop(check);
          triangulation.build(points);
        },
        10);
  }
  std::vector<std::array<double, 3>> plane;
  for (const auto& p : some<2, double>(20000)) plane.push_back({p[0], p[1], 1});
  expect_stops(
      [&](const base::StopCheck& check) {
        Delaunay3<double> triangulation;
        triangulation.set_check_stop(check);
        triangulation.build(plane);
      },
      10);
}

TEST(StopCheck, LeavesATriangulationThatCanBeCleared) {
  const auto points = some<2, double>(20000);
  const auto places = some<3, double>(20000);
  Delaunay2<double> planar, other;
  Delaunay3<double> spatial, another;
  planar.set_check_stop([] { throw Stop(); });
  spatial.set_check_stop([] { throw Stop(); });
  EXPECT_THROW(planar.build(points), Stop);
  EXPECT_THROW(spatial.build(places, 2), Stop);
  planar.clear();
  spatial.clear();
  planar.set_check_stop({});
  spatial.set_check_stop({});
  planar.build(points);
  other.build(points);
  EXPECT_EQ(planar.hash(), other.hash());
  spatial.build(places, 2);
  another.build(places);
  EXPECT_EQ(spatial.hash(), another.hash());
}

std::vector<std::array<double, 3>> on_a_sphere(std::size_t count) {
  std::mt19937_64 random(1);
  std::vector<std::array<double, 3>> points;
  while (points.size() < count) {
    std::array<double, 3> p{};
    double length2 = 0;
    for (double& c : p) {
      c = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
      length2 += c * c;
    }
    if (length2 > 1 || length2 < 0.01) continue;
    for (double& c : p) c /= std::sqrt(length2);
    points.push_back(p);
  }
  return points;
}

TEST(StopCheck, EndsShapes) {
  const auto points = on_a_sphere(10000);
  Delaunay3<double> triangulation;
  triangulation.build(points);
  for (const ShapeRule rule : {ShapeRule::poles, ShapeRule::flood, ShapeRule::published}) {
    SCOPED_TRACE(static_cast<int>(rule));
    ShapeOptions options;
    options.rule = rule;
    expect_stops(
        [&](const base::StopCheck& check) {
          Shape3<double> shape(options);
          shape.restore(triangulation, 1, check);
        },
        10);
    RestoreOptions restore;
    restore.shape = options;
    expect_stops(
        [&](const base::StopCheck& check) {
          restore.check_stop = check;
          restore_surface(points, restore);
        },
        150);
  }
  expect_stops(
      [&](const base::StopCheck& check) {
        DynamicSurface<double> surface;
        surface.set_check_stop(check);
        surface.build(points);
      },
      150);
  // By several threads.
  std::atomic<std::size_t> calls{0};
  RestoreOptions restore;
  restore.threads = 4;
  restore.check_stop = [&] {
    if (++calls >= 30) throw Stop();
  };
  EXPECT_THROW(restore_surface(points, restore), Stop);
  EXPECT_LE(calls, 34U);
}

TEST(StopCheck, EndsSmoothingAndFlips) {
  Delaunay2<double> triangulation;
  const std::vector<VertexId> vertices = triangulation.build(some<2, double>(20000));
  std::vector<double> heights(triangulation.vertex_slots());
  for (const VertexId v : vertices) {
    heights[slot(v)] = std::sin(triangulation.point(v)[0]);
  }
  for (const Smoothing method : {Smoothing::laplacian, Smoothing::taubin, Smoothing::bilateral}) {
    SmoothingOptions options;
    options.method = method;
    options.edge_height = 1;
    expect_stops(
        [&](const base::StopCheck& check) {
          options.check_stop = check;
          smooth(triangulation, heights, vertices, options);
        },
        100);
  }
  MetricField2 field({{box2(-1, -1, 2e6, 2e6), ellipse_map(3.0, 1.0, 30.0)}});
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(metric_triangles(triangulation, field, TriangleFilter(), check));
      },
      200);
}

TEST(StopCheck, EndsTrianglesThatFollowMetrics) {
  const auto points = some<2, double>(20000);
  const MetricField2 field({{box2(-1, -1, 2e6, 2e6), ellipse_map(3.0, 1.0, 30.0)}});
  const auto build = [&](const MetricField2& of, const base::StopCheck& check) {
    RegionalDelaunay2<double> triangles(of);
    triangles.set_check_stop(check);
    triangles.build(points);
  };
  std::size_t calls = 0, flat_calls = 0;
  build(field, [&] { ++calls; });
  build(MetricField2(std::vector<MetricField2::Region>{}), [&] { ++flat_calls; });
  EXPECT_GT(calls, flat_calls + 20);
  expect_stops([&](const base::StopCheck& check) { build(field, check); }, 100);
}

TEST(StopCheck, EndsFlipsInSpace) {
  Delaunay3<double> triangulation;
  triangulation.build(some<3, double>(3000));
  const LinearMap3 map{2, 0, 0, 0, 1, 0, 0, 0, 1};
  const Box3 half{{-1, -1, -1}, {5e5, 2e6, 2e6}}, all{{-1, -1, -1}, {2e6, 2e6, 2e6}};
  for (const Box3& box : {half, all}) {
    const MetricField3 field({{box, map}});
    expect_stops(
        [&](const base::StopCheck& check) {
          static_cast<void>(metric_tetrahedra(triangulation, field, check));
        },
        10);
  }
}

TEST(StopCheck, EndsRemovals) {
  const auto places = some<2, double>(20000);
  const auto points = some<3, double>(5000);
  const auto remove_most = [](auto triangulation, const auto& from, const base::StopCheck& check) {
    const std::vector<VertexId> vertices = triangulation.build(from);
    triangulation.set_check_stop(check);
    triangulation.remove(std::span(vertices).subspan(10));
  };
  expect_stops(
      [&](const base::StopCheck& check) { remove_most(Delaunay2<double>(), places, check); }, 20);
  expect_stops(
      [&](const base::StopCheck& check) { remove_most(Delaunay3<double>(), points, check); }, 5);
  // The triangles at the middle of a circle are a hole whose filling takes quadratic time.
  std::vector<std::array<double, 2>> circle{{0, 0}};
  for (int i = 0; i < 5000; ++i) {
    circle.push_back({std::cos(0.00125 * i), std::sin(0.00125 * i)});
  }
  expect_stops(
      [&](const base::StopCheck& check) {
        Delaunay2<double> triangulation;
        const std::vector<VertexId> vertices = triangulation.build(circle);
        triangulation.set_check_stop(check);
        triangulation.remove(vertices[0]);
      },
      1);
}

TEST(StopCheck, EndsTins) {
  constexpr std::uint32_t kSize = 60;
  std::mt19937_64 random(1);
  std::vector<double> heights, x, y;
  for (std::uint32_t row = 0; row < kSize; ++row) {
    for (std::uint32_t column = 0; column < kSize; ++column) {
      heights.push_back(static_cast<double>(random() % 1000));
      x.push_back(column + 1);
      y.push_back(row + 1);
    }
  }
  const GridWindow<double> window{kSize, kSize, heights};
  const std::vector<Point3> frame{{0, 0, 0}, {100, 0, 0}, {100, 100, 0}, {0, 100, 0}};
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(select_samples(window, settle_sides(window, 10), 10, check));
      },
      1000);
  for (const TinQuality quality : {TinQuality::greedy, TinQuality::removal, TinQuality::fitted}) {
    SCOPED_TRACE(static_cast<int>(quality));
    GridTinOptions grid{.max_error = 10, .quality = quality};
    expect_stops(
        [&](const base::StopCheck& check) {
          grid.check_stop = check;
          grid_tin(window, settle_sides(window, 10), grid);
        },
        1000);
    expect_stops(
        [&](const base::StopCheck& check) {
          grid.check_stop = check;
          grid_tin_of_points(window, 500, grid);
        },
        500);
    PointTinOptions points;
    points.max_error = 10;
    points.quality = quality;
    expect_stops(
        [&](const base::StopCheck& check) {
          points.check_stop = check;
          static_cast<void>(point_tin(x, y, heights, {}, points));
        },
        1000);
    // Samples in rows and columns have their own loops.
    points.lattice = TinLattice{0, 0.5};
    const std::span<const double> columns = std::span(x).first(kSize);
    expect_stops(
        [&](const base::StopCheck& check) {
          points.check_stop = check;
          static_cast<void>(point_tin(SampleRows{columns, columns, heights}, frame, points));
        },
        500);
  }
}

TEST(StopCheck, EndsMeasuringAndLines) {
  const auto samples = some<3, double>(20000);
  std::vector<double> x, y, z;
  for (const auto& p : samples) x.push_back(p[0]), y.push_back(p[1]), z.push_back(p[2]);
  const std::vector<Point3> corners{{0, 0, 0}, {2e6, 0, 0}, {0, 2e6, 0}};
  const std::vector<std::array<std::uint32_t, 3>> triangles{{0, 1, 2}};
  expect_stops(
      [&](const base::StopCheck& check) {
        static_cast<void>(measure_surface(x, y, z, corners, triangles, check));
      },
      10);
  std::sort(x.begin(), x.end());
  expect_stops(
      [&](const base::StopCheck& check) { static_cast<void>(simplify_line(x, z, 1, {}, check)); },
      5);
}

}  // namespace
}  // namespace terrace::tri
