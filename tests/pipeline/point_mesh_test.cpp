// SPDX-License-Identifier: GPL-3.0-or-later
// Error-bounded meshes of irregular points, window by window: whatever the points, the windows fit
// without gaps and overlaps, every sample is within the bound, and nothing depends on threads.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/point_tin.hpp>

#include "bounded_mesh.hpp"
#include "mesh_file.hpp"
#include "region.hpp"
#include "store_build.hpp"
#include "streaming_hull.hpp"
#include "temporary_folder.hpp"

namespace terrace {
namespace {

using tools::Point2;
using Cloud = std::vector<stream::Point3>;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double operator()(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }

 private:
  std::mt19937_64 engine_;
};

double relief(double x, double y) { return 40 * std::sin(x / 9) * std::cos(y / 7) + x / 3; }

Cloud uniform(std::size_t count, std::uint64_t seed, double size = 100) {
  Random random(seed);
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = random(0, size), y = random(0, size);
    cloud.push_back({x, y, relief(x, y) + random(-1, 1)});
  }
  return cloud;
}

/// Points in clumps, most of the plane empty.
Cloud clumps(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  Cloud cloud;
  std::vector<Point2> centres;
  for (int i = 0; i < 6; ++i) centres.push_back({random(0, 1000), random(0, 1000)});
  for (std::size_t i = 0; i < count; ++i) {
    const Point2& centre = centres[i % centres.size()];
    const double wide = i % 50 == 0 ? 300 : 4;
    const double x = centre[0] + random(-wide, wide) * random(0, 1);
    const double y = centre[1] + random(-wide, wide) * random(0, 1);
    cloud.push_back({x, y, relief(x / 5, y / 5)});
  }
  return cloud;
}

/// Every place of a lattice, of which `keep` tells which are there.
template <class Keep>
Cloud lattice(int columns, int rows, double x0, double y0, double step, const Keep& keep) {
  Cloud cloud;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      if (keep(c, r)) cloud.push_back({x0 + step * c, y0 + step * r, relief(c, r)});
    }
  }
  return cloud;
}
bool everywhere(int, int) { return true; }

class PointMesh : public testing::Test {
 protected:
  stream::Store build(const Cloud& cloud) {
    const std::string name = (folder_.path() / ("cloud" + std::to_string(++clouds_))).string();
    const auto writer = stream::open_point_writer(name + ".ply", {});
    stream::PointBlock block;
    block.positions = cloud;
    writer->append(block);
    writer->finish();
    tools::BuildRequest request;
    request.inputs = {name + ".ply"};
    request.store = name + ".store";
    request.block_points = 500;  // more levels
    tools::build_store(request);
    return stream::Store::open(request.store);
  }

  tools::BoundedMeshOptions options(double max_error, std::size_t window_points) {
    tools::BoundedMeshOptions out;
    out.max_error = max_error;
    out.window_points = window_points;
    out.path = (folder_.path() / "mesh.ply").string();
    out.writer.replace = true;
    return out;
  }

  static tools::CommonOptions common(unsigned threads = 1, std::uint64_t memory = 1U << 30) {
    tools::CommonOptions out;
    out.threads = threads;
    out.memory_bytes = memory;
    out.progress = tools::ProgressMode::none;
    return out;
  }

