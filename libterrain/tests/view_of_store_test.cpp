// SPDX-License-Identifier: Apache-2.0
// Compares the answers of a view of a store (stream::Store::where()) with those of a store that was
// built from only the points that meet its condition.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/mesh_reader.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>
#include <terrace/tri/point_tin.hpp>

#include "surface/point_window.hpp"
#include "surface/store_window.hpp"
#include "temporary_folder.hpp"
#include "terrace/terrain/bounded_mesh.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/contours.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/profile.hpp"
#include "terrace/terrain/raster.hpp"
#include "terrace/terrain/scan_surface.hpp"
#include "terrace/terrain/tile_check.hpp"
#include "terrace/terrain/tiles.hpp"
#include "terrace/terrain/triangle_mesh.hpp"
#include "test_raster.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

/// A store, a condition, the view, and the store of only the points that meet it.
struct Pair {
  stream::Store view, alone;
};

/// Writes points of several classes, with at most one of a class at each place: 0 everywhere; 1 in
/// a disk off the middle, so that most clusters have none; 2 one in 300; 3 and 4 above each other,
/// and 3 also above a point of 0, like the returns of a pulse.
void write_cloud(const fs::path& path, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::ofstream file(path);
  file.precision(17);
  file << "x,y,z,class\n";
  const auto add = [&](double x, double y, int kind) {
    const double z = 20 * std::sin(x / 90) + 15 * std::cos(y / 70) + unit() + 3 * kind;
    file << x << ',' << y << ',' << z << ',' << kind << '\n';
  };
  for (int i = 0; i < 6000; ++i) {
    const double x = 300000 + unit() * 1000, y = 5200000 + unit() * 700;
    add(x, y, 0);
    if (std::hypot(x - 300700, y - 5200300) < 180) add(x + 0.01, y, 1);
    if (i % 300 == 0) add(x, y + 0.01, 2);
    if (i % 3 == 0) add(x, y, 3);
    if (i % 6 == 0) {
      for (int k = 0; k < 3; ++k) add(x, y, 4 + k);
    }
  }
}

