// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <terrace/terrain/build.hpp>
#include <unistd.h>

#include "terrace/stream/geotiff_writer.hpp"

namespace terrace::viewer {
namespace {

constexpr std::uint32_t kColumns = 160, kRows = 130;
constexpr stream::LinearMap kGround{10, 0, 0, 0, -10, 0, 0, 0, 1};

double height(std::uint32_t column, std::uint32_t row) {
  return std::round(200.0 + 90.0 * std::sin(column / 15.0) * std::cos(row / 19.0));
}

/// A store of a raster in a separate folder.
class Scenes : public testing::Test {
 protected:
  Scenes()
      : folder_(std::filesystem::temp_directory_path() / ("scenes-" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
    stream::GeoTiffOptions options;
    options.columns = kColumns;
    options.rows = kRows;
    options.world.xy = {10, 0, 0, 0, -10, 0};
    options.sample.type = stream::ScalarType::i16;
    std::vector<std::int16_t> samples;
    for (std::uint32_t row = 0; row < kRows; ++row) {
      for (std::uint32_t column = 0; column < kColumns; ++column) {
        samples.push_back(static_cast<std::int16_t>(height(column, row)));
      }
    }
    const std::string file = (folder_ / "dem.tif").string();
    stream::GeoTiffWriter writer(file, options);
    writer.write_rows(std::as_bytes(std::span(samples)));
    writer.commit();
    terrain::BuildRequest request{.inputs = {file}, .store = folder_ / "store"};
    request.block_points = 500;
    terrain::build_store(request);
  }
  ~Scenes() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] stream::Store store() const { return stream::Store::open(folder_ / "store"); }

  std::filesystem::path folder_;
};

/// The page's arrays by slot, to which changes are applied.
template <class Vertex>
struct MirrorOf {
  std::vector<Vertex> vertices;
  std::vector<SceneTriangle> triangles;

  void apply(const SceneChanges& changes) {
    const auto put = [](const auto& blocks, const auto& from, auto& to) {
      for (std::size_t i = 0; i < blocks.size(); ++i) {
        const std::size_t begin = blocks[i] * SceneChanges::kBlock;
        if (to.size() < begin + SceneChanges::kBlock) to.resize(begin + SceneChanges::kBlock);
        std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(i * SceneChanges::kBlock),
                    SceneChanges::kBlock, to.begin() + static_cast<std::ptrdiff_t>(begin));
      }
    };
    std::vector<Vertex> changed(changes.vertices.size() / sizeof(Vertex));
    if (!changed.empty()) {
      std::memcpy(changed.data(), changes.vertices.data(), changes.vertices.size());
    }
    put(changes.vertex_blocks, changed, vertices);
    put(changes.triangle_blocks, changes.triangles, triangles);
  }
  [[nodiscard]] std::array<int, 2> cell(std::uint32_t slot) const {
    const SceneVertex& v = vertices[slot];
    return {static_cast<int>(std::lround(v.x / 10 + (kColumns - 1) / 2.0)),
            static_cast<int>(std::lround((kRows - 1) / 2.0 - v.y / 10))};
  }
};
using Mirror = MirrorOf<SceneVertex>;

tri::View looking(double east, double north, double above, double pixel_error) {
  tri::View view;
  view.camera =
      tri::perspective_camera({{east, north, above}, {0.2, 0.3, -1}, {0, 0, 1}}, 45, 1.5, 700);
  view.pixel_error = pixel_error;
  return view;
}

// After every frame without removed parts that are still drawn, the arrays are the triangulation of
// their vertices, each at the height of its cell.
TEST_F(Scenes, ArraysMatchTheTriangulation) {
  const auto scene = Scene::open(store(), kGround, 1'000'000);
  const double middle = (scene->box().min[2] + scene->box().max[2]) / 2;
  Mirror mirror;
  bool sliding = false;
  std::size_t most = 0, compared = 0;
  double time = 0;
  for (const auto& view :
       {looking(0, 0, 4000, 20), looking(300, 200, 900, 1), looking(-500, -300, 1500, 3)}) {
    for (int frame = 0; frame < 2000; ++frame) {
      const SceneState state = scene->frame(view, 0.004, time += 0.01);
      mirror.apply(scene->take_changes());
      ASSERT_LT(frame, 1999);
      if (state.waiting) continue;
      ++compared;
      std::set<std::uint32_t> used;
      std::set<std::array<std::array<int, 2>, 3>> triangles;
      for (const SceneTriangle& t : mirror.triangles) {
        if (t == SceneTriangle{}) continue;
        std::array<std::array<int, 2>, 3> corners{mirror.cell(t[0]), mirror.cell(t[1]),
                                                  mirror.cell(t[2])};
        used.insert(t.begin(), t.end());
        std::sort(corners.begin(), corners.end());
        EXPECT_TRUE(triangles.insert(corners).second);
      }
      ASSERT_EQ(triangles.size(), state.triangles);
      std::vector<std::array<std::int32_t, 2>> points;
      for (const std::uint32_t slot : used) {
        const auto [column, row] = mirror.cell(slot);
        const SceneVertex& v = mirror.vertices[slot];
        ASSERT_NE(v.level, SceneVertex::kNone);
        EXPECT_EQ(v.z + middle,
                  height(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row)));
        EXPECT_GT(v.normal[2], 0);
        sliding |= v.start_z != v.z;
        points.push_back({column, row});
      }
      ASSERT_EQ(points.size(), state.points);
      most = std::max(most, points.size());
      tri::Delaunay2<std::int32_t, tri::Windowed> fresh;
      fresh.build(points);
      ASSERT_EQ(fresh.hash(), scene->hash());
      for (const tri::TriangleId id : fresh.all_triangles()) {
        std::array<std::array<int, 2>, 3> corners;
        for (std::size_t i = 0; i < 3; ++i) {
          const auto p = fresh.point(fresh.vertices(id)[i]);
          corners[i] = {p[0], p[1]};
        }
        std::sort(corners.begin(), corners.end());
        ASSERT_TRUE(triangles.contains(corners));
      }
      if (state.settled) break;
    }
  }
  EXPECT_GE(compared, 3u);
  EXPECT_TRUE(sliding) << "nothing slides into place";
  EXPECT_GT(most, 2000u);
}

