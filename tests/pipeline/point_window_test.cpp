// SPDX-License-Identifier: GPL-3.0-or-later
// Windows of the triangulation of a store's points against the triangulation of all of them.
#include "point_window.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/interpolation.hpp>

#include "store_build.hpp"
#include "temporary_folder.hpp"

namespace terrace {
namespace {

using tools::Point2;
using tools::PointWindow;
using tools::StoredBox;
using tools::SurfacePoint;
using Points = std::vector<stream::Point3>;
using Triangle = std::array<Point2, 3>;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  std::uint64_t below(std::uint64_t n) { return engine_() % n; }

 private:
  std::mt19937_64 engine_;
};

Points points_of(const std::string& kind) {
  Random random(7);
  Points points;
  const auto add = [&](double x, double y) { points.push_back({x, y, 10 * random.unit()}); };
  if (kind == "random") {
    for (int i = 0; i < 4000; ++i) add(random.unit() * 1000, random.unit() * 700);
  } else if (kind == "lattice") {
    for (int i = 0; i < 3600; ++i) add(i % 60, i / 60);
  } else if (kind == "duplicates") {
    for (int i = 0; i < 3000; ++i) {
      add(random.unit() * 30, random.unit() * 30);
      for (std::uint64_t k = random.below(4); k > 0; --k) add(points.back()[0], points.back()[1]);
    }
    for (int i = 0; i < 1500; ++i) {
      add(static_cast<double>(random.below(30)), static_cast<double>(random.below(30)));
    }
  } else if (kind == "voids") {
    for (int i = 0; i < 6000; ++i) {
      const double x = random.unit() * 1000, y = random.unit() * 1000;
      const bool lake = std::hypot(x - 400, y - 600) < 250 || std::abs(y - x + 500) < 60;
      if (!lake) add(x, y);
    }
  } else if (kind == "clusters") {
    for (int k = 0; k < 12; ++k) {
      const double x = random.unit() * 1e5, y = random.unit() * 1e5, r = random.unit() * 500;
      for (int i = 0; i < 250; ++i) add(x + random.unit() * r, y + random.unit() * r);
    }
  } else if (kind == "turned") {  // a narrow strip: most of its box is outside the hull
    for (int i = 0; i < 3000; ++i) {
      const double t = random.unit() * 1000, s = random.unit() * 60;
      add(0.8 * t - 0.6 * s, 0.6 * t + 0.8 * s);
    }
  } else if (kind == "circle") {  // slivers along the hull, all the same circle within
    for (int i = 0; i < 700; ++i) add(std::cos(i * 0.1) * 1000, std::sin(i * 0.1) * 1000);
  } else if (kind == "parabola") {
    for (int i = 0; i < 800; ++i) add(i, 1e-5 * i * i);
  } else if (kind == "far") {
    for (int i = 0; i < 2500; ++i) add(4e15 + 2 * i % 77, -8e15 + random.unit() * 2e3);
  } else if (kind == "huge") {
    for (int i = 0; i < 600; ++i) add(random.unit() * 1e148, random.unit() * 1e148);
  } else if (kind == "tiny") {
    for (int i = 0; i < 300; ++i) add(random.unit() * 1e-170, random.unit() * 1e-170);
  } else if (kind == "line") {
    for (int i = 0; i < 700; ++i) add(3 * i, 5 - 2 * i);
  } else if (kind == "nearly a line") {
    for (int i = 0; i < 900; ++i) add(i % 450, 0);
    add(225, 1);
  } else if (kind == "one") {
    add(4, 5);
  } else if (kind == "two") {
    add(4, 5);
    add(6, 5);
  } else if (kind == "one place") {
    for (int i = 0; i < 400; ++i) add(2.5, 7.5);
  }
  return points;
}

std::filesystem::path cloud_store(const std::filesystem::path& folder, const Points& points) {
  std::filesystem::create_directories(folder);
  std::ofstream out(folder / "cloud.xyz");
  out.precision(17);
  for (const stream::Point3& p : points) out << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  out.close();
  tools::BuildRequest request;
  request.inputs = {(folder / "cloud.xyz").string()};
  request.store = folder / "cloud.store";
  request.block_points = 100;
  tools::build_store(request);
  return request.store;
}

std::filesystem::path raster_store(const std::filesystem::path& folder) {
  stream::GeoTiffOptions options;
  options.columns = 150;
  options.rows = 120;
  options.sample.type = stream::ScalarType::i16;
  options.sample.scale = 0.25;
  options.sample.offset = 100;
  options.world.xy = {30, 0, 500000, 0, -30, 5200000};
  options.nodata = -1;
  std::vector<std::int16_t> samples;
  for (int i = 0; i < 150 * 120; ++i) {
    const double x = i % 150, y = i / 150;
    samples.push_back(std::hypot(x - 60, y - 50) < 30 ? std::int16_t{-1}
                                                      : static_cast<std::int16_t>(i * 7 % 1009));
  }
  stream::GeoTiffWriter writer(folder / "dem.tif", options);
  writer.write_rows(std::as_bytes(std::span(samples)));
  writer.commit();
  tools::BuildRequest request;
  request.inputs = {(folder / "dem.tif").string()};
  request.store = folder / "dem.store";
  request.block_points = 300;
  tools::build_store(request);
  return request.store;
}

Triangle turned(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

/// All points of a level and above in one triangulation.
struct Whole {
  tri::Delaunay2<double> triangulation;
  std::vector<double> heights;
  std::map<Triangle, std::array<double, 3>> triangles;

  Whole(const stream::Store& store, unsigned level) {
    constexpr double kAll = std::numeric_limits<double>::infinity();
    tools::StoreWindow reader(store);
    tools::WindowPoints points;
    reader.points({{-kAll, -kAll}, {kAll, kAll}}, points, level);
    const stream::Channel& z = store.schema().coordinates[2];
    for (const stream::Point3& p : points.positions) {
      const auto inserted = triangulation.insert({p[0], p[1]});
      if (!inserted.created) continue;  // the first stands for all
      heights.resize(triangulation.vertex_slots());
      heights[tri::slot(inserted.vertex)] = p[2] * z.scale + z.offset;
    }
    for (const tri::TriangleId t : triangulation.all_triangles()) {
      add_triangle(triangulation, heights, t, triangles);
    }
  }

  static void add_triangle(const tri::Delaunay2<double>& of, const std::vector<double>& heights,
                           tri::TriangleId t, std::map<Triangle, std::array<double, 3>>& to) {
    const auto v = of.vertices(t);
    Triangle corners;
    std::map<Point2, double> height;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = of.point(v[k]);
      height[corners[k]] = heights[tri::slot(v[k])];
    }
    corners = turned(corners);
    to[corners] = {height[corners[0]], height[corners[1]], height[corners[2]]};
  }
};

/// Whether no line separates them, in long double.
bool meets(const Triangle& t, const StoredBox& box) {
  using Number = long double;
  const std::array<Point2, 4> corner{Point2{box.min[0], box.min[1]}, Point2{box.max[0], box.min[1]},
                                     Point2{box.max[0], box.max[1]},
                                     Point2{box.min[0], box.max[1]}};
  for (std::size_t k = 0; k < 2; ++k) {
    if (std::max({t[0][k], t[1][k], t[2][k]}) < box.min[k]) return false;
    if (std::min({t[0][k], t[1][k], t[2][k]}) > box.max[k]) return false;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Point2 &a = t[i], &b = t[(i + 1) % 3];
    if (std::all_of(corner.begin(), corner.end(), [&](const Point2& p) {
          return (Number{b[0]} - a[0]) * (Number{p[1]} - a[1]) <
                 (Number{b[1]} - a[1]) * (Number{p[0]} - a[0]);
        })) {
      return false;
    }
  }
  return true;
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

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

void check(const stream::Store& store, unsigned level, int boxes) {
  const Whole whole(store, level);
  PointWindow window(store, level, 0), other(store, level, 0);
  Random random(level + 3);
  for (int i = 0; i < boxes; ++i) {
    SCOPED_TRACE("level " + std::to_string(level) + ", box " + std::to_string(i));
    const StoredBox box = random_box(store.bounds(), random, static_cast<std::uint64_t>(i));
    const auto reach = i % 2 == 0 ? PointWindow::Reach::kTriangles : PointWindow::Reach::kCircles;
    window.load(box, reach);
    std::map<Triangle, std::array<double, 3>> certain;
    for (const tri::TriangleId t : window.triangulation().all_triangles()) {
      if (!window.is_certain(t)) continue;
      Whole::add_triangle(window.triangulation(), window.heights(), t, certain);
    }
    for (const auto& [corners, heights] : certain) {
      const auto found = whole.triangles.find(corners);
      ASSERT_TRUE(found != whole.triangles.end());
      ASSERT_EQ(heights, found->second);
    }
    for (const auto& [corners, heights] : whole.triangles) {
      if (meets(corners, box)) {
        ASSERT_TRUE(certain.contains(corners));
      }
    }
    // Places of the box, some on points and between them; the same from another window.
    std::vector<Point2> places;
    for (int k = 0; k < 60; ++k) {
      Point2 p;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        p[axis] = box.min[axis] + random.unit() * (box.max[axis] - box.min[axis]);
        if (k % 3 == 1) p[axis] = std::round(p[axis] * 2) / 2;
        p[axis] = std::clamp(p[axis], box.min[axis], box.max[axis]);
      }
      places.push_back(p);
    }
    for (const tri::VertexId v : window.triangulation().all_vertices()) {
      const Point2 p = window.triangulation().point(v);
      if (places.size() < 90 && box.contains({p[0], p[1], 0})) places.push_back(p);
    }
    StoredBox larger = box;
    for (std::size_t k = 0; k < 2; ++k) {
      larger.min[k] -= random.unit() * (1e-300 + store.bounds().max[k] - store.bounds().min[k]);
    }
    other.load(larger);
    const std::vector<double> expected =
        tri::heights_at(whole.triangulation, whole.heights, places, tri::Interpolation::kLinear, 1);
    for (std::size_t k = 0; k < places.size(); ++k) {
      SCOPED_TRACE("place " + std::to_string(k));
      const SurfacePoint found = window.at(places[k]), again = other.at(places[k]);
      ASSERT_EQ(std::isnan(found.height), std::isnan(expected[k]));
      if (!std::isnan(expected[k])) {
        ASSERT_NEAR(found.height, expected[k], 1e-7);
      }
      ASSERT_TRUE(same_bits(found.height, again.height));
      ASSERT_TRUE(same_bits(found.per_column, again.per_column));
      ASSERT_TRUE(same_bits(found.per_row, again.per_row));
    }
  }
}

class Clouds : public testing::TestWithParam<std::string> {};

TEST_P(Clouds, WindowsHaveTheTrianglesOfTheWhole) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      stream::Store::open(cloud_store(folder.path(), points_of(GetParam())));
  check(store, 0, 40);
  for (unsigned level = 1; level <= store.top(); ++level) check(store, level, 12);
}

