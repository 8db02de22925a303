// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/portable_math.hpp>
#include <terrace/base/random.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/tri/point_tin.hpp>

#include "analytic_surface.hpp"
#include "tile/make/mesher.hpp"
#include "tile/verify/checks.hpp"

namespace terrace::terrain {
namespace {

/// About 40,000 samples, well inside a tile of zoom 6 and across borders of deeper ones.
AnalyticSurface alps() { return {10.13, 45.91, 0.0031, 200, 200, hills}; }

ZoomPlan plan_of(unsigned zoom, double max_error, const TileSurface& surface) {
  return plan_zoom(zoom, max_error, 2000, surface);
}

/// Positions and heights on a border of a tile.
std::vector<std::pair<unsigned, double>> side(const TileMesh& mesh,
                                              const std::vector<std::uint32_t>& list,
                                              const std::vector<std::uint16_t>& along) {
  std::vector<std::pair<unsigned, double>> places;
  for (const std::uint32_t vertex : list) {
    places.emplace_back(along[vertex], mesh.metres(vertex));
  }
  return places;
}

/// Each inner edge must occur twice, in opposite directions, the others on borders; all areas must
/// be positive, with the area of the tile as their sum.
void expect_whole(const TileMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  std::int64_t sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::int64_t area = std::int64_t{mesh.u[b] - mesh.u[a]} * (mesh.v[c] - mesh.v[a]) -
                              std::int64_t{mesh.u[c] - mesh.u[a]} * (mesh.v[b] - mesh.v[a]);
    ASSERT_GT(area, 0);
    sum += area;
    for (const auto& edge : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}}) {
      ASSERT_TRUE(edges.insert(edge).second);
    }
  }
  EXPECT_EQ(sum, 2 * std::int64_t{kTileUnits} * kTileUnits);
  for (const auto& [a, b] : edges) {
    if (edges.contains({b, a})) continue;
    const auto both = [a = a, b = b](const std::vector<std::uint16_t>& c) {
      return c[a] == c[b] && (c[a] == 0 || c[a] == kTileUnits);
    };
    ASSERT_TRUE(both(mesh.u) || both(mesh.v)) << mesh.u[a] << "," << mesh.v[a];
  }
}

/// Compares every sample in a tile with its mesh, using measure_surface on all at once.
void expect_bound(const TileAddress& tile, const BuiltTile& made, const ZoomPlan& plan,
                  TileSurface& surface) {
  const GeographicBox box = box_of(tile);
  SurfaceSamples samples;
  surface.samples(box, samples);
  std::vector<double> u, v;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double units = kTileUnits / (box.east - box.west);
    u.push_back(std::clamp((samples.longitude[i] - box.west) * units, 0.0, 32767.0));
    v.push_back(std::clamp((samples.latitude[i] - box.south) * units, 0.0, 32767.0));
  }
  std::vector<tri::Point3> vertices;
  for (std::size_t i = 0; i < made.mesh.size(); ++i) {
    vertices.push_back({static_cast<double>(made.mesh.u[i]), static_cast<double>(made.mesh.v[i]),
                        made.mesh.metres(i)});
  }
  const auto errors = tri::measure_surface(u, v, samples.height, vertices, made.mesh.triangles);
  EXPECT_EQ(errors.uncovered, 0u);
  EXPECT_LE(errors.largest, made.max_error + 1e-7);
  // If samples are a few units of the tile apart, rounding their places on the steepest slope adds
  // to the error.
  constexpr double kSteepest = 20000;  // metres per degree
  const double unit = (box.east - box.west) / kTileUnits;
  EXPECT_LE(made.max_error, plan.max_error + 0.5 * plan.height_step +
                                (16 * unit > surface.spacing() ? kSteepest * unit : 0.0));
  EXPECT_EQ(made.has_data, samples.size() > 0);
  // Measuring part by part gives the same.
  const TileHeights parts = measure_tile(tile, made.mesh, surface, tile);
  EXPECT_EQ(parts.samples, samples.size());
  EXPECT_EQ(parts.uncovered, 0u);
  EXPECT_DOUBLE_EQ(parts.max_error, errors.largest);
  // The tiles two zooms below give the same.
  TileHeights sum;
  for (const TileAddress& child : children_of(tile)) {
    for (const TileAddress& part : children_of(child)) {
      sum.add(measure_tile(tile, made.mesh, surface, part));
    }
  }
  EXPECT_EQ(sum.samples, parts.samples);
  EXPECT_EQ(sum.uncovered, 0u);
  EXPECT_DOUBLE_EQ(sum.max_error, parts.max_error);
}

