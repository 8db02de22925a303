// SPDX-License-Identifier: GPL-3.0-or-later
// Compares windows of the triangulation of a store's points with the triangulation of all of them.
#include "surface/point_window.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cloud_case.hpp"
#include "surface/window_tree.hpp"

namespace terrace {
namespace {

using terrain::Point2;
using terrain::PointCloud;
using terrain::PointWindow;
using terrain::StoredBox;
using tests::check_window;
using tests::cloud_store;
using tests::Points;
using tests::points_of;
using tests::Random;
using tests::raster_store;
using tests::Whole;

StoredBox random_box(const stream::Box3& bounds, Random& random, std::uint64_t i) {
  StoredBox box;
  for (std::size_t k = 0; k < 2; ++k) {
    const double size = bounds.max[k] - bounds.min[k];
    const double share = std::array{0.02, 0.3, 0.0, 1.1, 0.1}[i % 5];
    box.min[k] = bounds.min[k] + (random.unit() * 1.4 - 0.2) * size;
    if (i % 3 == 0) box.min[k] = std::round(box.min[k]);
    box.max[k] = box.min[k] + share * random.unit() * size;
    if (i % 3 == 0) box.max[k] = std::round(box.max[k]);
  }
  return box;
}

void check_windows(const stream::Store& store, unsigned level, int boxes,
                   bool knows_border = false) {
  const Whole whole(store, level);
  PointCloud cloud(store, level);
  PointWindow window(cloud);
  if (knows_border) {
    ASSERT_EQ(cloud.voids.find(window), whole.triangulation.triangle_count() > 0);
  }
  Random random(level + 3);
  for (int i = 0; i < boxes; ++i) {
    SCOPED_TRACE("level " + std::to_string(level) + ", box " + std::to_string(i));
    const StoredBox box = random_box(store.bounds(), random, static_cast<std::uint64_t>(i));
    window.load(box);
    check_window(whole, window, box);
  }
}

class Clouds : public testing::TestWithParam<std::string> {};

TEST_P(Clouds, WindowsHaveTheTrianglesOfTheFullTriangulation) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      stream::Store::open(cloud_store(folder.path(), points_of(GetParam())));
  check_windows(store, 0, 40);
  for (unsigned level = 1; level <= store.top(); ++level) check_windows(store, level, 12);
}

TEST_P(Clouds, WindowsWithKnownVoidsHaveTheSameTriangles) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      stream::Store::open(cloud_store(folder.path(), points_of(GetParam())));
  for (unsigned level = 0; level <= store.top(); ++level) check_windows(store, level, 20, true);
}

INSTANTIATE_TEST_SUITE_P(PointWindow, Clouds,
                         testing::Values("random", "lattice", "duplicates", "voids", "clusters",
                                         "turned", "winding", "straight borders", "circle",
                                         "parabola", "far", "huge", "tiny", "line", "nearly a line",
                                         "one", "two", "one place"),
                         [](const auto& one) {
                           std::string name = one.param;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(PointWindow, SupportsCoarserLevelsOfRasters) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(raster_store(folder.path()));
  ASSERT_GE(store.top(), 2U);
  for (unsigned level = 0; level <= store.top(); ++level) check_windows(store, level, 20);
}

TEST(PointWindow, ReadsFewPointsBeyondTheWindow) {
  const tests::TemporaryFolder folder;
  for (const char* const kind : {"random", "voids", "turned"}) {
    SCOPED_TRACE(kind);
    const stream::Store store =
        stream::Store::open(cloud_store(folder.path() / kind, points_of(kind)));
    PointCloud cloud(store, 0);
    PointWindow window(cloud);
    Random random(4);
    std::size_t read = 0;
    for (int i = 0; i < 200; ++i) {
      StoredBox box;
      for (std::size_t k = 0; k < 2; ++k) {
        const double size = store.bounds().max[k] - store.bounds().min[k];
        box.min[k] = store.bounds().min[k] + 0.95 * random.unit() * size;
        box.max[k] = box.min[k] + 0.05 * size;
      }
      window.load(box);
      read += window.triangulation().vertex_count();
    }
    // A box has one 400th of the area, about ten points. The coarse levels are read in addition
    // and, where the window reaches the hull, the points along it.
    EXPECT_LT(static_cast<double>(read) / 200, 0.1 * static_cast<double>(store.points()));
  }
}

// Bends leave voids whose circles contain most of the swath's border. Each window once searched for
// its missing points separately, which took minutes.
TEST(PointWindow, WindowsAlongAWindingSwathVisitFewBoxes) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(cloud_store(folder.path(), points_of("winding")));
  const terrain::WindowTree tree(store, 0, 200);
  ASSERT_GT(tree.size(), 50U);
  PointCloud cloud(store, 0);
  PointWindow window(cloud);
  std::size_t triangulated = 0;
  for (std::size_t i = 0; i < tree.size(); ++i) {
    window.load(tree.box(i));
    triangulated += window.triangulation().vertex_count();
  }
  RecordProperty("looks", std::to_string(cloud.voids.looks()));
  RecordProperty("triangulated", std::to_string(triangulated));
  EXPECT_TRUE(cloud.voids.known());
  EXPECT_LT(cloud.voids.looks(), 17 * store.points());
  EXPECT_LT(triangulated, 4 * store.points());
}

TEST(PointWindow, ReportsTheMemoryItNeeds) {
  const tests::TemporaryFolder folder;
  Random random(1);
  Points points;
  for (int i = 0; i < 60000; ++i) points.push_back({random.unit(), random.unit(), 0});
  const stream::Store store = stream::Store::open(cloud_store(folder.path(), points));
  PointCloud cloud(store, 0);
  PointWindow window(cloud, std::uint64_t{14} << 20);
  window.load({{0.4, 0.4}, {0.5, 0.5}});
  EXPECT_GT(window.triangulation().triangle_count(), 500U);
  try {
    window.load({{0, 0}, {1, 1}});
    FAIL();
  } catch (const stream::Error& error) {
    EXPECT_NE(std::string(error.what()).find("M of memory"), std::string::npos) << error.what();
  }
  window.load({{0.4, 0.4}, {0.5, 0.5}});
  EXPECT_GT(window.triangulation().triangle_count(), 500U);
}

}  // namespace
}  // namespace terrace
