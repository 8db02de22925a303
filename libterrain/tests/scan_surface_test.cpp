// SPDX-License-Identifier: Apache-2.0
// Compares the surface of a scan with the sphere that its points are on.
#include "terrace/terrain/scan_surface.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <random>
#include <span>
#include <stop_token>
#include <string>

#include <gtest/gtest.h>
#include <terrace/base/stop_check.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

constexpr double kRadius = 100.0;
constexpr stream::Point3 kCentre{400000.0, 5200000.0, 700.0};

class ScanSurfaceTest : public ::testing::Test {
 protected:
  /// Makes 3,000 random points on a sphere, in metres.
  ScanSurfaceTest() {
    const std::filesystem::path text = folder_.path() / "points.xyz";
    std::mt19937_64 random(5);
    {
      std::ofstream file(text);
      const auto part = [&] { return 2.0 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1.0; };
      for (int i = 0; i < 3000;) {
        const stream::Point3 p{part(), part(), part()};
        const double length = std::hypot(p[0], p[1], p[2]);
        if (length < 0.1 || length > 1.0) continue;
        std::array<char, 100> line{};
        std::snprintf(line.data(), line.size(), "%.6f %.6f %.6f\n",
                      kCentre[0] + kRadius * p[0] / length, kCentre[1] + kRadius * p[1] / length,
                      kCentre[2] + kRadius * p[2] / length);
        file << line.data();
        ++i;
      }
    }
    BuildRequest request;
    request.inputs = {text.string()};
    request.store = folder_.path() / "store";
    request.block_points = 500;
    build_store(request);
  }

  [[nodiscard]] stream::Store store() const {
    return stream::Store::open(folder_.path() / "store");
  }
  static double radius_of(const stream::Point3& p) {
    return std::hypot(p[0] - kCentre[0], p[1] - kCentre[1], p[2] - kCentre[2]);
  }

  tests::TemporaryFolder folder_;
};

TEST_F(ScanSurfaceTest, SphereIsClosedWithCorrectAreaAndVolume) {
  const ScanSurface surface = scan_surface(store(), {});
  EXPECT_EQ(surface.mesh.positions.size(), 3000U);
  EXPECT_EQ(surface.mesh.levels.size(), 3000U);
  EXPECT_TRUE(surface.measures.closed);
  EXPECT_EQ(surface.measures.components, 1U);
  EXPECT_EQ(surface.measures.euler_characteristic, 2);
  EXPECT_NEAR(surface.measures.area, 4.0 * std::numbers::pi * kRadius * kRadius, 2e3);
  EXPECT_NEAR(surface.measures.volume, 4.0 / 3.0 * std::numbers::pi * std::pow(kRadius, 3), 6e4);
  for (const stream::Point3& p : surface.mesh.positions) EXPECT_NEAR(radius_of(p), kRadius, 1e-5);
}

TEST_F(ScanSurfaceTest, TetrahedraFillSurface) {
  ScanSurfaceOptions options;
  options.tetrahedra = true;
  const ScanSurface inside = scan_surface(store(), {}, options);
  EXPECT_TRUE(inside.mesh.triangles.empty());
  double volume = 0.0;
  for (const auto& t : inside.tetrahedra) {
    const auto edge = [&](std::size_t k, std::size_t axis) {
      return inside.mesh.positions[t[k]][axis] - inside.mesh.positions[t[0]][axis];
    };
    volume += std::abs(edge(1, 0) * (edge(2, 1) * edge(3, 2) - edge(2, 2) * edge(3, 1)) -
                       edge(1, 1) * (edge(2, 0) * edge(3, 2) - edge(2, 2) * edge(3, 0)) +
                       edge(1, 2) * (edge(2, 0) * edge(3, 1) - edge(2, 1) * edge(3, 0))) /
              6.0;
  }
  EXPECT_NEAR(volume, inside.measures.volume, 1e-6 * volume);
}

TEST_F(ScanSurfaceTest, MethodReturnsNewPointsUnlessItNamesInputs) {
  ScanSurfaceOptions options;
  std::size_t given = 0;
  options.method =
      SurfaceMethod{[&](std::span<const tri::Point3> points, const base::StopCheck&) {
                      given = points.size();
                      tri::RestoredSurface surface;
                      // In metres about the middle of the points.
                      surface.surface.points = {{0, 0, 0}, {kRadius, 0, 0}, {0, 0, kRadius}};
                      surface.surface.faces = {{0, 1, 2}};
                      return surface;
                    },
                    100};
  const ScanSurface made = scan_surface(store(), {}, options);
  EXPECT_EQ(given, 3000U);
  ASSERT_EQ(made.mesh.positions.size(), 3U);
  EXPECT_TRUE(made.mesh.levels.empty());
  EXPECT_LT(radius_of(made.mesh.positions[0]), 1.0);
  EXPECT_NEAR(radius_of(made.mesh.positions[1]), kRadius, 1.0);
  EXPECT_NEAR(made.mesh.positions[2][2] - made.mesh.positions[0][2], kRadius, 0.1);

  options.method->restore = [](std::span<const tri::Point3> points, const base::StopCheck&) {
    tri::RestoredSurface surface;
    surface.surface.points = {points[7], points[8], points[9]};
    surface.surface.faces = {{0, 1, 2}};
    surface.input = {7, 8, 9};
    return surface;
  };
  const ScanSurface named = scan_surface(store(), {}, options);
  ASSERT_EQ(named.mesh.positions.size(), 3U);
  for (const stream::Point3& p : named.mesh.positions) EXPECT_NEAR(radius_of(p), kRadius, 1e-5);
  EXPECT_EQ(named.samples_off, 2997U);
  options.tetrahedra = true;
  EXPECT_THROW(static_cast<void>(scan_surface(store(), {}, options)), UsageError);
}

TEST_F(ScanSurfaceTest, RejectsTooManyPointsAndStops) {
  try {
    static_cast<void>(scan_surface(store(), {}, {}, {.memory_bytes = std::uint64_t{1} << 20}));
    FAIL() << "3,000 points do not fit into 1 MiB";
  } catch (const stream::Error& error) {
    EXPECT_NE(std::string(error.what()).find("`memory_bytes`"), std::string::npos) << error.what();
  }
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(static_cast<void>(scan_surface(store(), {}, {}, {.stop = stop.get_token()})),
               stream::Stopped);
}

}  // namespace
}  // namespace terrace::terrain