void expect_sound(const TileAddress& tile, const BuiltTile& made) {
  expect_whole(made.mesh);
  for (const TileFault& fault :
       check_tile_mesh(tile, {made.mesh, made.header, edges_of(made.mesh)}, {})) {
    ADD_FAILURE() << "byte " << fault.offset << ": " << fault.what;
  }
}

/// Expects the same vertices on both sides of a border, at heights that each tile rounds by itself.
void expect_fit(const TileMesh& mesh, const std::vector<std::pair<unsigned, double>>& side,
                const TileMesh& other, const std::vector<std::pair<unsigned, double>>& others) {
  const auto rounding = [](const TileMesh& m) {
    return 0.5 * (static_cast<double>(m.highest) - static_cast<double>(m.lowest)) / kTileUnits;
  };
  const double most = rounding(mesh) + rounding(other) + 1e-9;
  ASSERT_EQ(side.size(), others.size());
  for (std::size_t i = 0; i < side.size(); ++i) {
    EXPECT_EQ(side[i].first, others[i].first);
    EXPECT_NEAR(side[i].second, others[i].second, most);
  }
}

/// Checks all tiles of a zoom in a range, and their borders against each other.
void check_zoom(unsigned zoom, const TileRange& range, double max_error, TileSurface& surface) {
  SCOPED_TRACE(testing::Message() << "zoom " << zoom << ", bound " << max_error);
  const ZoomPlan plan = plan_of(zoom, max_error, surface);
  std::map<std::pair<std::uint32_t, std::uint32_t>, TileMesh> meshes;
  for (std::uint32_t y = range.y0; y <= range.y1; ++y) {
    for (std::uint32_t x = range.x0; x <= range.x1; ++x) {
      const TileAddress tile{zoom, x, y};
      SCOPED_TRACE(tile_path(tile));
      BuiltTile made = make_tile(tile, plan, surface, {});
      expect_sound(tile, made);
      expect_bound(tile, made, plan, surface);
      meshes[{x, y}] = std::move(made.mesh);
    }
  }
  for (const auto& [place, mesh] : meshes) {
    const TileEdges edges = edges_of(mesh);
    SCOPED_TRACE(testing::Message() << place.first << "," << place.second);
    if (const auto east = meshes.find({place.first + 1, place.second}); east != meshes.end()) {
      const TileMesh& other = east->second;
      expect_fit(mesh, side(mesh, edges.east, mesh.v), other,
                 side(other, edges_of(other).west, other.v));
    }
    if (const auto north = meshes.find({place.first, place.second + 1}); north != meshes.end()) {
      const TileMesh& other = north->second;
      expect_fit(mesh, side(mesh, edges.north, mesh.u), other,
                 side(other, edges_of(other).south, other.u));
    }
  }
}

TEST(TileMesher, LeavesDividedForCurvatureMatch) {
  AnalyticSurface surface = alps();
  check_zoom(0, {0, 0, 1, 0}, expected_error(0), surface);
  check_zoom(1, {1, 0, 3, 1}, expected_error(1), surface);
  check_zoom(2, {3, 2, 5, 3}, 60, surface);
}

TEST(TileMesher, LeavesDividedForDataInACornerMatch) {
  AnalyticSurface surface = alps();
  for (const unsigned zoom : {3U, 5U, 7U, 9U, 10U}) {
    TileRange range = tiles_in(surface.bounds(), zoom);
    // Also check adjacent tiles without samples.
    range = {range.x0 - 1, range.y0 - 1, range.x1 + 1, range.y1 + 1};
    if (zoom > 7) range = {range.x0, range.y0, range.x0 + 2, range.y0 + 2};
    check_zoom(zoom, range, 25, surface);
  }
}

TEST(TileMesher, TilesMatchWithDataOnBorders) {
  // Bounds on the lines between tiles or slightly off them, and samples on the lines.
  for (const double shift : {0.0, 1e-9, -1e-9}) {
    SCOPED_TRACE(shift);
    AnalyticSurface surface{11.25 + shift, 45.0 + shift, 11.25 / 1024, 129, 129, hills};
    check_zoom(4, {15, 10, 18, 13}, 40, surface);
    check_zoom(6, {66, 46, 70, 50}, 40, surface);
    check_zoom(7, {135, 95, 138, 98}, 40, surface);
  }
}

