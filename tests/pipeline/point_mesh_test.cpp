// SPDX-License-Identifier: GPL-3.0-or-later
// Error-bounded meshes of irregular points, window by window. For any points, the windows fit
// without gaps or overlaps, every sample is within the bound, and the result does not depend on
// threads.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/point_tin.hpp>

#include "point_mesh_case.hpp"
#include "terrace/stream/mesh_reader.hpp"
#include "terrace/terrain/bounded_mesh.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::tests {
namespace {

using terrain::Point2;

TEST_F(PointMesh, IsOnePieceWithinTheBoundForAnyPoints) {
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
      {"uniform", uniform(2500, 1)},
      {"clumps", clumps(2500, 2)},
      {"a full lattice", lattice(70, 50, 0, 0, 1, everywhere)},
      {"a lattice of tenths", lattice(60, 60, 500000.05, 5100000.05, 0.1, everywhere)},
      {"a diamond", lattice(81, 81, -7, 3, 1, diamond)},
      {"a triangle", lattice(71, 43, 0, 0, 3, triangle)},
      {"a ring", lattice(91, 91, 0, 0, 1, ring)},
      {"a circle", circle},
      {"two columns", columns},
      {"adjacent doubles as coordinates", lattice(60, 50, 0x1p52, -0x1p52 - 100, 1, everywhere)},
      {"tiny", lattice(60, 50, 3e-9, -1e-9, 1e-12, everywhere)},
      {"far off", uniform(3000, 3, 1e-3)},
  };
  for (const auto& [name, cloud] : clouds) {
    SCOPED_TRACE(name);
    const stream::Store store = build(cloud);
    for (const double max_error : {0.0, 3.0, 1000.0}) {
      SCOPED_TRACE(max_error);
      for (const std::size_t window : {300U, 900U}) {
        SCOPED_TRACE(window);
        mesh_and_check(store, cloud, options(max_error, window));
      }
    }
  }
}

TEST_F(PointMesh, IsValidForManyRandomClouds) {
  for (std::uint64_t seed = 10; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Cloud cloud = seed % 2 == 0 ? uniform(1500, seed, random(1, 1000)) : clumps(1500, seed);
    if (seed % 3 == 0) {
      // On a coarse lattice, one point per position.
      std::set<Point2> taken;
      const double step = random(0.5, 3);
      std::erase_if(cloud, [&](stream::Point3& p) {
        p = {std::round(p[0] / step) * step, std::round(p[1] / step) * step, p[2]};
        return !taken.insert({p[0], p[1]}).second;
      });
    }
    auto wanted = options(random(0, 5), 50 + static_cast<std::size_t>(random(0, 300)));
    wanted.quality = std::array{tri::TinQuality::greedy, tri::TinQuality::removal,
                                tri::TinQuality::fitted}[seed % 3];
    mesh_and_check(cloud, wanted);
  }
}

TEST_F(PointMesh, HasFewMoreTrianglesThanOneWindow) {
  const Cloud cloud = uniform(60000, 5, 300);
  const stream::Store store = build(cloud);
  for (const tri::TinQuality quality :
       {tri::TinQuality::greedy, tri::TinQuality::removal, tri::TinQuality::fitted}) {
    auto whole = options(2.0, 1U << 18), parts = options(2.0, 15000);
    whole.quality = parts.quality = quality;
    const auto one = mesh_and_check(store, cloud, whole);
    const auto many = mesh_and_check(store, cloud, parts);
    EXPECT_LT(static_cast<double>(many.triangles), 1.03 * static_cast<double>(one.triangles));
  }
}

TEST_F(PointMesh, IsTheSameForAnyThreadsAndMemory) {
  const stream::Store store = build(uniform(8000, 6));
  std::set<std::string> different;
  for (const unsigned threads : {1U, 2U, 5U}) {
    for (const std::uint64_t memory : {100U << 20, 1U << 30}) {
      write_bounded_mesh(store, options(1.0, 700), common(threads, memory));
      different.insert(bytes());
    }
  }
  EXPECT_EQ(different.size(), 1U);
  EXPECT_THROW(write_bounded_mesh(store, options(1.0, 700), common(1, 8U << 20)), stream::Error);
}

