// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/store_view.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/given_bytes.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "test_raster.hpp"

namespace terrace::terrain {
namespace {

/// A raster of hills, 300 x 260 cells of about 30 m, in metres or in degrees.
class StoreViews : public testing::Test {
 protected:
  static constexpr std::uint32_t kColumns = 300, kRows = 260;

  using HasData = std::function<bool(std::uint32_t column, std::uint32_t row)>;

  stream::Store build(
      const std::string& name, const std::array<double, 6>& world, int epsg,
      const HasData& has_data = [](auto, auto) { return true; }) {
    stream::GeoTiffOptions options;
    options.nodata = -9999;
    options.columns = kColumns;
    options.rows = kRows;
    options.world.xy = world;
    options.crs.epsg = epsg;
    options.crs.geographic = epsg == 4326;
    const std::string file = (folder_.path() / (name + ".tif")).string();
    tests::write_test_raster(file, options, [&](std::uint32_t column, std::uint32_t row) {
      if (!has_data(column, row)) return -9999.0;
      return 300.0 + 150.0 * std::sin(column / 17.0) * std::cos(row / 23.0) + (column * row) % 7;
    });
    BuildRequest request{.inputs = {file}, .store = folder_.path() / name};
    request.block_points = 1000;
    build_store(request);
    return stream::Store::open(request.store);
  }
  stream::Store in_metres() { return build("metres", {30, 0, 500000, 0, -30, 5200000}, 32632); }