/// Twice the area of a triangle of cells, positive in one orientation.
std::int64_t area(const std::array<int, 2>& a, const std::array<int, 2>& b,
                  const std::array<int, 2>& c) {
  return std::int64_t{b[0] - a[0]} * (c[1] - a[1]) - std::int64_t{b[1] - a[1]} * (c[0] - a[0]);
}

// Few vertices, and yet every sample is within the error of the triangles that are drawn over it.
TEST_F(Scenes, DrawsFewVerticesWithinTheError) {
  for (const double error : {1.0, 4.0, 16.0}) {
    SCOPED_TRACE(error);
    const auto scene = Scene::open(store(), kGround, 1'000'000);
    const double middle = (scene->box().min[2] + scene->box().max[2]) / 2;
    tri::View view;
    view.ground_error = error;
    SceneState state;
    double time = 0;
    do {
      state = scene->frame(view, 0.01, time += 1);
    } while (!state.settled || state.waiting);
    EXPECT_LE(state.worst, 1.0);
    EXPECT_LT(3 * state.points, kColumns * kRows);
    Mirror mirror;
    mirror.apply(scene->take_changes());
    std::vector<bool> covered(kColumns * kRows);
    std::size_t drawn = 0;
    for (const SceneTriangle& t : mirror.triangles) {
      if (t == SceneTriangle{}) continue;
      ++drawn;
      const std::array<std::array<int, 2>, 3> p{mirror.cell(t[0]), mirror.cell(t[1]),
                                                mirror.cell(t[2])};
      const std::int64_t whole = area(p[0], p[1], p[2]);
      const auto [left, right] = std::minmax({p[0][0], p[1][0], p[2][0]});
      const auto [top, bottom] = std::minmax({p[0][1], p[1][1], p[2][1]});
      for (int y = top; y <= bottom; ++y) {
        for (int x = left; x <= right; ++x) {
          double z = 0;
          bool inside = true;
          for (std::size_t i = 0; i < 3; ++i) {
            const std::int64_t part = area(p[(i + 1) % 3], p[(i + 2) % 3], {x, y});
            inside &= whole > 0 ? part >= 0 : part <= 0;
            z += static_cast<double>(part) * mirror.vertices[t[i]].z;
          }
          if (!inside) continue;
          covered[static_cast<std::size_t>(y) * kColumns + static_cast<std::size_t>(x)] = true;
          ASSERT_NEAR(z / static_cast<double>(whole) + middle,
                      height(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)),
                      error + 1e-3)
              << x << ", " << y;
        }
      }
    }
    EXPECT_EQ(drawn, state.triangles);
    EXPECT_EQ(std::count(covered.begin(), covered.end(), false), 0);
  }
}