TEST_F(PointMesh, IsEmptyForCollinearPoints) {
  Cloud line;
  for (int i = 0; i < 1000; ++i) line.push_back({i * 3.0, i * 6.0 + 1, relief(i, 0)});
  const stream::Store store = build(line);
  for (const std::size_t window : {100U, 5000U}) {
    const auto result = write_bounded_mesh(store, options(1.0, window), common());
    EXPECT_EQ(result.triangles, 0U);
    EXPECT_EQ(result.vertices, 0U);
    EXPECT_EQ(result.samples, line.size());
    EXPECT_EQ(result.uncovered, line.size());
  }
}

TEST_F(PointMesh, KeepsAllSamplesOfAPositionWithinTheBound) {
  // Three samples at each position, in every part of the plane: inside, at the corners of the hull
  // and on its sides. Heights differ by up to `apart`.
  for (const double apart : {0.0, 0.4, 0.9}) {
    SCOPED_TRACE(apart);
    Random random(11);
    Cloud cloud = lattice(40, 40, 0, 0, 1, everywhere);
    for (const stream::Point3& p : uniform(1500, 12, 39)) cloud.push_back(p);
    const std::size_t places = cloud.size();
    for (std::size_t i = 0; i < places; ++i) {
      for (int k = 0; k < 2; ++k) {
        cloud.push_back({cloud[i][0], cloud[i][1], cloud[i][2] + random(0, apart)});
      }
    }
    const stream::Store store = build(cloud);
    std::vector<double> x, y, z;
    for (const stream::Point3& p : cloud) {
      x.push_back(p[0]);
      y.push_back(p[1]);
      z.push_back(p[2]);
    }
    for (const auto quality :
         {tri::TinQuality::greedy, tri::TinQuality::removal, tri::TinQuality::fitted}) {
      for (const std::size_t window : {400U, 1U << 20}) {
        SCOPED_TRACE(window);
        auto wanted = options(1.0, window);
        wanted.quality = quality;
        const auto result = write_bounded_mesh(store, wanted, common(2));
        EXPECT_EQ(result.samples, cloud.size());
        EXPECT_EQ(result.uncovered, 0U);
        EXPECT_EQ(result.duplicates, 2 * places);
        const terrain::TriangleMesh mesh =
            terrain::triangle_mesh_of(*stream::read_mesh(wanted.path));
        const tri::TinErrors errors = tri::measure_surface(x, y, z, mesh.positions, mesh.triangles);
        EXPECT_EQ(errors.covered, cloud.size());
        EXPECT_LE(errors.largest, 1.0 + 1e-9);
        EXPECT_NEAR(errors.largest, result.max_error, 1e-9);
        EXPECT_LT(result.vertices, places);
      }
    }
  }
}

TEST_F(PointMesh, RejectsSamplesOfAPositionThatDifferByMoreThanTheBound) {
  Cloud cloud = uniform(3000, 13);
  for (const std::size_t i : {5U, 2000U}) cloud.push_back(cloud[i]);
  cloud.push_back({cloud[7][0], cloud[7][1], cloud[7][2] + 12.5});
  const stream::Store store = build(cloud);
  for (const std::size_t window : {400U, 1U << 20}) {
    try {
      write_bounded_mesh(store, options(1.0, window), common(2));
      FAIL();
    } catch (const stream::Error& error) {
      EXPECT_NE(error.parts().cause.text().find(
                    "3 places have several samples with heights that differ by "
                    "up to 12.5 m"),
                std::string::npos)
          << error.what();
      EXPECT_NE(error.parts().remedy.text().find("`duplicates`"), std::string::npos);
    }
    EXPECT_LE(write_bounded_mesh(store, options(12.5, window), common()).max_error, 12.5);
  }
}