  tests::TemporaryFolder folder_;
};

tri::View looking_down(double east, double north, double pixel_error) {
  tri::View view;
  view.camera =
      tri::perspective_camera({{east, north, 2500.0}, {0, 0.3, -1}, {0, 1, 0}}, 50.0, 1.5, 720.0);
  view.pixel_error = pixel_error;
  return view;
}

template <class Coord>
bool settle(StoreView<Coord>& view, const tri::View& wish) {
  for (int frame = 0; frame < 20000; ++frame) {
    view.frame(wish, 0.01);
    if (view.settled()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

/// Counts the points of the expanded clusters and of the root, each once.
template <class Coord>
std::uint64_t points_expected(const StoreView<Coord>& view, const stream::Store& store) {
  std::uint64_t points = store.levels()[store.top()].members;
  for (const tri::ClusterId id : view.model().expanded()) {
    points += store.record(id).points;
  }
  return points;
}

TEST_F(StoreViews, ReachRequestedDetailWithAnyReader) {
  const stream::Store store = in_metres();
  using View = StoreView<std::int32_t>;
  std::set<std::uint64_t> hashes;
  for (const View::Reader reader : {View::Reader::thread, View::Reader::in_frame}) {
    View view(store, {}, reader);
    const std::size_t coarse = view.model().point_count();
    ASSERT_TRUE(settle(view, looking_down(0, 0, 1.5)));
    EXPECT_GT(view.model().point_count(), 2 * coarse);
    EXPECT_LT(view.model().point_count(), store.points());
    EXPECT_EQ(view.model().point_count(), points_expected(view, store));
    EXPECT_EQ(view.model().triangulation().vertex_count(), view.model().point_count());
    EXPECT_GT(view.traffic().clusters, 0u);
    EXPECT_GE(view.traffic().points, view.model().point_count());
    EXPECT_GT(view.traffic().bytes, 0u);
    hashes.insert(view.model().triangulation().hash());
    // From far away only the root remains.
    tri::View away;
    away.ground_error = 1e9;
    ASSERT_TRUE(settle(view, away));
    EXPECT_EQ(view.model().point_count(), coarse);
  }
  EXPECT_EQ(hashes.size(), 1u);
}

TEST_F(StoreViews, DeltasAddUpToTheMesh) {
  const stream::Store store = in_metres();
  StoreView<double> view(store);
  std::set<tri::TriangleId> drawn;
  for (const auto t : view.model().triangulation().all_triangles()) drawn.insert(t);
  for (int frame = 0; frame < 120; ++frame) {
    const auto& step = view.frame(looking_down(-3000.0 + 50.0 * frame, -500.0, 2.0), 0.005);
    for (const auto t : step.delta->changes.removed_triangles) EXPECT_EQ(drawn.erase(t), 1u);
    for (const auto t : step.delta->changes.added_triangles) EXPECT_TRUE(drawn.insert(t).second);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::set<tri::TriangleId> there;
  for (const auto t : view.model().triangulation().all_triangles()) there.insert(t);
  EXPECT_EQ(drawn, there);
}

TEST_F(StoreViews, UseMetresForAnyCrs) {
  // At 46 degrees north, 30 m are 0.00026999 degrees of latitude and 0.00038775 of longitude.
  const stream::Store metres = in_metres();
  const stream::Store degrees =
      build("degrees", {0.00038775, 0, 8.0, 0, -0.00026999, 46.035}, 4326);
  const StoreView<std::int32_t> one(metres), other(degrees);
  EXPECT_NEAR(one.in_view_frame({0, 0, 300})[0], -0.5 * 299 * 30, 10.0);
  EXPECT_NEAR(one.in_view_frame({0, 0, 300})[1], 0.5 * 259 * 30, 10.0);
  EXPECT_NEAR(one.in_view_frame({0, 0, 300})[2], 300.0, 1e-9);
  for (const stream::Point3& p :
       {stream::Point3{0, 0, 0}, stream::Point3{299, 0, 100}, stream::Point3{150, 259, 450}}) {
    const stream::Point3 a = one.in_view_frame(p), b = other.in_view_frame(p);
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(a[axis], b[axis], 20.0) << axis;
  }
  StoreView<std::int32_t> flat(metres), geographic(degrees);
  ASSERT_TRUE(settle(flat, looking_down(0, 0, 1.5)));
  ASSERT_TRUE(settle(geographic, looking_down(0, 0, 1.5)));
  EXPECT_NEAR(static_cast<double>(flat.model().point_count()),
              static_cast<double>(geographic.model().point_count()),
              0.1 * static_cast<double>(flat.model().point_count()));
}

/// Whether a triangle spans a gap by definition, using all clusters' records.
bool spans_gap_by_records(const StoreView<std::int32_t>& view, const stream::Store& store,
                          tri::TriangleId triangle) {
  const auto& model = view.model();
  const auto corners = model.triangulation().vertices(triangle);
  stream::Box3 around;
  stream::Point3 centroid{};
  for (const tri::VertexId corner : corners) {
    const auto p = model.triangulation().point(corner);
    around.include(stream::Point3{1.0 * p[0], 1.0 * p[1], 0});
    for (std::size_t k = 0; k < 2; ++k) centroid[k] += p[k] / 3.0;
  }
  if (around.max[0] - around.min[0] <= 1 && around.max[1] - around.min[1] <= 1) return false;
  std::vector<tri::ClusterId> expanded = model.expanded(), children;
  expanded.push_back(tri::cluster_id(model.top(), 0));
  for (const tri::ClusterId cluster : expanded) {
    if (tri::level_of(cluster) == 0) continue;
    model.children(cluster, children);
    for (const tri::ClusterId child : children) {
      if (model.is_expanded(child)) continue;
      const stream::Box3 box = store.record(child).summary.box;
      bool near = true;
      for (std::size_t k = 0; k < 2; ++k) {
        near = near && box.min[k] <= centroid[k] + 1.001 && box.max[k] >= centroid[k] - 1.001;
      }
      if (near) return false;
    }
  }
  return true;
}

// Coast, lakes down to single cells, and an island: without the triangles that span a gap, exactly
// the land is drawn.
TEST_F(StoreViews, RecogniseTrianglesOverGaps) {
  const auto has_data = [](std::uint32_t column, std::uint32_t row) {
    const double x = column, y = row;
    const bool land = x + 20 * std::sin(y / 15) < 200 && std::hypot(x - 80, y - 100) > 30;
    return (land && (column * 7 + row * 13) % 101 != 0) || std::hypot(x - 270, y - 200) < 15;
  };
  const stream::Store store = build("coast", {30, 0, 500000, 0, -30, 5200000}, 32632, has_data);
  // Rotated by 30 degrees, and without gaps.
  const stream::Store rotated =
      build("rotated", {26, 15, 500000, 15, -26, 5200000}, 32632, has_data);
  const stream::Store whole = in_metres();
  for (const stream::Store* of : {&store, &rotated, &whole}) {
    StoreView<std::int32_t> view(*of);
    std::mt19937 random(1);
    std::size_t gaps = 0, differ = 0;
    for (int stop = 0; stop < 8; ++stop) {
      tri::View wish =
          looking_down(-4000.0 + 1000.0 * stop, static_cast<double>(random() % 4000) - 2000,
                       stop % 3 == 0 ? 40.0 : 3.0);
      if (stop == 7) wish.ground_error = 0;
      ASSERT_TRUE(settle(view, wish));
      for (const tri::TriangleId triangle : view.model().triangulation().all_triangles()) {
        const bool spans = view.spans_gap(triangle);
        gaps += spans;
        if (spans == spans_gap_by_records(view, *of, triangle)) continue;
        // Bounds of unread records, and boxes of a rotated raster, are larger.
        ASSERT_FALSE(spans);
        ++differ;
      }
    }
    if (of == &whole) {
      EXPECT_EQ(gaps, 0u);
      continue;
    }
    EXPECT_GT(gaps, 2000u);
    EXPECT_LT(differ, gaps / 4);
    // At full detail, exactly the triangles between neighbours remain.
    EXPECT_EQ(view.model().point_count(), of->points());
    std::size_t drawn = 0, between_neighbours = 0;
    for (const tri::TriangleId triangle : view.model().triangulation().all_triangles()) {
      drawn += !view.spans_gap(triangle);
    }
    for (std::uint32_t row = 0; row + 1 < kRows; ++row) {
      for (std::uint32_t column = 0; column + 1 < kColumns; ++column) {
        const int corners = has_data(column, row) + has_data(column + 1, row) +
                            has_data(column, row + 1) + has_data(column + 1, row + 1);
        between_neighbours += corners == 4 ? 2 : corners == 3 ? 1 : 0;
      }
    }
    EXPECT_EQ(drawn, between_neighbours);
    EXPECT_EQ(detail_mesh(*of, {.level = 0}).triangles.size(), between_neighbours);
  }
}

// The coarsest mesh leaves the sea open; a raster without gaps loses no triangle.
TEST_F(StoreViews, MeshesOfALevelHaveNoTrianglesOverGaps) {
  const auto has_data = [](std::uint32_t column, std::uint32_t row) {
    return column < 100 || (column > 200 && row > 100);
  };
  const stream::Store bay = build("bay", {1, 0, 0, 0, -1, 0}, 32632, has_data);
  const stream::Store whole = build("whole", {1, 0, 0, 0, -1, 0}, 32632);
  for (unsigned level = 0; level <= bay.top(); ++level) {
    const TriangleMesh mesh = detail_mesh(bay, {.level = level});
    EXPECT_EQ(mesh.positions.size(), bay.levels()[level].points);
    EXPECT_GT(mesh.triangles.size(), mesh.positions.size());
    for (const auto& triangle : mesh.triangles) {
      double x = 0;
      for (const std::uint32_t corner : triangle) x += mesh.positions[corner][0] / 3;
      EXPECT_FALSE(x > 130 && x < 170) << "level " << level;
    }
  }
  for (unsigned level = 0; level <= whole.top(); ++level) {
    const TriangleMesh mesh = detail_mesh(whole, {.level = level});
    tri::Delaunay2<double> delaunay;
    for (const stream::Point3& p : mesh.positions) delaunay.insert({p[0], p[1]});
    EXPECT_EQ(mesh.triangles.size(), delaunay.triangle_count());
  }
}

using Places = std::vector<Point2>;

/// Returns the part of a convex polygon to the left of a line.
Places left_of(const Point2& from, const Point2& to, const Places& polygon) {
  const auto side = [&](const Point2& p) {
    return (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0]);
  };
  Places result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double at_a = side(a), at_b = side(b);
    if (at_a >= 0) result.push_back(a);
    if ((at_a > 0 && at_b < 0) || (at_a < 0 && at_b > 0)) {
      const double part = at_a / (at_a - at_b);
      result.push_back({a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])});
    }
  }
  return result;
}

double area_of(const Places& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return twice / 2;
}

/// Returns the area of a triangle over squares of four samples with data, or over the half of a
/// square that has three.
template <class HasData>
double area_with_data(const Places& triangle, const HasData& has_data) {
  std::array<double, 2> low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  for (const Point2& p : triangle) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  double area = 0;
  for (double y = low[1]; y < high[1]; ++y) {
    for (double x = low[0]; x < high[0]; ++x) {
      Places piece;
      for (const Point2& corner : Places{{x, y}, {x + 1, y}, {x + 1, y + 1}, {x, y + 1}}) {
        if (has_data(corner)) piece.push_back(corner);
      }
      if (piece.size() < 3) continue;
      Places part = triangle;
      for (std::size_t i = 0; i < piece.size(); ++i) {
        part = left_of(piece[i], piece[(i + 1) % piece.size()], part);
      }
      area += area_of(part);
    }
  }
  return area;
}

// Checks the definition of the surface for any ellipses and any missing data: no triangle covers
// cells without data, and all of the land is covered once.
TEST_F(StoreViews, MeshesCoverSameAreaWithAMetric) {
  std::mt19937 random(5);
  const auto number = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
  };
  for (int round = 0; round < 4; ++round) {
    SCOPED_TRACE(round);
    // Scattered voids, lakes, and a sea with a rugged coast.
    const double share = number(0, 0.1), radius = number(5, 60), coast = number(150, 290);
    std::vector<bool> data;
    for (std::uint32_t row = 0; row < kRows; ++row) {
      for (std::uint32_t column = 0; column < kColumns; ++column) {
        const bool lake = std::hypot(column - 90.0, row - 120.0) < radius;
        const bool sea = column + 9 * std::sin(row / 4.0) > coast;
        data.push_back(!lake && !sea && number(0, 1) > share);
      }
    }
    const auto has_data = [&](std::uint32_t column, std::uint32_t row) {
      return static_cast<bool>(data[row * kColumns + column]);
    };
    const stream::Store store =
        build("voids" + std::to_string(round), {1, 0, 0, 0, -1, 0}, 32632, has_data);
    for (int turn = 0; turn < 3; ++turn) {
      const std::string path = (folder_.path() / "metric.json").string();
      std::ofstream(path) << R"({"regions":[{"box":[40,-200,250,-20],"semi_axes":[)"
                          << number(1, turn == 2 ? 30 : 4) << R"(,1],"angle":)" << number(0, 180)
                          << R"(},{"semi_axes":[)" << number(1, 3) << R"(,1],"angle":)"
                          << number(0, 180) << "}]}";
      DetailMeshOptions options;
      options.metric = MetricChoice::parse("elliptical:" + path);
      for (unsigned level = 0; level <= store.top(); ++level) {
        const TriangleMesh plain = detail_mesh(store, {.level = level});
        const TriangleMesh mesh = detail_mesh(store, {.level = level}, options);
        EXPECT_EQ(mesh.positions.size(), plain.positions.size());
        EXPECT_EQ(mesh.triangles.size(), plain.triangles.size());
        if (level > 0) continue;
        double covered = 0, over_voids = 0, land = 0;
        std::size_t slanted = 0;
        for (const auto& corners : mesh.triangles) {
          Places triangle;
          double length = 0;
          for (const std::uint32_t corner : corners) {
            const stream::Point3& p = mesh.positions[corner];
            triangle.push_back({std::round(p[0]), std::round(p[1])});
            length = std::max(length, std::hypot(triangle.back()[0] - triangle[0][0],
                                                 triangle.back()[1] - triangle[0][1]));
          }
          slanted += length > 1.5;
          const double area = area_of(triangle);
          ASSERT_GT(area, 0);
          covered += area;
          over_voids += area - area_with_data(triangle, [&](const Point2& p) {
                          return has_data(static_cast<std::uint32_t>(p[0]),
                                          static_cast<std::uint32_t>(-p[1]));
                        });
        }
        for (const auto& corners : plain.triangles) {
          Places triangle;
          for (const std::uint32_t corner : corners) {
            triangle.push_back({plain.positions[corner][0], plain.positions[corner][1]});
          }
          land += area_of(triangle);
        }
        EXPECT_NEAR(covered, land, 1e-6);
        EXPECT_NEAR(over_voids, 0, 1e-6);
        if (turn == 2) {
          EXPECT_GT(slanted, 1000u);
        }
      }
    }
  }
}

// As in a browser: bytes arrive in any order, a few of the missing ones after each frame. The
// result must equal that of a view of the folder, for triangles and for points alone.
TEST_F(StoreViews, ReachSameResultForAnyOrderOfBytes) {
  const stream::Store whole = in_metres();
  const auto fly = [&](auto shown, double pixel_error) {
    using View = StoreView<decltype(shown)>;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(seed);
      std::mt19937_64 random(seed);
      View expected(whole, {}, View::Reader::in_frame);
      stream::GivenBytes given(seed == 3 ? 100'000 : 64'000'000);  // 3: some are dropped again
      for (const auto& entry : std::filesystem::directory_iterator(whole.path())) {
        given.add_file(entry.path().filename().string(), entry.file_size());
      }
      const auto give = [&](const stream::ByteRange& range) {
        std::vector<std::byte> bytes(range.bytes);
        stream::open_file(whole.path() / range.file)->read(range.offset, bytes);
        given.give(range.file, range.offset, bytes);
      };
      const auto brought = [&](auto&& make) {
        for (;;) {
          try {
            return make();
          } catch (const stream::MissingBytes& missing) {
            for (const stream::ByteRange& range : missing.ranges()) give(range);
          }
        }
      };
      const stream::Store store =
          brought([&] { return stream::Store::open("given", given.open()); });
      const auto view = brought(
          [&] { return std::make_unique<View>(store, expected.ground(), tri::ViewOptions{}); });
      EXPECT_EQ(view->model().triangulation().hash(), expected.model().triangulation().hash());
      for (const double east : {-2000.0, 1500.0, 0.0}) {
        const tri::View wish = looking_down(east, east / 2, pixel_error);
        ASSERT_TRUE(settle(expected, wish));
        bool settled = false;
        for (int frame = 0; frame < 20000 && !settled; ++frame) {
          view->frame(wish, 0.01);
          settled = view->settled();
          const auto missing = view->missing();
          // Not always the most important one.
          for (std::size_t i = 0; i < std::min<std::size_t>(missing.size(), 8); ++i) {
            give(missing[random() % missing.size()]);
          }
        }
        ASSERT_TRUE(settled);
        EXPECT_TRUE(view->missing().empty());
        EXPECT_EQ(view->model().triangulation().hash(), expected.model().triangulation().hash());
        EXPECT_GT(view->model().expanded_count(), 20u);
      }
    }
  };
  fly(std::int32_t{}, 6.0);
  fly(tri::ThinnedDelaunay2({0, 0}), 1.0);
  fly(tri::PointCloud{}, 6.0);
}

TEST_F(StoreViews, FramesRethrowReadErrors) {
  const stream::Store store = in_metres();
  std::stop_source stop;
  for (const auto reader :
       {StoreView<std::int32_t>::Reader::thread, StoreView<std::int32_t>::Reader::in_frame}) {
    StoreView<std::int32_t> view(store.with_stop(stop.get_token()), {}, reader);
    if (stop.stop_possible()) stop.request_stop();
    EXPECT_THROW(settle(view, looking_down(0, 0, 1.5)), stream::Stopped);
    stop = std::stop_source();
  }
}

}  // namespace
}  // namespace terrace::terrain