TEST_F(Scenes, PicksThePointOnTheSurface) {
  const auto scene = Scene::open(store(), kGround, 1'000'000);
  tri::View all;
  all.ground_error = 0;
  while (!scene->frame(all, 0.01, 0).settled) {
  }
  std::mt19937_64 random(7);
  for (int i = 0; i < 50; ++i) {
    const auto column = static_cast<std::uint32_t>(40 + random() % 80);
    const auto row = static_cast<std::uint32_t>(40 + random() % 50);
    SCOPED_TRACE(testing::Message() << column << ", " << row);
    const double x = 10 * (column - (kColumns - 1) / 2.0), y = 10 * ((kRows - 1) / 2.0 - row);
    const auto hit = scene->pick({x + 1, y - 2, 5000}, {0, 0, -1}, 0.01);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->stored[0], column + 0.1, 1e-4);
    EXPECT_NEAR(hit->stored[1], row + 0.2, 1e-4);
    // Between the samples of the surrounding cell.
    double low = 1e9, high = -1e9;
    for (std::uint32_t dc = 0; dc < 2; ++dc) {
      for (std::uint32_t dr = 0; dr < 2; ++dr) {
        low = std::min(low, height(column + dc, row + dr));
        high = std::max(high, height(column + dc, row + dr));
      }
    }
    EXPECT_GE(hit->stored[2], low - 1e-3);
    EXPECT_LE(hit->stored[2], high + 1e-3);
    EXPECT_NEAR(hit->place[2], hit->stored[2], 1e-3);
  }
  EXPECT_FALSE(scene->pick({0, 0, 5000}, {0, 0, 1}, 0.01));
  EXPECT_FALSE(scene->pick({1e5, 0, 5000}, {0, 0, -1}, 0.01));
}

// Attributes follow the points: after any changes, each point is drawn with its own.
TEST_F(Scenes, PointsKeepTheirColoursClassesAndIntensities) {
  const std::filesystem::path file = folder_ / "cloud.csv", built = folder_ / "cloud";
  const auto group_at = [](int x, int y) { return (x / 10 + y / 20) % 12; };
  {
    std::ofstream out(file);
    out << "x,y,z,red,green,blue,classification,intensity\n";
    for (int i = 0; i < 30000; ++i) {
      const int x = i * 7919 % 1009, y = i * 10711 % 1013;
      out << x << ',' << y << ',' << i % 37 << ',' << x * 60 << ',' << y * 60 << ',' << (x + y) * 30
          << ',' << group_at(x, y) << ',' << 1000 + x << '\n';
    }
  }
  terrain::BuildRequest request{.inputs = {file.string()}, .store = built};
  request.block_points = 1000;
  terrain::build_store(request);
  const stream::Store cloud = stream::Store::open(built);
  const stream::Box3 bounds = cloud.bounds();
  const std::array<double, 2> middle{(bounds.min[0] + bounds.max[0]) / 2,
                                     (bounds.min[1] + bounds.max[1]) / 2};
  const auto scene = Scene::open(cloud, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 1'000'000);
  EXPECT_TRUE(scene->colours().has_rgb());
  EXPECT_TRUE(scene->colours().has_intensity());
  EXPECT_EQ(scene->colours().groups().size(), 12u);
  MirrorOf<ScenePoint> mirror;
  std::size_t shown = 0, most = 0;
  ScenePoint last;
  for (int flight = 0; flight < 12; ++flight) {
    const tri::View view = looking(-400 + 80 * flight, 300 - 60 * flight, 150, 2);
    SceneState state;
    do {
      state = scene->frame(view, 0.01, 0);
      mirror.apply(scene->take_changes());
    } while (!state.settled);
    shown = 0;
    for (const ScenePoint& p : mirror.vertices) {
      if (p.level == SceneVertex::kNone) continue;
      ++shown;
      last = p;
      const auto x = static_cast<int>(std::lround(p.x + middle[0]));
      const auto y = static_cast<int>(std::lround(p.y + middle[1]));
      ASSERT_EQ(p.rgb[0], x * 60 / 257) << x << ", " << y;
      ASSERT_EQ(p.rgb[1], y * 60 / 257);
      ASSERT_EQ(p.rgb[2], (x + y) * 30 / 257);
      ASSERT_EQ(p.group, group_at(x, y));
      // The range is stretched over most of 1000 ... 2008.
      ASSERT_NEAR(p.intensity, std::clamp(255 * (x - 20) / 968.0, 0.0, 255.0), 8);
    }
    EXPECT_EQ(shown, state.points);
    most = std::max(most, shown);
  }
  EXPECT_GT(most, 2000u);
  const auto hit = scene->pick({last.x, last.y, 500}, {0, 0, -1}, 1e-4);
  ASSERT_TRUE(hit);
  ASSERT_EQ(hit->attributes.size(), 5u);
  EXPECT_EQ(hit->attributes[0], 60 * hit->stored[0]);
  EXPECT_EQ(hit->attributes[4], 1000 + hit->stored[0]);
}

