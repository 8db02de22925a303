// SPDX-License-Identifier: Apache-2.0
// Views of rasters that show only the vertices that an error needs, against brute force.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/store_view.hpp"
#include "test_raster.hpp"

namespace terrace::terrain {
namespace thinned_views {
namespace {

using View = StoreView<tri::ThinnedDelaunay2>;
using HasData = std::function<bool(std::int64_t column, std::int64_t row)>;

constexpr std::uint32_t kColumns = 500, kRows = 420;

double height_at(std::int64_t column, std::int64_t row) {
  const auto x = static_cast<double>(column), y = static_cast<double>(row);
  const double hills = 250.0 * std::sin(x / 37.0) * std::cos(y / 29.0) + x / 3;
  const double cliff = x > y + 60 ? 40.0 : 0.0;
  return std::round(400.0 + hills + cliff) + static_cast<double>((column * row) % 7);
}

bool everywhere(std::int64_t, std::int64_t) { return true; }
// Coast, lakes down to single cells, and an island.
bool coast(std::int64_t column, std::int64_t row) {
  const auto x = static_cast<double>(column), y = static_cast<double>(row);
  const bool land = x + 20 * std::sin(y / 15) < 330 && std::hypot(x - 80, y - 100) > 30;
  return (land && (column * 7 + row * 13) % 1001 != 0) || std::hypot(x - 430, y - 200) < 25;
}

class ThinnedViews : public testing::Test {
 protected:
  stream::Store build(const std::string& name, const HasData& has_data,
                      const std::array<double, 6>& world = {30, 0, 500000, 0, -30, 5200000}) {
    stream::GeoTiffOptions options;
    options.nodata = -9999;
    options.columns = kColumns;
    options.rows = kRows;
    options.world.xy = world;
    options.crs.epsg = 32632;
    const std::string file = (folder_.path() / (name + ".tif")).string();
    tests::write_test_raster(file, options, [&](std::uint32_t column, std::uint32_t row) {
      return has_data(column, row) ? height_at(column, row) : -9999.0;
    });
    BuildRequest request{.inputs = {file}, .store = folder_.path() / name};
    request.block_points = 1000;
    build_store(request);
    return stream::Store::open(request.store);
  }