TEST(TileMesher, TilesMatchForScatteredSmallRasters) {
  std::uint64_t seed = 5;
  const auto between = [&seed](double low, double high) {
    seed = base::splitmix64(seed);
    return low + (high - low) * base::unit_interval(seed);
  };
  for (int round = 0; round < 12; ++round) {
    const double west = between(-170, 160), south = between(-85, 75);
    const double step = std::exp2(between(-10, -5));
    const int columns = 2 + static_cast<int>(between(0, 150));
    const int rows = 2 + static_cast<int>(between(0, 150));
    SCOPED_TRACE(testing::Message() << "round " << round << ": " << west << "," << south << " step "
                                    << step << ", " << columns << " x " << rows);
    AnalyticSurface surface{west, south, step, columns, rows, hills};
    const auto zoom = static_cast<unsigned>(between(1, 6));
    TileRange range = tiles_in(surface.bounds(), zoom);
    range.x1 = std::min(range.x1, range.x0 + 2);
    range.y1 = std::min(range.y1, range.y0 + 2);
    check_zoom(zoom, range, between(5, 200), surface);
  }
}

TEST(TileMesher, EveryQualityKeepsTheBound) {
  AnalyticSurface surface = alps();
  const TileAddress tile{8, tiles_in(surface.bounds(), 8).x0, tiles_in(surface.bounds(), 8).y0};
  const ZoomPlan plan = plan_of(8, 10, surface);
  for (const bool in_rows : {false, true}) {
    surface.in_rows = in_rows;
    std::vector<std::size_t> triangles;
    for (const auto quality :
         {tri::TinQuality::greedy, tri::TinQuality::removal, tri::TinQuality::fitted}) {
      const BuiltTile made = make_tile(tile, plan, surface, {.quality = quality});
      expect_sound(tile, made);
      expect_bound(tile, made, plan, surface);
      triangles.push_back(made.mesh.triangles.size());
    }
    EXPECT_GT(triangles[0], triangles[1]);
    EXPECT_GT(triangles[1], triangles[2]);
  }
}

TEST(TileMesher, NormalsAndWaterMatchSurface) {
  AnalyticSurface surface{10.0, 46.0, 0.01,
                          100,  100,  [](double lon, double) { return 8000 * (lon - 10.4); }};
  const TileRange range = tiles_in(surface.bounds(), 8);
  const ZoomPlan plan = plan_zoom(8, 5, 8000, surface);
  for (std::uint32_t x = range.x0; x <= range.x1; ++x) {
    const TileAddress tile{8, x, range.y0};
    const BuiltTile made =
        make_tile(tile, plan, surface, {.quality = {}, .normals = true, .water = true});
    const GeographicBox box = box_of(tile);
    ASSERT_EQ(made.mesh.normals.size(), made.mesh.size());
    for (std::size_t i = 0; i < made.mesh.size(); ++i) {
      const double lon = longitude_at(tile, made.mesh.u[i]);
      const double lat = latitude_at(tile, made.mesh.v[i]);
      const LocalFrame frame = local_frame(lon, lat);
      const auto& n = made.mesh.normals[i];
      double up = 0, east = 0, north = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        up += static_cast<double>(n[axis]) * frame.up[axis];
        east += static_cast<double>(n[axis]) * frame.east[axis];
        north += static_cast<double>(n[axis]) * frame.north[axis];
      }
      const double metres =
          std::cos(lat * base::kRadiansPerDegree) * base::kRadiansPerDegree * 6388000;
      EXPECT_NEAR(east / up, -8000 / metres, 0.001);
      EXPECT_NEAR(north / up, 0, 1e-5);
    }
    // Water is west of 10.4 degrees.
    const auto wet = [&](unsigned column) {
      return made.mesh.water.size() == 1 ? made.mesh.water[0] : made.mesh.water[256 * 100 + column];
    };
    for (unsigned column = 0; column < 256; ++column) {
      const double lon = box.west + (box.east - box.west) * (column + 0.5) / 256;
      EXPECT_EQ(wet(column), lon <= 10.4 ? 255 : 0);
    }
  }
}

TEST(TileMesher, ReportsHeightsBeyondSteps) {
  AnalyticSurface surface{10.0, 46.0, 0.01, 50, 50, [](double lon, double) { return 1e5 * lon; }};
  const TileRange range = tiles_in(surface.bounds(), 8);
  EXPECT_THROW(static_cast<void>(
                   make_tile({8, range.x0, range.y0}, plan_zoom(8, 1, 1, surface), surface, {})),
               HeightRangeTooLarge);
}