TEST_F(Scenes, ClustersExpandAndCollapseByHand) {
  const auto scene = Scene::open(store(), kGround, 1'000'000);
  const tri::View coarse = looking(0, 0, 1e6, 100);
  const auto settle = [&] {
    SceneState state;
    do {
      state = scene->frame(coarse, 0.01, 0);
    } while (!state.settled);
    return state;
  };
  const SceneState before = settle();
  const std::uint64_t hash = scene->hash();
  auto hit = scene->pick({0, 0, 5000}, {0, 0, -1}, 0.01);
  ASSERT_TRUE(hit);
  ASSERT_TRUE(hit->expandable);
  scene->pin(*hit->expandable, tri::ViewPin::expanded);
  const SceneState expanded = settle();
  EXPECT_GT(expanded.expanded, before.expanded);
  EXPECT_GT(expanded.points, before.points);
  // Both ways, again and again.
  scene->pin(*hit->expandable, tri::ViewPin::collapsed);
  EXPECT_EQ(settle().points, before.points);
  scene->pin(*hit->expandable, tri::ViewPin::expanded);
  EXPECT_EQ(settle().points, expanded.points);
  scene->release();
  EXPECT_EQ(settle().points, before.points);
  EXPECT_EQ(scene->hash(), hash);
}

// Where all samples are known, Expand shows those of the picked cluster that were hidden, even if
// the picked vertex has been hidden since.
TEST_F(Scenes, HiddenSamplesAreShownByHand) {
  const auto scene = Scene::open(store(), kGround, 1'000'000);
  const auto settle = [&](double error) {
    tri::View view;
    view.ground_error = error;
    SceneState state;
    do {
      state = scene->frame(view, 0.01, 0);
    } while (!state.settled);
    return state;
  };
  const std::size_t coarse = settle(40).points;
  const std::uint64_t hash = scene->hash();
  EXPECT_GT(settle(1).points, 2 * coarse);
  const auto hit = scene->pick({101, 52, 5000}, {0, 0, -1}, 0.01);
  ASSERT_TRUE(hit);
  EXPECT_EQ(settle(40).points, coarse);
  ASSERT_TRUE(hit->expandable);
  scene->pin(*hit->expandable, tri::ViewPin::expanded);
  EXPECT_GT(settle(40).points, coarse + 5);
  scene->release();
  EXPECT_EQ(settle(40).points, coarse);
  EXPECT_EQ(scene->hash(), hash);
  scene->pin(hit->cluster, tri::ViewPin::collapsed);
  EXPECT_NE(settle(40).expanded, 0u);
  EXPECT_NE(scene->hash(), hash);
  scene->release();
  settle(40);
  EXPECT_EQ(scene->hash(), hash);
}

// The outline consists of closed lines around vertices below the cluster.
TEST_F(Scenes, OutlineSurroundsACluster) {
  const auto scene = Scene::open(store(), kGround, 1'000'000);
  for (int frame = 0; frame < 2000; ++frame) {
    if (scene->frame(looking(0, 0, 900, 1), 0.01, 0).settled) break;
  }
  Mirror mirror;
  mirror.apply(scene->take_changes());
  std::size_t outlined = 0;
  for (int i = 0; i < 40; ++i) {
    const auto hit = scene->pick({-200.0 + 10 * i, 7.0 * i - 150, 1e5}, {0, 0, -1}, 0.01);
    ASSERT_TRUE(hit);
    const auto lines = scene->outline(hit->cluster);
    std::map<std::uint32_t, int> ends;
    for (const auto& [a, b] : lines) {
      ASSERT_NE(mirror.vertices[a].level, SceneVertex::kNone);
      ++ends[a];
      --ends[b];
    }
    for (const auto& [slot, balance] : ends) EXPECT_EQ(balance, 0) << slot;
    outlined += lines.size() >= 3 ? 1 : 0;
    // The vertex next to the hit belongs to the cluster.
    EXPECT_EQ(lines.empty(), tri::level_of(hit->cluster) == store().top());
  }
  EXPECT_GT(outlined, 10u);
  EXPECT_TRUE(scene->outline(tri::cluster_id(store().top(), 0)).empty());
}

}  // namespace
}  // namespace terrace::viewer