TEST_F(PointMesh, UsesOneHeightPerPositionOnRequest) {
  // Three samples at every position, in an order unrelated to height. The positions form a lattice,
  // so some are at the corners of the hull and on its sides.
  Cloud places = lattice(40, 40, 0, 0, 1, everywhere);
  Cloud cloud;
  for (const double up : {0.5, 0.0, 0.25}) {
    for (const stream::Point3& p : places) cloud.push_back({p[0], p[1], p[2] + up});
  }
  const stream::Store store = build(cloud);
  auto none = options(1.0, 500);
  none.duplicates = tri::PointDuplicates::error;
  EXPECT_THROW(write_bounded_mesh(store, none, common()), stream::Error);
  const std::vector<std::pair<tri::PointDuplicates, double>> rules{
      {tri::PointDuplicates::min, 0.0},
      {tri::PointDuplicates::max, 0.5},
      {tri::PointDuplicates::mean, 0.25}};
  for (const auto& [rule, up] : rules) {
    auto wanted = options(0.0, 500);
    wanted.duplicates = rule;
    const auto result = write_bounded_mesh(store, wanted, common());
    EXPECT_EQ(result.samples, cloud.size());
    EXPECT_EQ(result.duplicates, 2 * places.size());
    EXPECT_LE(result.max_error, 1e-12);
    const terrain::TriangleMesh mesh = terrain::triangle_mesh_of(*stream::read_mesh(wanted.path));
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
  // Too many at one position for any window.
  Cloud heap = uniform(500, 7);
  for (int i = 0; i < 2000; ++i) heap.push_back({50, 50, 1.0 * (i % 10)});
  auto wanted = options(1.0, 300);
  wanted.duplicates = tri::PointDuplicates::max;
  const auto result = write_bounded_mesh(build(heap), wanted, common());
  EXPECT_EQ(result.duplicates, 1999U);
  EXPECT_LE(result.max_error, 1.0);
}

TEST_F(PointMesh, OfARegionEqualsTheMeshOfItsSamples) {
  const Cloud cloud = uniform(9000, 8);
  const stream::Store store = build(cloud);
  auto wanted = options(0.8, 900);
  wanted.region = terrain::Region::parse("10.5,20,80,71");
  Cloud inside;
  std::copy_if(cloud.begin(), cloud.end(), std::back_inserter(inside),
               [&](const stream::Point3& p) { return wanted.region->contains(p); });
  mesh_and_check(store, inside, wanted);
}

TEST_F(PointMesh, KeepsTheBoundAfterRounding) {
  Cloud cloud = uniform(6000, 9, 1000);
  for (stream::Point3& p : cloud) p = {p[0] + 4e6, p[1] + 5e6, p[2]};
  const stream::Store store = build(cloud);
  auto wanted = options(0.5, 800);
  wanted.path = (folder_.path() / "mesh.glb").string();
  const auto result = write_bounded_mesh(store, wanted, common());
  EXPECT_LE(result.max_error, 0.5);
  EXPECT_GT(result.max_error, 0.3);
  EXPECT_EQ(result.samples, cloud.size());
}

/// The points of an uncompressed LAS file; empty if the file does not exist.
Cloud read_las(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  const auto number = [&]<class T>(std::size_t at, T value) {
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  if (bytes.size() < 227 || bytes.compare(0, 4, "LASF") != 0) return {};
  const std::size_t first = number(96, std::uint32_t{}), size = number(105, std::uint16_t{});
  Cloud cloud;
  for (std::size_t i = 0; i < number(107, std::uint32_t{}); ++i) {
    stream::Point3 p;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = number(first + i * size + 4 * k, std::int32_t{}) * number(131 + 8 * k, double{}) +
             number(155 + 8 * k, double{});
    }
    cloud.push_back(p);
  }
  return cloud;
}

TEST_F(PointMesh, IsValidForALaserScan) {
  const char* const data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "TERRACE_DATA is not set";
  const Cloud scan = read_las(std::filesystem::path(data) / "lidar" / "autzen_trim.las");
  if (scan.empty()) GTEST_SKIP() << "no lidar/autzen_trim.las";
  std::map<Point2, double> highest;
  for (const stream::Point3& p : scan) {
    const auto [at, fresh] = highest.try_emplace({p[0], p[1]}, p[2]);
    if (!fresh) at->second = std::max(at->second, p[2]);
  }
  Cloud cloud;
  for (const auto& [place, height] : highest) cloud.push_back({place[0], place[1], height});
  const stream::Store store = build(scan);
  for (const double max_error : {0.5, 5.0}) {
    SCOPED_TRACE(max_error);
    auto wanted = options(max_error, 15000);
    wanted.duplicates = tri::PointDuplicates::max;
    const auto result = write_bounded_mesh(store, wanted, common(2));
    EXPECT_EQ(result.samples, scan.size());
    EXPECT_EQ(result.duplicates, scan.size() - cloud.size());
    const auto errors =
        check_surface(cloud, terrain::triangle_mesh_of(*stream::read_mesh(wanted.path)));
    EXPECT_LE(errors.largest, max_error * (1 + 1e-9));
    EXPECT_NEAR(errors.largest, result.max_error, 1e-9);
    auto whole = wanted;
    whole.window_points = 1U << 20;
    const auto one = write_bounded_mesh(store, whole, common());
    EXPECT_LT(static_cast<double>(result.triangles), 1.03 * static_cast<double>(one.triangles));
  }
}

}  // namespace
}  // namespace terrace::tests