INSTANTIATE_TEST_SUITE_P(PointWindow, Clouds,
                         testing::Values("random", "lattice", "duplicates", "voids", "clusters",
                                         "turned", "circle", "parabola", "far", "huge", "tiny",
                                         "line", "nearly a line", "one", "two", "one place"),
                         [](const auto& one) {
                           std::string name = one.param;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(PointWindow, TakesTheCoarserLevelsOfRasters) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(raster_store(folder.path()));
  ASSERT_GE(store.top(), 2U);
  for (unsigned level = 0; level <= store.top(); ++level) check(store, level, 20);
}

TEST(PointWindow, ReadsLittleMoreThanItNeeds) {
  const tests::TemporaryFolder folder;
  for (const char* const kind : {"random", "voids", "turned"}) {
    SCOPED_TRACE(kind);
    const stream::Store store =
        stream::Store::open(cloud_store(folder.path() / kind, points_of(kind)));
    PointWindow window(store, 0, 0);
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
    // A box has one 400th of the area: about ten points. The coarse levels come to it, and
    // where it sees the hull what lies along that.
    EXPECT_LT(static_cast<double>(read) / 200, 0.1 * static_cast<double>(store.points()));
  }
}

TEST(PointWindow, SaysWhatMemoryItNeeds) {
  const tests::TemporaryFolder folder;
  Random random(1);
  Points points;
  for (int i = 0; i < 60000; ++i) points.push_back({random.unit(), random.unit(), 0});
  const stream::Store store = stream::Store::open(cloud_store(folder.path(), points));
  PointWindow window(store, 0, std::uint64_t{14} << 20);
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
