// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes from a store: a focus contains every point inside, the mesh covers the hull without
// overlap, and a store of several clusters gives the same mesh as its points in one piece.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cli/option_values.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/detail_mesh.hpp"

namespace terrace {
namespace {

constexpr std::uint32_t kSize = 500;
constexpr double kCell = 30, kLeft = 500000, kTop = 5200000;

/// Twice the area of a triangle seen from above; positive when counter-clockwise.
double doubled_area(const terrain::TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const auto &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Checks that every edge is in one triangle (on the border) or two, and that all triangles are
/// counter-clockwise.
void expect_sound(const terrain::TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    ASSERT_GT(doubled_area(mesh, t), 0.0);
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1) << "an edge occurs twice in one direction, so triangles overlap";
  }
}

class Mesh : public testing::Test {
 protected:
  // The tests only read, so they share one store.
  static void SetUpTestSuite() {
    folder_ = new tests::TemporaryFolder;
    stream::GeoTiffOptions options;
    options.columns = options.rows = kSize;
    options.sample.type = stream::ScalarType::i16;
    options.world.xy = {kCell, 0, kLeft, 0, -kCell, kTop};
    std::vector<std::int16_t> samples;
    for (std::uint32_t row = 0; row < kSize; ++row) {
      for (std::uint32_t column = 0; column < kSize; ++column) {
        samples.push_back(static_cast<std::int16_t>(
            500 + 200 * std::sin(column / 40.0) + 150 * std::cos(row / 31.0) + (column * row) % 5));
      }
    }
    stream::GeoTiffWriter writer(folder_->path() / "dem.tif", options);
    writer.write_rows(std::as_bytes(std::span(samples)));
    writer.commit();
    terrain::BuildRequest request;
    request.inputs = {(folder_->path() / "dem.tif").string()};
    request.store = folder_->path() / "dem.store";
    request.block_points = 2000;  // more levels
    request.facility_cost = 1.0;
    terrain::build_store(request);
    store_ = new stream::Store(stream::Store::open(request.store));
    ASSERT_GE(store_->top(), 2u);
  }
  static void TearDownTestSuite() {
    delete store_;
    delete folder_;
  }

  static tests::TemporaryFolder* folder_;
  static stream::Store* store_;
};
tests::TemporaryFolder* Mesh::folder_ = nullptr;
stream::Store* Mesh::store_ = nullptr;

TEST_F(Mesh, OfALevelHasItsPointsAndThoseAbove) {
  for (unsigned level = 0; level <= store_->top(); ++level) {
    SCOPED_TRACE(level);
    const terrain::TriangleMesh mesh =
        detail_mesh(*store_, tools::parse_detail(*store_, std::to_string(level), "", {}));
    EXPECT_EQ(mesh.positions.size(), store_->levels()[level].points);
    expect_sound(mesh);
    for (const std::uint8_t l : mesh.levels) EXPECT_GE(l, level);
  }
}

TEST_F(Mesh, OfLevelZeroIsTheGrid) {
  const terrain::TriangleMesh mesh =
      detail_mesh(*store_, tools::parse_detail(*store_, "0", "", {}));
  EXPECT_EQ(mesh.positions.size(), std::size_t{kSize} * kSize);
  EXPECT_EQ(mesh.triangles.size(), std::size_t{2} * (kSize - 1) * (kSize - 1));
  double area = 0;
  for (const auto& t : mesh.triangles) area += doubled_area(mesh, t) / 2;
  EXPECT_EQ(area, (kSize - 1) * kCell * (kSize - 1) * kCell);
}

TEST_F(Mesh, HoldsEveryPointInsideAFocusAndFewOutside) {
  // Columns 200 to 260, rows 100 to 160; the borders run through samples.
  const std::string box = "506000,5195200,507800,5197000";
  const terrain::TriangleMesh mesh =
      detail_mesh(*store_, tools::parse_detail(*store_, "top", "", {box + ":0"}));
  expect_sound(mesh);
  std::set<std::pair<double, double>> inside;
  for (const auto& p : mesh.positions) {
    if (p[0] >= 506000 && p[0] <= 507800 && p[1] >= 5195200 && p[1] <= 5197000) {
      inside.emplace(p[0], p[1]);
    }
  }
  EXPECT_EQ(inside.size(), std::size_t{61} * 61);
  EXPECT_LT(mesh.positions.size(), std::size_t{kSize} * kSize / 10);
}

TEST_F(Mesh, OfARegionHasTheTrianglesThatTouchIt) {
  const std::string box = "505003,5190001,507004,5192002";
  const terrain::TriangleMesh part =
      detail_mesh(*store_, tools::parse_detail(*store_, "0", box, {}));
  expect_sound(part);
  // At full resolution the region's triangles are grid triangles.
  double inside = 0;
  for (const auto& t : part.triangles) {
    stream::Box3 bounds;
    for (const std::uint32_t v : t) bounds.include(part.positions[v]);
    EXPECT_TRUE(bounds.min[0] <= 507004 && bounds.max[0] >= 505003 && bounds.min[1] <= 5192002 &&
                bounds.max[1] >= 5190001);
    inside += doubled_area(part, t) / 2;
  }
  EXPECT_GE(inside, 2001.0 * 2001.0);
  EXPECT_LE(inside, (2001.0 + 4 * kCell) * (2001.0 + 4 * kCell));
}

// Clusters next to the polygon are skipped, yet the mesh has all triangles of the whole that touch
// it.
TEST_F(Mesh, OfAPolygonHasTheTrianglesThatTouchIt) {
  terrain::Detail detail;
  detail.region = terrain::Region::of_polygons(
      {{{{501003, 5190001}, {507004, 5197102}, {506904, 5197302}, {500903, 5190201}}}}, -1e9, 1e9);
  const auto corners = [](const terrain::TriangleMesh& mesh, const auto& keep) {
    std::vector<std::array<stream::Point3, 3>> triangles;
    for (const auto& t : mesh.triangles) {
      std::array<stream::Point3, 3> triangle{mesh.positions[t[0]], mesh.positions[t[1]],
                                             mesh.positions[t[2]]};
      std::sort(triangle.begin(), triangle.end());
      if (keep(triangle)) triangles.push_back(triangle);
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
  };
  const auto part = corners(detail_mesh(*store_, detail), [](const auto&) { return true; });
  const auto whole =
      corners(detail_mesh(*store_, terrain::Detail{}),
              [&detail](const auto& triangle) { return detail.region->touches(triangle); });
  EXPECT_GT(part.size(), 100U);
  EXPECT_EQ(part, whole);
}

TEST_F(Mesh, ReportsTheMemoryItNeeds) {
  try {
    static_cast<void>(detail_mesh(*store_, tools::parse_detail(*store_, "0", "", {}), {},
                                  {.memory_bytes = std::uint64_t{1} << 20}));
    FAIL() << "1 MiB was enough";
  } catch (const stream::Error& error) {
    EXPECT_NE(std::string(error.what()).find("needs"), std::string::npos) << error.what();
  }
}

TEST_F(Mesh, HasThePointsOfTheSameDetailAsVertices) {
  const terrain::Detail detail =
      tools::parse_detail(*store_, "1", "", {"506000,5195200,507800,5197000:0"});
  const terrain::TriangleMesh mesh = detail_mesh(*store_, detail);
  const terrain::TriangleMesh cloud = detail_points(*store_, detail);
  std::vector<stream::Point3> a = mesh.positions, b = cloud.positions;
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  EXPECT_EQ(a, b);
}

}  // namespace
}  // namespace terrace