TEST(TileMesher, SharedSidesChangeNothing) {
  AnalyticSurface surface = alps();
  for (const unsigned zoom : {7u, 9u}) {
    SCOPED_TRACE(zoom);
    const ZoomPlan plan = plan_of(zoom, 10, surface);
    const TileRange range = tiles_in(surface.bounds(), zoom);
    SharedSides shared{kMaxSharedVertices};
    for (std::uint32_t y = range.y0; y <= std::min(range.y1, range.y0 + 2); ++y) {
      for (std::uint32_t x = range.x0; x <= std::min(range.x1, range.x0 + 2); ++x) {
        const BuiltTile alone = make_tile({zoom, x, y}, plan, surface, {});
        const BuiltTile beside = make_tile({zoom, x, y}, plan, surface, {}, &shared);
        EXPECT_EQ(encode_tile(alone.mesh, alone.header), encode_tile(beside.mesh, beside.header));
      }
    }
    // The tiles shared sides with each other.
    EXPECT_TRUE(
        shared.find({true, 0, range.y0 + 1, range.x0}) ||
        shared.find({true, 1, 2 * (std::uint64_t{range.y0} + 1), 2 * std::uint64_t{range.x0}}));
  }
}

TEST(TileMesher, StopsBetweenLeaves) {
  AnalyticSurface surface = alps();
  const TileAddress tile{0, 1, 0};
  const ZoomPlan plan = plan_of(0, expected_error(0), surface);
  int checks = 0;
  surface.stop_check = [&] { ++checks; };
  ASSERT_GT(leaves_of(tile, plan, surface).size(), 2U);
  const int to_divide = checks;
  checks = 0;
  surface.stop_check = [&] {
    if (++checks > to_divide + 1) throw stream::Stopped();
  };
  EXPECT_THROW(static_cast<void>(make_tile(tile, plan, surface, {})), stream::Stopped);
  EXPECT_EQ(checks, to_divide + 2);
}

TEST(TileLeaves, CoverTileOnce) {
  AnalyticSurface surface = alps();
  for (unsigned zoom = 0; zoom < 12; ++zoom) {
    SCOPED_TRACE(zoom);
    const TileRange range = tiles_in(surface.bounds(), zoom);
    const auto leaves = leaves_of({zoom, range.x0, range.y0}, plan_of(zoom, 20, surface), surface);
    double area = 0;
    std::set<std::tuple<unsigned, std::uint32_t, std::uint32_t>> seen;
    for (const TileLeaf& leaf : leaves) {
      ASSERT_LT(std::max(leaf.x, leaf.y), 1U << leaf.depth);
      ASSERT_TRUE(seen.emplace(leaf.depth, leaf.x, leaf.y).second);
      for (unsigned up = 1; up <= leaf.depth; ++up) {
        ASSERT_FALSE(seen.contains({leaf.depth - up, leaf.x >> up, leaf.y >> up}));
      }
      area += std::ldexp(1.0, -2 * static_cast<int>(leaf.depth));
    }
    EXPECT_EQ(area, 1.0);
  }
}

TEST(TileSides, GoAroundTheLeaf) {
  AnalyticSurface surface = alps();
  const ZoomPlan plan = plan_of(7, 10, surface);
  const TileRange range = tiles_in(surface.bounds(), 7);
  const TileAddress tile{7, range.x0, range.y0};
  TileSides sides(tile, plan, surface);
  for (const TileLeaf& leaf : leaves_of(tile, plan, surface)) {
    const std::uint32_t west = leaf_unit(leaf.x, leaf.depth), south = leaf_unit(leaf.y, leaf.depth);
    const std::uint32_t east = leaf_unit(leaf.x + 1, leaf.depth);
    const std::uint32_t north = leaf_unit(leaf.y + 1, leaf.depth);
    const std::vector<TileVertex> ring = sides.around(leaf);
    ASSERT_EQ(ring.front().u, west);
    ASSERT_EQ(ring.front().v, south);
    // Each step goes along one side, forward.
    unsigned turns = 0;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const TileVertex& a = ring[i];
      const TileVertex& b = ring[(i + 1) % ring.size()];
      const bool forward = (a.v == south && b.v == south && a.u < b.u) ||
                           (a.u == east && b.u == east && a.v < b.v) ||
                           (a.v == north && b.v == north && a.u > b.u) ||
                           (a.u == west && b.u == west && a.v > b.v);
      ASSERT_TRUE(forward) << a.u << "," << a.v << " to " << b.u << "," << b.v;
      turns += (a.u == west || a.u == east) && (a.v == south || a.v == north) ? 1 : 0;
    }
    EXPECT_EQ(turns, 4u);
  }
}

}  // namespace
}  // namespace terrace::terrain