  std::string bytes() const {
    std::ifstream stream(folder_.path() / "mesh.ply", std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  /// Meshes and checks all that must hold whatever the points are, each with a place of its own.
  tools::BoundedMeshResult mesh_and_check(const Cloud& cloud,
                                          const tools::BoundedMeshOptions& options) {
    return mesh_and_check(build(cloud), cloud, options);
  }
  tools::BoundedMeshResult mesh_and_check(const stream::Store& store, const Cloud& cloud,
                                          const tools::BoundedMeshOptions& options);

  tests::TemporaryFolder folder_;
  int clouds_ = 0;
};

tools::BoundedMeshResult PointMesh::mesh_and_check(const stream::Store& store, const Cloud& cloud,
                                                   const tools::BoundedMeshOptions& options) {
  const tools::BoundedMeshResult result = bounded_point_mesh(store, options, common());
  const tools::TriangleMesh mesh = tools::read_mesh_file(options.path)->mesh;
  EXPECT_EQ(result.vertices, mesh.positions.size());
  EXPECT_EQ(result.triangles, mesh.triangles.size());
  EXPECT_EQ(result.samples, cloud.size());

  // Every sample, by other code.
  std::vector<double> x, y, z;
  std::vector<Point2> places;
  for (const stream::Point3& p : cloud) {
    x.push_back(p[0]);
    y.push_back(p[1]);
    z.push_back(p[2]);
    places.push_back({p[0], p[1]});
  }
  const tri::TinErrors errors = tri::measure_surface(x, y, z, mesh.positions, mesh.triangles);
  EXPECT_EQ(errors.uncovered, 0U);
  EXPECT_LE(errors.largest, options.max_error * (1 + 1e-9) + 1e-9);
  EXPECT_NEAR(errors.largest, result.max_error, 1e-9 * (1 + result.max_error));
  EXPECT_NEAR(errors.rms, result.rms_error, 1e-9 * (1 + result.rms_error));

  // No vertex twice, none unused; edges fit; the area is that of the hull.
  const std::set<stream::Point3> different(mesh.positions.begin(), mesh.positions.end());
  EXPECT_EQ(different.size(), mesh.positions.size());
  std::set<std::uint32_t> used;
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  const auto place = [&](std::uint32_t v) {
    return Point2{mesh.positions[v][0], mesh.positions[v][1]};
  };
  const Point2 origin = places.front();
  double area = 0;
  for (const auto& t : mesh.triangles) {
    EXPECT_GT(tools::orientation(place(t[0]), place(t[1]), place(t[2])), 0);
    for (std::size_t k = 0; k < 3; ++k) {
      used.insert(t[k]);
      const auto [edge, fresh] = edges.emplace(t[k], t[(k + 1) % 3]);
      EXPECT_TRUE(fresh) << "triangles overlap";
      const Point2 a = place(t[k]), b = place(t[(k + 1) % 3]);
      area += (a[0] - origin[0]) * (b[1] - origin[1]) - (b[0] - origin[0]) * (a[1] - origin[1]);
    }
  }
  EXPECT_EQ(used.size(), mesh.positions.size());
  const std::vector<Point2> hull = tools::convex_hull(places);
  double hull_area = 0;
  std::set<Point2> corners;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point2 a = hull[i], b = hull[(i + 1) % hull.size()];
    hull_area += (a[0] - origin[0]) * (b[1] - origin[1]) - (b[0] - origin[0]) * (a[1] - origin[1]);
  }
  EXPECT_NEAR(area, hull_area, 1e-9 * hull_area);
  // The border goes around once, along the hull.
  std::size_t border = 0;
  const double size = std::sqrt(hull_area);
  for (const auto& [from, to] : edges) {
    if (edges.contains({to, from})) continue;
    ++border;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < hull.size(); ++i) {
      const Point2 a = hull[i], b = hull[(i + 1) % hull.size()], p = place(from);
      const double dx = b[0] - a[0], dy = b[1] - a[1];
      nearest =
          std::min(nearest, std::abs(dx * (p[1] - a[1]) - dy * (p[0] - a[0])) / std::hypot(dx, dy));
    }
    EXPECT_LE(nearest, 1e-9 * size);
  }
  EXPECT_GE(border, hull.size());
  return result;
}