class ViewOfStore : public testing::Test {
 protected:
  stream::Store build(const fs::path& input, const std::string& name, const std::string& where) {
    BuildRequest request;
    request.inputs = {input.string()};
    request.store = folder_.path() / name;
    request.block_points = 200;  // few, for more clusters and more levels
    request.facility_cost = 1.0;
    request.selection.where = where;
    if (input.extension() == ".csv") request.crs.emplace().epsg = 32632;
    build_store(request);
    return stream::Store::open(request.store);
  }
  /// Runs a check on a cloud and a raster, with every condition.
  void for_each_pair(const std::function<void(const Pair&)>& check) {
    const std::uint64_t seed = std::random_device()();
    const fs::path cloud = folder_.path() / "cloud.csv", raster = folder_.path() / "raster.tif";
    write_cloud(cloud, seed);
    stream::GeoTiffOptions options;
    options.columns = 90;
    options.rows = 70;
    options.world.xy = {30, 0, 500000, 0, -30, 5200000};
    options.crs.epsg = 32632;
    options.nodata = -1;
    tests::write_test_raster(raster, options, [](std::uint32_t column, std::uint32_t row) {
      const double x = column, y = row;
      if (std::hypot(x - 60, y - 50) < 12) return -1.0;
      return 300 + 200 * std::sin(x / 9) * std::cos(y / 7) + x;
    });
    for (const auto& [input, conditions] :
         {std::pair{cloud, std::vector<std::string>{"class == 1", "class == 4 && z > 5",
                                                    "class == 6 || class == 2",
                                                    "class == 0 && x < 300400"}},
          std::pair{raster, std::vector<std::string>{"z > 250", "z < 400 && x > 500900"}}}) {
      const stream::Store all = build(input, input.stem().string() + ".all", {});
      for (const std::string& condition : conditions) {
        SCOPED_TRACE(input.stem().string() + " of seed " + std::to_string(seed) + ": " + condition);
        const std::string name = "alone" + std::to_string(stores_++);
        check({all.where(condition), build(input, name, condition)});
      }
    }
  }
  [[nodiscard]] fs::path path(const std::string& name) const { return folder_.path() / name; }
  [[nodiscard]] std::string bytes(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  tests::TemporaryFolder folder_;
  int stores_ = 0;
};

using Bits = std::vector<std::array<std::uint64_t, 3>>;

Bits bits_of(const std::vector<GroundPoint>& points) {
  Bits bits;
  for (const GroundPoint& p : points) {
    const auto of = [](double value) {
      return std::isnan(value) ? ~std::uint64_t{0} : std::bit_cast<std::uint64_t>(value);
    };
    bits.push_back({of(p.height), of(p.east), of(p.north)});
  }
  return bits;
}

TEST_F(ViewOfStore, UsesOnlyItsPointsForHeights) {
  for_each_pair([](const Pair& pair) {
    EXPECT_EQ(pair.view.bounds(), pair.alone.bounds());
    const stream::Box3 box = world_box(pair.alone.schema(), pair.view.whole().bounds());
    std::mt19937_64 random(5);
    const auto between = [&](double low, double high) {
      return low + static_cast<double>(random() >> 11) * 0x1p-53 * (high - low);
    };
    std::vector<Point2> places;
    for (int i = 0; i < 600; ++i) {
      places.push_back(
          {between(box.min[0] - 9, box.max[0] + 9), between(box.min[1] - 9, box.max[1] + 9)});
    }
    for_each_wanted_point(pair.alone, {},
                          [&](stream::ClusterId, const stream::ClusterPoints&, std::size_t i,
                              const stream::Point3& p) {
                            if (i % 7 == 0) places.push_back({p[0], p[1]});
                          });
    using Method = tri::Interpolation;
    for (const Method method : {Method::linear, Method::natural_neighbour, Method::nearest}) {
      SamplerOptions options{.method = method};
      std::vector<GroundPoint> found = sample_places(pair.view, places, options);
      EXPECT_EQ(bits_of(found), bits_of(sample_places(pair.alone, places, options)));
      // Some places alone, for which the store is read differently than for many.
      for (std::size_t i = 0; i < places.size(); i += 300) {
        EXPECT_EQ(bits_of(sample_places(pair.view, {&places[i], 1}, options)), bits_of({found[i]}));
      }
      if (pair.view.schema().grid) continue;
      options.max_edge = 40;
      found = sample_places(pair.view, places, options);
      EXPECT_EQ(bits_of(found), bits_of(sample_places(pair.alone, places, options)));
    }
    ProfileRequest line{.line = {{box.min[0], box.min[1]},
                                 {box.max[0], 0.5 * (box.min[1] + box.max[1])},
                                 {box.min[0], box.max[1]}}};
    const auto rows = [&](const stream::Store& store) {
      std::string text;
      write_profile(store, line, [&](std::string_view more) { text += more; });
      return text;
    };
    EXPECT_EQ(rows(pair.view), rows(pair.alone));
  });
}

TEST_F(ViewOfStore, UsesOnlyItsPointsForRastersAndContours) {
  for_each_pair([&](const Pair& pair) {
    for (const RasterValue value : {RasterValue::height, RasterValue::slope}) {
      for (const std::string name : {"view", "alone"}) {
        write_raster(name == "view" ? pair.view : pair.alone,
                     {.value = value, .output = path(name + ".tif").string(), .replace = true});
      }
      EXPECT_FALSE(bytes("view.tif").empty());
      EXPECT_EQ(bytes("view.tif"), bytes("alone.tif"));
    }
    const auto lines = [](const stream::Store& store) {
      std::string text;
      const ContourOutcome outcome =
          write_contours(store, {.interval = 5}, [&](std::string_view more) { text += more; });
      EXPECT_GT(outcome.lines, 0U);
      return text;
    };
    EXPECT_EQ(lines(pair.view), lines(pair.alone));
  });
}

using Triangle = std::array<stream::Point3, 3>;

std::multiset<Triangle> triangles_of(const TriangleMesh& mesh) {
  std::multiset<Triangle> triangles;
  for (const auto& corners : mesh.triangles) {
    Triangle t{};
    for (std::size_t k = 0; k < 3; ++k) t[k] = mesh.positions[corners[k]];
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    triangles.insert(t);
  }
  return triangles;
}

TEST_F(ViewOfStore, UsesOnlyItsPointsForMeshes) {
  for_each_pair([&](const Pair& pair) {
    EXPECT_EQ(triangles_of(detail_mesh(pair.view, {})), triangles_of(detail_mesh(pair.alone, {})));
    DetailMeshOptions smooth;
    smooth.heights.smoothing = tri::SmoothingOptions{};
    const TriangleMesh one = detail_mesh(pair.view, {}, smooth),
                       other = detail_mesh(pair.alone, {}, smooth);
    std::map<Point2, double> heights;
    for (const stream::Point3& p : one.positions) heights[{p[0], p[1]}] = p[2];
    ASSERT_EQ(heights.size(), other.positions.size());
    for (const stream::Point3& p : other.positions) {
      EXPECT_NEAR(heights.at({p[0], p[1]}), p[2], 1e-9);
    }

    // A bounded mesh is within the bound of every point of the view, in one piece and in windows.
    std::vector<double> x, y, z;
    for_each_wanted_point(
        pair.alone, {},
        [&](stream::ClusterId, const stream::ClusterPoints&, std::size_t, const stream::Point3& p) {
          x.push_back(p[0]);
          y.push_back(p[1]);
          z.push_back(p[2]);
        });
    for (const std::size_t window : {std::size_t{1} << 18, std::size_t{700}}) {
      BoundedMeshOptions options;
      options.max_error = 1.5;
      options.path = path("bounded.ply").string();
      options.writer.replace = true;
      options.window_points = window;
      const BoundedMeshResult result = write_bounded_mesh(pair.view, options);
      EXPECT_EQ(result.samples, x.size());
      const TriangleMesh mesh = triangle_mesh_of(*stream::read_mesh(options.path));
      const tri::TinErrors errors = tri::measure_surface(x, y, z, mesh.positions, mesh.triangles);
      EXPECT_LE(errors.largest, 1.5 + 1e-9);
      EXPECT_NEAR(errors.largest, result.max_error, 1e-9);
      EXPECT_EQ(errors.uncovered, result.uncovered);
      const BoundedMeshResult alone = write_bounded_mesh(pair.alone, options);
      EXPECT_EQ(result.uncovered, alone.uncovered);
      EXPECT_LT(
          std::abs(static_cast<double>(result.vertices) / static_cast<double>(alone.vertices) - 1),
          0.1);
    }
  });
}

TEST_F(ViewOfStore, UsesOnlyItsPointsForTiles) {
  for_each_pair([&](const Pair& pair) {
    const std::string folder = path("tiles" + std::to_string(stores_)).string();
    const TilesRequest request{.folder = folder,
                               .first_zoom = 9,
                               .last_zoom = 13,
                               .max_error = 2,
                               .vertical = HeightReference::ignore};
    const TilesOutcome made = write_tiles(pair.view, request);
    TilesRequest alone = request;
    alone.folder += "alone";
    EXPECT_EQ(made.tiles, write_tiles(pair.alone, alone).tiles);
    for (const stream::Store* store : {&pair.view, &pair.alone}) {
      const TileCheckResult check =
          check_tiles({.folder = folder, .store = store, .vertical = HeightReference::ignore});
      EXPECT_GT(check.samples, 0U);
      for (const stream::Problem& problem : check.problems) ADD_FAILURE() << problem.what;
    }
    // The zoom that shows every sample depends on the view's samples.
    TilesRequest deepest = request;
    deepest.folder += "deepest";
    deepest.last_zoom.reset();
    deepest.first_zoom = 0;
    deepest.max_error = 100;
    TilesRequest deepest_alone = deepest;
    deepest_alone.folder += "alone";
    const std::size_t zooms = write_tiles(pair.view, deepest).zooms.size();
    const std::size_t expected = write_tiles(pair.alone, deepest_alone).zooms.size();
    EXPECT_LE(zooms, expected + 1);
    EXPECT_GE(zooms + 1, expected);
    // Another condition makes other tiles of the same store.
    TilesRequest again = request;
    again.replace = true;
    EXPECT_EQ(write_tiles(pair.view, again).made, 0U);
    EXPECT_GT(write_tiles(pair.view.whole(), again).made, 0U);
  });
}

// Adjacent windows, also of coarser levels, compared with all points that meet the condition.
TEST_F(ViewOfStore, WindowsHaveAllTrianglesOfItsPoints) {
  for_each_pair([](const Pair& pair) {
    constexpr double kAll = std::numeric_limits<double>::infinity();
    for (unsigned level = 0; level <= pair.view.top(); ++level) {
      WindowPoints points, expected;
      StoreWindow(pair.view).points({{-kAll, -kAll}, {kAll, kAll}}, points, level);
      for_each_wanted_point(pair.view.whole(), {.level = level},
                            [&](stream::ClusterId, const stream::ClusterPoints& of, std::size_t i,
                                const stream::Point3&) {
                              std::uint8_t meets = 0;
                              const std::size_t bytes = pair.view.schema().payload_size();
                              pair.view.condition()->test(
                                  {&of.positions[i], 1},
                                  std::span(of.payload).subspan(i * bytes, bytes), {&meets, 1});
                              if (meets == 1) expected.positions.push_back(of.positions[i]);
                            });
      ASSERT_EQ(points.positions, expected.positions) << "level " << level;
      EXPECT_EQ(wanted_points(pair.view, {.level = level}), expected.positions.size());
      EXPECT_EQ(
          level_within(pair.view, std::max<std::size_t>(expected.positions.size(), 1)) <= level,
          true);
      std::vector<Point2> places;
      for (const stream::Point3& p : points.positions) places.push_back({p[0], p[1]});
      tri::Delaunay2<double> whole;
      const std::vector<tri::VertexId> vertices = whole.build(places);
      std::vector<double> heights(whole.vertex_slots());
      const stream::Channel& channel = pair.view.schema().coordinates[2];
      for (std::size_t i = places.size(); i-- > 0;) {
        heights[tri::slot(vertices[i])] = points.positions[i][2] * channel.scale + channel.offset;
      }
      const auto corners = [](const auto& of, const auto& height, tri::TriangleId t) {
        Triangle triangle{};
        for (std::size_t k = 0; k < 3; ++k) {
          const tri::VertexId v = of.vertices(t)[k];
          triangle[k] = {of.point(v)[0], of.point(v)[1], height[tri::slot(v)]};
        }
        std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()),
                    triangle.end());
        return triangle;
      };
      std::set<Triangle> triangles;
      for (const tri::TriangleId t : whole.all_triangles()) {
        triangles.insert(corners(whole, heights, t));
      }
      PointCloud cloud(pair.view, level);
      PointWindow window(cloud);
      std::set<Triangle> found;
      constexpr int kSide = 3;
      const stream::Box3& all = pair.view.bounds();
      for (int part = 0; part < kSide * kSide; ++part) {
        StoredBox box;
        for (std::size_t k = 0; k < 2; ++k) {
          const double step = (all.max[k] - all.min[k]) / kSide;
          box.min[k] = all.min[k] + step * (k == 0 ? part % kSide : part / kSide);
          box.max[k] = box.min[k] + step;
        }
        window.load(box);
        for (const tri::TriangleId t : window.triangulation().all_triangles()) {
          if (window.is_certain(t)) {
            found.insert(corners(window.triangulation(), window.heights(), t));
          }
        }
      }
      EXPECT_EQ(found, triangles) << "level " << level;
    }
  });
}

TEST_F(ViewOfStore, EmptyViewIsAnErrorThatNamesTheCondition) {
  const fs::path cloud = path("cloud.csv");
  write_cloud(cloud, 1);
  const stream::Store view = build(cloud, "all", {}).where("class == 77");
  const std::vector<std::function<void()>> all{
      [&] {
        sample_places(view, std::vector<Point2>{{300500, 5200300}});
      },
      [&] { write_raster(view, {.output = path("r.tif").string()}); },
      [&] { write_contours(view, {.interval = 1}, [](std::string_view) {}); },
      [&] { write_tiles(view, {.folder = path("tiles").string(), .last_zoom = 3}); },
  };
  for (const auto& one : all) {
    try {
      one();
      ADD_FAILURE() << "nothing was wrong";
    } catch (const stream::Error& error) {
      EXPECT_EQ(error.parts().cause.text(), "no point meets the condition 'class == 77'");
    }
  }
  EXPECT_EQ(wanted_points(view, {}), 0U);
  EXPECT_TRUE(detail_mesh(view, {}).triangles.empty());
}

}  // namespace
}  // namespace terrace::terrain
