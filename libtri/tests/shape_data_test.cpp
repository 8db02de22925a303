// SPDX-License-Identifier: Apache-2.0
// Scans in the data folder named by TERRACE_DATA.
#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include "scan_file.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri {
namespace {

class ShapeDataTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("TERRACE_DATA");
    if (folder == nullptr) GTEST_SKIP() << "TERRACE_DATA is not set";
    path_ = std::filesystem::path(folder) / "scan" / "bun_zipper.ply";
    if (!std::filesystem::exists(path_)) GTEST_SKIP() << path_ << " does not exist";
  }
  std::filesystem::path path_;
};

template <class Coord>
void expect_bunny(const Delaunay3<Coord>& triangulation, const Surface& original, double scale) {
  Shape3<Coord> shape;
  shape.restore(triangulation);
  const SurfaceMeasures measured = measure(shape.surface(triangulation).surface);
  const SurfaceMeasures wanted = measure(original);
  const double volume = measure(with_openings_closed(original)).volume;
  EXPECT_TRUE(measured.closed);
  EXPECT_EQ(measured.components, 1u);
  EXPECT_EQ(measured.border_edges, 0u);
  EXPECT_NEAR(measured.area * scale * scale / wanted.area, 1.0, 0.03);
  EXPECT_NEAR(measured.volume * scale * scale * scale / volume, 1.0, 0.02);
  EXPECT_NEAR(shape.volume(triangulation) / measured.volume, 1.0, 1e-9);
  EXPECT_EQ(measured.euler_characteristic, 2);
  EXPECT_EQ(measured.non_manifold_edges, 0u);
}

TEST_F(ShapeDataTest, BunnyIsOneClosedSurface) {
  std::ifstream file(path_, std::ios::binary);
  const Surface original = read_ply(file);
  ASSERT_EQ(original.points.size(), 35947u);
  ASSERT_EQ(original.faces.size(), 69451u);
  {
    SCOPED_TRACE("integers of 24 bits");
    double step = 0.0;
    const auto points = quantised(original.points, step);
    Delaunay3<std::int32_t> triangulation;
    triangulation.build(points);
    expect_bunny(triangulation, original, step);
  }
  {
    SCOPED_TRACE("doubles");
    Delaunay3<double> triangulation;
    triangulation.build(original.points);
    expect_bunny(triangulation, original, 1.0);
  }
}

}  // namespace
}  // namespace terrace::tri