TEST_F(PointMesh, IsOnePieceWithinTheBoundWhateverThePoints) {
  const auto diamond = [](int c, int r) {
    return (c + r) % 2 == 0 && std::abs(c - 40) + std::abs(r - 40) <= 40;
  };
  const auto triangle = [](int c, int r) { return 3 * c + 5 * r <= 210; };
  const auto ring = [](int c, int r) {
    const double away = std::hypot(c - 45, r - 45);
    return away < 45 && away > 38;
  };
  Cloud circle;
  for (int i = 0; i < 3000; ++i) {
    circle.push_back({std::cos(i * 0.0021) * 50, std::sin(i * 0.0021) * 50, relief(i * 0.1, 0)});
  }
  Cloud columns;
  for (int i = 0; i < 2500; ++i) columns.push_back({i % 2 * 0.5, i * 0.25, relief(i * 0.1, 3)});
  const std::vector<std::pair<const char*, Cloud>> clouds{
      {"uniform", uniform(4000, 1)},
      {"clumps", clumps(4000, 2)},
      {"a whole lattice", lattice(70, 50, 0, 0, 1, everywhere)},
      {"a lattice of tenths", lattice(60, 60, 500000.05, 5100000.05, 0.1, everywhere)},
      {"a diamond", lattice(81, 81, -7, 3, 1, diamond)},
      {"a triangle", lattice(71, 43, 0, 0, 3, triangle)},
      {"a ring", lattice(91, 91, 0, 0, 1, ring)},
      {"a circle", circle},
      {"two columns", columns},
      {"no number between neighbours", lattice(60, 50, 0x1p52, -0x1p52 - 100, 1, everywhere)},
      {"tiny", lattice(60, 50, 3e-9, -1e-9, 1e-12, everywhere)},
      {"far off", uniform(3000, 3, 1e-3)},
  };
  for (const auto& [name, cloud] : clouds) {
    SCOPED_TRACE(name);
    const stream::Store store = build(cloud);
    for (const double max_error : {0.0, 0.5, 6.0, 1000.0}) {
      SCOPED_TRACE(max_error);
      for (const std::size_t window : {300U, 1100U}) {
        SCOPED_TRACE(window);
        mesh_and_check(store, cloud, options(max_error, window));
      }
    }
  }
}

TEST_F(PointMesh, OfManyRandomClouds) {
  for (std::uint64_t seed = 10; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Cloud cloud = seed % 2 == 0 ? uniform(1500, seed, random(1, 1000)) : clumps(1500, seed);
    if (seed % 3 == 0) {
      // On a coarse lattice, a point per place.
      std::set<Point2> taken;
      const double step = random(0.5, 3);
      std::erase_if(cloud, [&](stream::Point3& p) {
        p = {std::round(p[0] / step) * step, std::round(p[1] / step) * step, p[2]};
        return !taken.insert({p[0], p[1]}).second;
      });
    }
    auto wanted = options(random(0, 5), 50 + static_cast<std::size_t>(random(0, 300)));
    wanted.quality = std::array{tri::TinQuality::kGreedy, tri::TinQuality::kRemoval,
                                tri::TinQuality::kFitted}[seed % 3];
    mesh_and_check(cloud, wanted);
  }
}

TEST_F(PointMesh, HasHardlyMoreTrianglesThanOfOneWindow) {
  const Cloud cloud = uniform(60000, 5, 300);
  const stream::Store store = build(cloud);
  for (const tri::TinQuality quality :
       {tri::TinQuality::kGreedy, tri::TinQuality::kRemoval, tri::TinQuality::kFitted}) {
    auto whole = options(2.0, 1U << 18), parts = options(2.0, 15000);
    whole.quality = parts.quality = quality;
    const auto one = mesh_and_check(store, cloud, whole);
    const auto many = mesh_and_check(store, cloud, parts);
    EXPECT_LT(static_cast<double>(many.triangles), 1.03 * static_cast<double>(one.triangles));
  }
}

TEST_F(PointMesh, DependsNeitherOnThreadsNorOnMemory) {
  const stream::Store store = build(uniform(8000, 6));
  std::set<std::string> different;
  for (const unsigned threads : {1U, 2U, 5U}) {
    for (const std::uint64_t memory : {100U << 20, 1U << 30}) {
      bounded_point_mesh(store, options(1.0, 700), common(threads, memory));
      different.insert(bytes());
    }
  }
  EXPECT_EQ(different.size(), 1U);
  EXPECT_THROW(bounded_point_mesh(store, options(1.0, 700), common(1, 8U << 20)), stream::Error);
}