  tests::TemporaryFolder folder_;
};

bool settle(View& view, const tri::View& wish, double seconds = 0.02) {
  for (int frame = 0; frame < 20000; ++frame) {
    view.frame(wish, seconds);
    if (view.settled()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

tri::View within(double metres) {
  tri::View view;
  view.ground_error = metres;
  return view;
}

tri::View looking_down(double east, double north, double pixel_error) {
  tri::View view;
  view.camera =
      tri::perspective_camera({{east, north, 4500.0}, {0, 0.3, -1}, {0, 1, 0}}, 50.0, 1.5, 720.0);
  view.pixel_error = pixel_error;
  return view;
}

struct Measured {
  double max_error = 0.0;     ///< metres
  std::size_t in_gaps = 0;    ///< samples without data in drawn triangles
  std::size_t uncovered = 0;  ///< samples in no triangle although their 8 neighbours have data
};

bool contains(const stream::Box3& cells, std::int64_t column, std::int64_t row) {
  const auto x = static_cast<double>(column), y = static_cast<double>(row);
  return x >= cells.min[0] && x <= cells.max[0] && y >= cells.min[1] && y <= cells.max[1];
}

/// Tests every sample with column and row in `cells` in every drawn triangle.
Measured measure(const View& view, const HasData& has_data, const stream::Box3& cells) {
  const auto& mesh = view.model().triangulation();
  Measured result;
  std::vector<bool> covered(std::size_t{kColumns} * kRows);
  for (const tri::TriangleId t : mesh.all_triangles()) {
    if (view.spans_gap(t)) continue;
    const auto ids = mesh.vertices(t);
    std::array<std::array<std::int64_t, 2>, 3> p;
    std::array<double, 3> z{};
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = {mesh.point(ids[k])[0], mesh.point(ids[k])[1]};
      z[k] = view.in_view_frame(ids[k])[2];
    }
    const auto turn = [](const auto& a, const auto& b, const auto& c) {
      return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    };
    const auto [left, right] = std::minmax({p[0][0], p[1][0], p[2][0]});
    const auto [top, bottom] = std::minmax({p[0][1], p[1][1], p[2][1]});
    for (std::int64_t y = top; y <= bottom; ++y) {
      for (std::int64_t x = left; x <= right; ++x) {
        if (!contains(cells, x, y)) continue;
        const std::array<std::int64_t, 2> q{x, y};
        const std::array<double, 3> w{static_cast<double>(turn(p[1], p[2], q)),
                                      static_cast<double>(turn(p[2], p[0], q)),
                                      static_cast<double>(turn(p[0], p[1], q))};
        if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
        if (!has_data(x, y)) {
          ++result.in_gaps;
          continue;
        }
        covered[static_cast<std::size_t>(y) * kColumns + static_cast<std::size_t>(x)] = true;
        const double there = (w[0] * z[0] + w[1] * z[1] + w[2] * z[2]) / (w[0] + w[1] + w[2]);
        result.max_error = std::max(result.max_error, std::abs(there - height_at(x, y)));
      }
    }
  }
  for (std::int64_t y = 1; y + 1 < kRows; ++y) {
    for (std::int64_t x = 1; x + 1 < kColumns; ++x) {
      if (!contains(cells, x, y)) continue;
      bool inner = true;
      for (std::int64_t v = y - 1; v <= y + 1; ++v)
        for (std::int64_t u = x - 1; u <= x + 1; ++u) inner = inner && has_data(u, v);
      result.uncovered +=
          inner && !covered[static_cast<std::size_t>(y) * kColumns + static_cast<std::size_t>(x)];
    }
  }
  return result;
}

const stream::Box3 kAll{{0, 0, 0}, {1e9, 1e9, 0}};

TEST_F(ThinnedViews, KeepAnErrorInMetresAtEverySample) {
  const stream::Store whole = build("whole", everywhere);
  const stream::Store gaps = build("gaps", coast);
  const stream::Store rotated = build("rotated", coast, {26, 15, 500000, 15, -26, 5200000});
  // All but one of the stores, and every other error, are left out under sanitizers.
  const std::array stores{&rotated, &whole, &gaps};
  for (std::size_t i = 0; i < stores.size(); i += TERRACE_TEST_SHARE) {
    const stream::Store* const store = stores[i];
    const HasData has_data = store == &whole ? everywhere : coast;
    std::size_t before = store->points();
    for (const double error : {0.0, 2.0, 10.0, 40.0, 150.0}) {
      std::set<std::uint64_t> hashes;
      for (const View::Reader reader : {View::Reader::thread, View::Reader::in_frame}) {
        View view(*store, {}, reader);
        ASSERT_TRUE(settle(view, within(error)));
        hashes.insert(view.model().triangulation().hash());
        if (reader == View::Reader::thread) continue;
        const Measured measured = measure(view, has_data, kAll);
        EXPECT_LE(measured.max_error, error + 1e-9);
        EXPECT_EQ(measured.in_gaps, 0u) << error;
        EXPECT_EQ(measured.uncovered, 0u) << error;
        // Fewer vertices for more error.
        if (error == 0.0) {
          EXPECT_EQ(view.points(), before);
        } else {
          EXPECT_LT(view.points(), before);
        }
        if (error >= 10.0) {
          EXPECT_LT(4 * view.points(), store->points());
        }
        before = view.points();
      }
      EXPECT_EQ(hashes.size(), 1u);
    }
  }
}

TEST_F(ThinnedViews, EndInTheSameStateOnAnyPath) {
  const stream::Store store = build("gaps", coast);
  std::mt19937 random(3);
  View wanderer(store);
  for (int stop = 0; stop < 4 / TERRACE_TEST_SHARE; ++stop) {
    // Not enough time to settle on the way.
    for (int frame = 0; frame < 30; ++frame) {
      wanderer.frame(
          looking_down(-6000.0 + 400.0 * frame, static_cast<double>(random() % 6000) - 3000,
                       stop % 2 == 0 ? 1.0 : 8.0),
          0.004);
    }
    const tri::View wish = within(5.0 + 10.0 * stop);
    ASSERT_TRUE(settle(wanderer, within(1e-3)));  // finer than wanted, so nothing is kept
    tri::View far = looking_down(1e7, 1e7, 50.0);
    ASSERT_TRUE(settle(wanderer, far));
    ASSERT_TRUE(settle(wanderer, wish));
    View fresh(store, {}, View::Reader::in_frame);
    ASSERT_TRUE(settle(fresh, wish));
    EXPECT_EQ(wanderer.points(), fresh.points());
    EXPECT_EQ(wanderer.model().triangulation().hash(), fresh.model().triangulation().hash());
  }
}

TEST_F(ThinnedViews, KeepTheErrorOfARegion) {
  const stream::Store store = build("whole", everywhere);
  View view(store);
  tri::View wish;
  // 100 x 80 cells around the middle.
  wish.regions.push_back({{{-1500, -1200, -1e9}, {1500, 1200, 1e9}}, 3.0});
  ASSERT_TRUE(settle(view, wish));
  const stream::Box3 cells{{kColumns / 2.0 - 49, kRows / 2.0 - 39, 0},
                           {kColumns / 2.0 + 49, kRows / 2.0 + 39, 0}};
  EXPECT_LE(measure(view, everywhere, cells).max_error, 3.0);
  EXPECT_LT(view.model().triangulation().sample_count(), store.points());
}

TEST_F(ThinnedViews, ShowEverySampleOfAFocusAndOfAPinnedCluster) {
  const stream::Store store = build("whole", everywhere);
  View view(store);
  tri::View wish = within(50.0);
  wish.focuses.push_back({{{-300, -300, -1e9}, {300, 300, 1e9}}, 0});
  ASSERT_TRUE(settle(view, wish));
  const stream::Box3 cells{{kColumns / 2.0 - 9, kRows / 2.0 - 9, 0},
                           {kColumns / 2.0 + 9, kRows / 2.0 + 9, 0}};
  EXPECT_EQ(measure(view, everywhere, cells).max_error, 0.0);
  wish.focuses.clear();
  ASSERT_TRUE(settle(view, wish));
  const std::size_t few = view.points();
  view.pin(tri::cluster_id(0, 0), tri::ViewPin::expanded);
  ASSERT_TRUE(settle(view, wish));
  const auto members = store.record(tri::cluster_id(0, 0));
  EXPECT_GE(view.points(), few + members.points / 2);
  std::size_t shown = 0;
  for (const tri::VertexId v : view.model().triangulation().all_vertices())
    shown += view.model().point_id(v).cluster == tri::cluster_id(0, 0);
  EXPECT_EQ(shown, members.points);
  view.unpin(tri::cluster_id(0, 0));
  ASSERT_TRUE(settle(view, wish));
  EXPECT_EQ(view.points(), few);
}

TEST_F(ThinnedViews, HalfTheErrorNeedsAtMostFourTimesThePoints) {
  const stream::Store store = build("whole", everywhere);
  View view(store);
  std::size_t before = 0;
  // Below 2 pixels, which are 12 m, the noise of 6 m counts.
  for (double pixels = 32.0; pixels >= 2.0; pixels /= 2) {
    ASSERT_TRUE(settle(view, looking_down(0, 0, pixels)));
    if (before > 0) {
      EXPECT_LE(view.points(), 4 * before) << pixels;
    }
    before = view.points();
  }
}

// In the middle of the picture, where samples are read, the error in pixels is kept.
TEST_F(ThinnedViews, KeepAnErrorInPixels) {
  const stream::Store store = build("gaps", coast);
  View view(store);
  const tri::View wish = looking_down(0, 0, 1.0);
  ASSERT_TRUE(settle(view, wish));
  const auto& mesh = view.model().triangulation();
  std::size_t thinned = 0;
  for (std::uint32_t i = 0; i < mesh.window_slots(); ++i) {
    const auto* window = mesh.window(i);
    if (window == nullptr || !window->thinned) continue;
    ++thinned;
    const auto corner = [](const auto& p) {
      return stream::Point3{static_cast<double>(p[0]), static_cast<double>(p[1]), 0.0};
    };
    const Measured measured = measure(view, coast, {corner(window->low), corner(window->high)});
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& p : {window->low, window->high}) {
      const stream::Point3 at = view.in_view_frame({1.0 * p[0], 1.0 * p[1], window->highest});
      nearest = std::min(nearest, std::hypot(at[0], at[1], at[2] - 4500.0));
    }
    if (window->step < tri::ThinnedDelaunay2::kFewest) {
      EXPECT_LE(measured.max_error, 1.0001 * nearest / wish.camera->pixels);
    }
  }
  EXPECT_GT(thinned, 4u);
}

TEST_F(ThinnedViews, StayWithinTheirLimits) {
  const stream::Store store = build("whole", everywhere);
  tri::ViewOptions options;
  options.max_points = 20000;
  View view(store, options);
  ASSERT_TRUE(settle(view, within(1.0)));
  EXPECT_LE(view.points(), 20000u);
  EXPECT_GT(view.points(), 4000u);
  // The view says that it is not as fine as it should be.
  const auto& step = view.frame(within(1.0), 0.01);
  EXPECT_GT(step.worst, 1.0);
  EXPECT_GT(step.blocked, 0u);
  ASSERT_TRUE(settle(view, within(100.0)));
  EXPECT_LE(measure(view, everywhere, kAll).max_error, 100.0);
}

TEST_F(ThinnedViews, DeltasAddUpToTheMesh) {
  const stream::Store store = build("gaps", coast);
  View view(store);
  std::map<tri::TriangleId, std::array<tri::VertexId, 3>> drawn;
  std::set<tri::VertexId> vertices;
  const auto& mesh = view.model().triangulation();
  for (const auto t : mesh.all_triangles()) drawn[t] = mesh.vertices(t);
  for (const auto v : mesh.all_vertices()) vertices.insert(v);
  for (int frame = 0; frame < 150; ++frame) {
    const auto& changes =
        view.frame(looking_down(-5000.0 + 70.0 * frame, -500.0, 2.0), 0.005).delta->changes;
    for (const auto t : changes.removed_triangles) EXPECT_EQ(drawn.erase(t), 1u);
    for (const auto v : changes.removed_vertices) EXPECT_EQ(vertices.erase(v), 1u);
    for (const auto v : changes.added_vertices) EXPECT_TRUE(vertices.insert(v).second);
    for (const auto t : changes.added_triangles)
      EXPECT_TRUE(drawn.emplace(t, mesh.vertices(t)).second);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::map<tri::TriangleId, std::array<tri::VertexId, 3>> there;
  for (const auto t : mesh.all_triangles()) there[t] = mesh.vertices(t);
  EXPECT_EQ(drawn, there);
  EXPECT_EQ(vertices.size(), view.points());
}

}  // namespace
}  // namespace thinned_views
}  // namespace terrace::terrain