TEST_F(PointMesh, OfPointsOnOneLineIsEmpty) {
  Cloud line;
  for (int i = 0; i < 1000; ++i) line.push_back({i * 3.0, i * 6.0 + 1, relief(i, 0)});
  const stream::Store store = build(line);
  for (const std::size_t window : {100U, 5000U}) {
    const auto result = bounded_point_mesh(store, options(1.0, window), common());
    EXPECT_EQ(result.triangles, 0U);
    EXPECT_EQ(result.vertices, 0U);
    EXPECT_EQ(result.samples, line.size());
  }
}

TEST_F(PointMesh, TakesOneHeightPerPlaceAsAsked) {
  // Every place three times, in an order that is not that of heights; lattice places, so that some
  // are at the hull's corners and on its sides.
  Cloud places = lattice(40, 40, 0, 0, 1, everywhere);
  Cloud cloud;
  for (const double up : {0.5, 0.0, 0.25}) {
    for (const stream::Point3& p : places) cloud.push_back({p[0], p[1], p[2] + up});
  }
  const stream::Store store = build(cloud);
  EXPECT_THROW(bounded_point_mesh(store, options(1.0, 500), common()), stream::Error);
  const std::vector<std::pair<tri::PointDuplicates, double>> rules{
      {tri::PointDuplicates::kMin, 0.0},
      {tri::PointDuplicates::kMax, 0.5},
      {tri::PointDuplicates::kMean, 0.25}};
  for (const auto& [rule, up] : rules) {
    auto wanted = options(0.0, 500);
    wanted.duplicates = rule;
    const auto result = bounded_point_mesh(store, wanted, common());
    EXPECT_EQ(result.samples, cloud.size());
    EXPECT_EQ(result.duplicates, 2 * places.size());
    EXPECT_LE(result.max_error, 1e-12);
    const tools::TriangleMesh mesh = tools::read_mesh_file(wanted.path)->mesh;
    std::vector<double> x, y, z;
    for (const stream::Point3& p : places) {
      x.push_back(p[0]);
      y.push_back(p[1]);
      z.push_back(p[2] + up);
    }
    const tri::TinErrors errors = tri::measure_surface(x, y, z, mesh.positions, mesh.triangles);
    EXPECT_EQ(errors.uncovered, 0U);
    EXPECT_LE(errors.largest, 1e-9);
  }
  // Too many at one place for any window.
  Cloud heap = uniform(500, 7);
  for (int i = 0; i < 2000; ++i) heap.push_back({50, 50, 1.0 * (i % 10)});
  auto wanted = options(1.0, 300);
  wanted.duplicates = tri::PointDuplicates::kMax;
  const auto result = bounded_point_mesh(build(heap), wanted, common());
  EXPECT_EQ(result.duplicates, 1999U);
  EXPECT_LE(result.max_error, 1.0);
}

TEST_F(PointMesh, OfARegionIsTheMeshOfItsSamples) {
  const Cloud cloud = uniform(9000, 8);
  const stream::Store store = build(cloud);
  auto wanted = options(0.8, 900);
  wanted.region = tools::Region::parse("10.5,20,80,71");
  Cloud inside;
  std::copy_if(cloud.begin(), cloud.end(), std::back_inserter(inside),
               [&](const stream::Point3& p) { return wanted.region->contains(p); });
  mesh_and_check(store, inside, wanted);
}

TEST_F(PointMesh, KeepsTheBoundOnRoundedNumbers) {
  Cloud cloud = uniform(6000, 9, 1000);
  for (stream::Point3& p : cloud) p = {p[0] + 4e6, p[1] + 5e6, p[2]};
  const stream::Store store = build(cloud);
  auto wanted = options(0.5, 800);
  wanted.path = (folder_.path() / "mesh.glb").string();
  const auto result = bounded_point_mesh(store, wanted, common());
  EXPECT_LE(result.max_error, 0.5);
  EXPECT_GT(result.max_error, 0.3);
  EXPECT_EQ(result.samples, cloud.size());
}

}  // namespace
}  // namespace terrace
