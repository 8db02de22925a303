// SPDX-License-Identifier: GPL-3.0-or-later
// Compares what tiles ask of a store of irregular points with answers computed from all of its
// points.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "random.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/crs.hpp"
#include "tile/make/cloud_samples.hpp"
#include "tile/make/crowded_leaf.hpp"
#include "tile/make/mesher.hpp"
#include "tile/make/point_surface.hpp"
#include "tile/make/sample_parts.hpp"

namespace terrace {
namespace {

using terrain::GeographicBox;
using terrain::Point2;
using terrain::StoredBox;
using tests::Random;

/// A cloud in its CRS.
struct CloudCase {
  std::string name, crs;
  std::vector<stream::Point3> points;
};

std::vector<CloudCase> cases() {
  std::vector<CloudCase> all;
  Random random(11);
  const auto height = [](double x, double y) { return 200 + 40 * std::sin(x) + 30 * std::cos(y); };
  CloudCase utm{"utm", "EPSG:32632", {}};
  for (int i = 0; i < 12000; ++i) {
    // Denser to the west, and with a void.
    const double x = 900 * random(0, 1) * random(0, 1), y = random(0, 700);
    if (std::hypot(x - 300, y - 300) < 120) continue;
    utm.points.push_back({480000 + x, 5200000 + y, height(x / 40, y / 50)});
    if (i % 40 == 0) utm.points.push_back({480000 + x, 5200000 + y, 1000.0});
  }
  all.push_back(std::move(utm));
  CloudCase degrees{"degrees", "EPSG:4326", {}};
  for (int i = 0; i < 6000; ++i) {
    const double x = random(179.9, 180.1), y = random(-16.6, -16.4);
    degrees.points.push_back({x, y, height(90 * x, 100 * y)});
  }
  all.push_back(std::move(degrees));
  CloudCase globe{"globe", "EPSG:4326", {}};
  for (int i = 0; i < 5000; ++i) {
    globe.points.push_back({random(0, 360), random(-90, 90), random(0, 3000)});
  }
  all.push_back(std::move(globe));
  CloudCase pole{"pole", "EPSG:32661", {}};
  for (int i = 0; i < 6000; ++i) {
    const double x = random(-60000, 60000), y = random(-40000, 80000);
    pole.points.push_back({2e6 + x, 2e6 + y, height(x / 4000, y / 5000)});
  }
  all.push_back(std::move(pole));
  CloudCase line{"line", "EPSG:32601", {}};
  for (int i = 0; i < 900; ++i) {
    line.points.push_back({165000 + 3.0 * i, 600000 + 1.0 * i, height(i / 9.0, 0)});
  }
  all.push_back(std::move(line));
  // A winding swath: nearly all cells of a grid over it are empty.
  CloudCase swath{"swath", "EPSG:32632", {}};
  for (int i = 0; i < 20000; ++i) {
    const double along = random(0, 60000);
    swath.points.push_back({450000 + along + random(-5, 5),
                            5200000 + 20000 * std::sin(along / 6000) + random(-5, 5),
                            height(along / 400, 0)});
  }
  all.push_back(std::move(swath));
  all.push_back({"one", "EPSG:3035", {{4321000, 3210000, 77.5}}});
  return all;
}

/// The store of a case, and what is known about it without an index.
struct CloudStore {
  tests::TemporaryFolder folder;
  stream::Store store;
  terrain::CoordinateSystem crs;
  std::vector<stream::Point3> firsts;  ///< the first point at each x, y, which is the one used
  std::vector<Point2> globe;           ///< their longitudes and latitudes

  explicit CloudStore(const CloudCase& cloud)
      : store(build(cloud, folder.path())), crs(terrain::system_of(store)) {
    std::set<Point2> seen;
    for (unsigned level = store.top() + 1; level-- > 0;) {
      store.for_each(level, [&](stream::ClusterId, const stream::ClusterRecord&,
                                const stream::ClusterPoints& points) {
        for (const stream::Point3& p : points.positions) {
          if (seen.insert({p[0], p[1]}).second) firsts.push_back(p);
        }
      });
    }
    for (const stream::Point3& p : firsts) globe.push_back({p[0], p[1]});
    terrain::StoredPlaces(store, crs).to_geographic(globe);
  }

  /// is_whole: as if all of it fitted into memory.
  [[nodiscard]] terrain::TiledCloud tiled(bool is_whole = false) const {
    return {
        store,
        crs,
        terrain::EllipsoidalHeights(store.schema(), terrain::HeightReference::ellipsoidal, "", 0),
        std::uint64_t{256} << 20,
        is_whole ? std::uint64_t{256} << 20 : 0,
        2};
  }

 private:
  static stream::Store build(const CloudCase& cloud, const std::filesystem::path& folder) {
    const auto file = folder / "cloud.xyz";
    std::ofstream out(file);
    out.precision(17);
    for (const stream::Point3& p : cloud.points) out << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
    out.close();
    terrain::BuildRequest request;
    request.inputs = {file.string()};
    request.store = folder / "cloud.store";
    request.block_points = 300;  // small blocks give more levels
    request.facility_cost = 1.0;
    request.crs = terrain::CoordinateSystem::parse(cloud.crs).crs();
    terrain::build_store(request);
    return stream::Store::open(request.store);
  }
};

/// Boxes of all sizes around points of a cloud, some with a border through the point.
GeographicBox some_box(const CloudStore& cloud, Random& random, int i) {
  const auto at = static_cast<std::size_t>(random(0, static_cast<double>(cloud.globe.size())));
  const Point2 p = cloud.globe[std::min(at, cloud.globe.size() - 1)];
  const double size = std::exp2(random(-18, i % 3 == 0 ? 8 : 0));
  const double west = i % 2 == 0 ? p[0] : p[0] - random(0, size);
  const double south = p[1] - random(0, size);
  return {std::max(west, -180.0), std::max(south, -90.0), std::min(west + size, 180.0),
          std::min(south + size * random(0.01, 1.5), 90.0)};
}

bool inside(const GeographicBox& box, const Point2& p) {
  return p[0] >= box.west && p[0] <= box.east && p[1] >= box.south && p[1] <= box.north;
}

/// Projected points are converted by polynomials.
TEST(StoredPlaces, MatchTheCrsWithinAHundredthOfAMillimetre) {
  for (const CloudCase& cloud : cases()) {
    SCOPED_TRACE(cloud.name);
    const CloudStore all(cloud);
    const terrain::StoredPlaces places(all.store, all.crs);
    std::vector<Point2> exact, stored = all.globe;
    for (const stream::Point3& p : all.firsts) exact.push_back({p[0], p[1]});
    all.crs.to_geographic(exact);
    places.to_stored(stored);
    const bool degrees = all.crs.is_geographic();
    for (std::size_t i = 0; i < exact.size(); ++i) {
      // Near a pole, longitudes are ill-conditioned.
      const double round = std::cos(exact[i][1] * std::numbers::pi / 180);
      ASSERT_NEAR(std::remainder(all.globe[i][0] - exact[i][0], 360.0) * round, 0, 1e-10);
      ASSERT_NEAR(all.globe[i][1], exact[i][1], 1e-10);
      for (std::size_t k = 0; k < 2 && !degrees; ++k) {
        ASSERT_NEAR(stored[i][k], all.firsts[i][k], 3e-5 / all.crs.metres_per_unit());
      }
    }
  }
}

TEST(PointTileSurface, HasTheSamplesOfABoxAndTheirRange) {
  for (const CloudCase& cloud : cases()) {
    SCOPED_TRACE(cloud.name);
    const CloudStore all(cloud);
    const terrain::TiledCloud tiled = all.tiled();
    terrain::PointTileSurface surface(tiled);
    for (const Point2& p : all.globe)
      ASSERT_TRUE(inside(surface.bounds(), p)) << p[0] << " " << p[1];
    EXPECT_GT(surface.spacing(), 0.0);
    Random random(23);
    int certain = 0;
    for (int i = 0; i < 150; ++i) {
      const GeographicBox box = some_box(all, random, i);
      SCOPED_TRACE(testing::Message() << i << ": " << box.west << " " << box.south << " "
                                      << box.east << " " << box.north);
      std::set<std::tuple<double, double, double>> expected;
      double low = 1e9, high = -1e9;
      for (std::size_t k = 0; k < all.firsts.size(); ++k) {
        if (!inside(box, all.globe[k])) continue;
        expected.insert({all.globe[k][0], all.globe[k][1], all.firsts[k][2]});
        low = std::min(low, all.firsts[k][2]);
        high = std::max(high, all.firsts[k][2]);
      }
      terrain::SurfaceSamples found;
      surface.samples(box, found);
      std::set<std::tuple<double, double, double>> got;
      for (std::size_t k = 0; k < found.size(); ++k) {
        got.insert({found.longitude[k], found.latitude[k], found.height[k]});
      }
      EXPECT_EQ(found.size(), got.size());
      ASSERT_EQ(got, expected);
      const auto range = surface.range(box);
      if (expected.empty()) {
        EXPECT_FALSE(range && range->certain);
        continue;
      }
      ASSERT_TRUE(range);
      EXPECT_LE(range->low, low);
      EXPECT_GE(range->high, high);
      certain += range->certain ? 1 : 0;
      // Reading in parts gives the same, each sample once.
      got.clear();
      std::size_t count = 0;
      terrain::for_each_part(box, surface, [&](const terrain::SurfaceSamples& part) {
        count += part.size();
        for (std::size_t k = 0; k < part.size(); ++k) {
          got.insert({part.longitude[k], part.latitude[k], part.height[k]});
        }
      });
      EXPECT_EQ(count, expected.size());
      EXPECT_EQ(got, expected);
    }
    EXPECT_GT(certain, all.globe.size() > 1 ? 8 : -1);
  }
}

std::multiset<std::array<double, 3>> samples_of(terrain::PointTileSurface& surface,
                                                const GeographicBox& box) {
  terrain::SurfaceSamples found;
  surface.samples(box, found);
  std::multiset<std::array<double, 3>> samples;
  for (std::size_t i = 0; i < found.size(); ++i)
    samples.insert({found.longitude[i], found.latitude[i], found.height[i]});
  return samples;
}

TEST(PointTileSurface, AnswersAlikeWhetherOrNotAllFitsIntoMemory) {
  for (const CloudCase& cloud : cases()) {
    SCOPED_TRACE(cloud.name);
    const CloudStore all(cloud);
    const terrain::TiledCloud parts = all.tiled(), whole = all.tiled(true);
    ASSERT_FALSE(parts.samples);
    ASSERT_TRUE(whole.samples);
    EXPECT_EQ(whole.samples->crowd(), cloud.name == "swath");
    terrain::PointTileSurface some(parts), once(whole);
    Random random(31);
    for (int i = 0; i < 120; ++i) {
      const GeographicBox box = some_box(all, random, i);
      SCOPED_TRACE(testing::Message() << i << ": " << box.west << " " << box.south << " "
                                      << box.east << " " << box.north);
      // To the last bit, in any order.
      EXPECT_EQ(samples_of(once, box), samples_of(some, box));
      EXPECT_EQ(once.crowded(box), some.crowded(box));
      std::vector<double> longitude, latitude;
      for (int k = 0; k < 20; ++k) {
        longitude.push_back(random(box.west, box.east));
        latitude.push_back(random(box.south, box.north));
      }
      std::vector<double> a(longitude.size()), b(longitude.size());
      some.heights(longitude, latitude, a);
      once.heights(longitude, latitude, b);
      EXPECT_EQ(a, b);
    }
  }
}

TEST(PointTileSurface, MatchesAllPointsAfterAnyEarlierQueries) {
  for (const CloudCase& cloud : cases()) {
    if (cloud.name == "one" || cloud.name == "line") continue;
    SCOPED_TRACE(cloud.name);
    const CloudStore all(cloud);
    const terrain::TiledCloud tiled = all.tiled();
    terrain::PointTileSurface surface(tiled), other(tiled);
    tri::Delaunay2<double> whole;
    std::map<Point2, double> height;
    std::vector<tri::Point2> places;
    for (const stream::Point3& p : all.firsts) {
      height[{p[0], p[1]}] = p[2];
      places.push_back({p[0], p[1]});
    }
    whole.build(places);
    Random random(31);
    for (int i = 0; i < 30; ++i) {
      const GeographicBox box = some_box(all, random, i);
      std::vector<double> longitude, latitude;
      for (int k = 0; k < 40; ++k) {
        longitude.push_back(random(box.west, box.east));
        latitude.push_back(random(box.south, box.north));
      }
      // A point itself.
      const auto at = static_cast<std::size_t>(random(0, static_cast<double>(all.globe.size())));
      longitude.push_back(all.globe[at][0]);
      latitude.push_back(all.globe[at][1]);
      std::vector<double> found(longitude.size()), again(1);
      if (i % 2 == 0) surface.expect(box);
      surface.heights(longitude, latitude, found);
      std::vector<Point2> stored;
      for (std::size_t k = 0; k < found.size(); ++k) stored.push_back({longitude[k], latitude[k]});
      tiled.places.to_stored(stored);
      EXPECT_NEAR(found.back(), all.firsts[at][2], 1e-4);
      for (std::size_t k = 0; k < found.size(); ++k) {
        SCOPED_TRACE(testing::Message() << longitude[k] << " " << latitude[k]);
        ASSERT_TRUE(std::isfinite(found[k]));
        other.heights(std::span(&longitude[k], 1), std::span(&latitude[k], 1), again);
        ASSERT_EQ(found[k], again[0]);
        if (k + 1 == found.size()) continue;
        const auto location = whole.locate({stored[k][0], stored[k][1]});
        if (location.place != tri::Place::inside) continue;
        const tri::TriangleId triangle = location.triangle;
        std::array<stream::Point3, 3> corner;
        for (unsigned c = 0; c < 3; ++c) {
          const tri::Point2 p = whole.point(whole.vertices(triangle)[c]);
          corner[c] = {p[0], p[1], height.at({p[0], p[1]})};
        }
        const auto cross = [](const stream::Point3& a, const stream::Point3& b, const Point2& p) {
          return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        };
        const double area = cross(corner[0], corner[1], {corner[2][0], corner[2][1]});
        double sum = 0.0;
        for (unsigned c = 0; c < 3; ++c) {
          sum += corner[c][2] * cross(corner[(c + 1) % 3], corner[(c + 2) % 3], stored[k]) / area;
        }
        EXPECT_NEAR(found[k], sum, 1e-6 * (1 + std::abs(sum)));
      }
    }
  }
}

TEST(StoreWindow, TheIndexGivesCountsAndHeightsOfABox) {
  const CloudStore all(cases().front());
  stream::StoreQuery query(all.store);
  const stream::Box3& bounds = all.store.bounds();
  // The index enlarges boxes slightly.
  EXPECT_NEAR(query.estimate(terrain::tall(terrain::flat(bounds))),
              static_cast<double>(all.store.points()), 1.0);
  std::vector<std::pair<stream::Box3, std::uint64_t>> clusters;
  for (std::uint64_t i = 0; i < all.store.levels()[0].clusters; ++i) {
    const auto summary = all.store.record(stream::cluster_id(0, i)).summary;
    clusters.emplace_back(summary.box, summary.descendants);
  }
  ASSERT_GT(all.store.top(), 1U);
  Random random(41);
  for (int i = 0; i < 300; ++i) {
    const double x = random(479900, 481000), y = random(5199900, 5200800);
    const StoredBox box{{x, y}, {x + std::exp2(random(-3, 10)), y + std::exp2(random(-3, 10))}};
    double expected = 0;
    double low = 1e9, high = -1e9;
    int met = 0;
    for (const auto& [around, count] : clusters) {
      if (!box.intersects(terrain::flat(around))) continue;
      double share = static_cast<double>(count);
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const double from = std::max(box.min[axis], around.min[axis]);
        const double to = std::min(box.max[axis], around.max[axis]);
        if (around.max[axis] > around.min[axis]) {
          share *= (to - from) / (around.max[axis] - around.min[axis]);
        }
      }
      expected += share;
      ++met;
      low = std::min(low, around.min[2]);
      high = std::max(high, around.max[2]);
    }
    EXPECT_NEAR(query.estimate(terrain::tall(box)), expected, 1e-6 * expected);
    EXPECT_EQ(query.estimate(terrain::tall(box), 500) > 500, expected > 500);
    const auto heights = terrain::cluster_heights(query, box);
    ASSERT_EQ(heights.has_value(), met > 0);
    if (!heights) continue;
    // For a cluster above level 0 that is entirely inside the box, the index gives the same range,
    // enlarged by the same margin.
    EXPECT_LE(heights->low, low);
    EXPECT_GE(heights->high, high);
    const double growth = (bounds.max[2] - bounds.min[2]) / 1024;
    EXPECT_NEAR(heights->low, low, growth);
    EXPECT_NEAR(heights->high, high, growth);
    for (const stream::Point3& p : heights->examples) EXPECT_TRUE(box.contains(terrain::flat(p)));
  }
}

TEST(CloudSpacing, MatchesALatticeOfTheSameDensity) {
  CloudCase lattice{"lattice", "EPSG:4326", {}}, far = lattice;
  Random random(5);
  for (int i = 0; i < 80; ++i) {
    for (int j = 0; j < 80; ++j) {
      lattice.points.push_back(
          {7 + 1e-4 * i / std::cos(46 * 3.14159265358979 / 180), 46 + 1e-4 * j, 5});
      far.points.push_back({7 + random(0, 0.008), 46 + random(0, 0.008), 5});
      if (j == 0) far.points.push_back({7 + random(0, 5), 46 + random(0, 3), 9});
    }
  }
  const auto spacing = [](const CloudCase& cloud) {
    const CloudStore all(cloud);
    return terrain::cloud_spacing(all.store, terrain::StoredPlaces(all.store, all.crs));
  };
  EXPECT_NEAR(spacing(lattice), 1e-4, 0.15e-4);
  EXPECT_NEAR(spacing(far), 1e-4 * std::sqrt(0.695), 0.25e-4);
  EXPECT_EQ(spacing({"one", "EPSG:4326", {{7, 46, 5}, {7, 46, 5}, {7, 46, 9}}}), 180.0 / 64.0);
}

TEST(TileCandidates, IncludeEveryTileThatMayHaveSamples) {
  for (const CloudCase& cloud : cases()) {
    SCOPED_TRACE(cloud.name);
    const CloudStore all(cloud);
    const terrain::TiledCloud tiled = all.tiled();
    terrain::PointTileSurface surface(tiled);
    for (const unsigned zoom : {0U, 1U, 4U, 9U}) {
      const auto tiles = terrain::tiles_with_samples(surface, zoom, {});
      std::set<std::pair<std::uint32_t, std::uint32_t>> found;
      for (const terrain::TileAddress& tile : tiles) found.insert({tile.y, tile.x});
      EXPECT_EQ(found.size(), tiles.size());
      const double width = 180.0 / std::exp2(zoom);
      for (const Point2& p : all.globe) {
        const auto x = std::min(std::floor((p[0] + 180) / width), std::exp2(zoom + 1) - 1);
        const auto y = std::min(std::floor((p[1] + 90) / width), std::exp2(zoom) - 1);
        ASSERT_TRUE(found.contains({static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(x)}))
            << p[0] << " " << p[1];
      }
      EXPECT_TRUE(std::is_sorted(tiles.begin(), tiles.end(), [](const auto& a, const auto& b) {
        return std::pair{a.y, a.x} < std::pair{b.y, b.x};
      }));
    }
  }
}

TEST(CrowdedLeaf, IsWithinTheBoundOfAllItsSamples) {
  const CloudStore all(cases().front());
  const terrain::TiledCloud tiled = all.tiled();
  terrain::PointTileSurface surface(tiled);
  // All of the cloud within a few units of a leaf.
  for (const unsigned zoom : {6U, 8U, 10U}) {
    SCOPED_TRACE(zoom);
    const terrain::TileRange range = terrain::tiles_in(surface.bounds(), zoom);
    const terrain::TileAddress tile{zoom, range.x0, range.y0};
    const terrain::ZoomPlan plan = terrain::plan_zoom(zoom, 40, 2000, surface);
    const double unit = terrain::tile_width(zoom) / terrain::kTileUnits;
    const auto place = [&](double degrees, double from) {
      return static_cast<std::uint32_t>((degrees - from) / unit) / 128;
    };
    const GeographicBox box = box_of(tile);
    const terrain::TileLeaf leaf{8, place(surface.bounds().west, box.west),
                                 place(surface.bounds().south, box.south)};
    terrain::TileSides sides(tile, plan, surface);
    std::vector<tri::Point3> frame;
    for (const terrain::TileVertex& vertex : sides.around(leaf)) {
      frame.push_back({static_cast<double>(vertex.u), static_cast<double>(vertex.v),
                       static_cast<double>(vertex.height) * plan.height_step});
    }
    tri::PointTinOptions options;
    options.lattice = tri::TinLattice{0.0, plan.height_step};
    terrain::SurfaceSamples samples;
    surface.samples(box_of(tile, leaf), samples);
    ASSERT_GT(samples.size(), 50U);
    const terrain::LeafPlaces units(tile, leaf);
    std::vector<double> u, v;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      u.push_back(units.u(samples.longitude[i]));
      v.push_back(units.v(samples.latitude[i]));
    }
    for (const double bound : {500.0, 60.0, 5.0}) {
      SCOPED_TRACE(bound);
      options.max_error = bound;
      const tri::PointTin made = mesh_crowded_leaf(tile, leaf, frame, options, surface);
      const tri::TinErrors errors =
          tri::measure_surface(u, v, samples.height, made.vertices, made.triangles);
      EXPECT_EQ(errors.uncovered, 0U);
      EXPECT_EQ(errors.covered, made.errors.covered);
      EXPECT_EQ(errors.largest, made.errors.largest);
      EXPECT_NEAR(errors.rms, made.errors.rms, 1e-9 * errors.rms);
      // As close as if they had been read at once, or within the bound.
      const tri::PointTin once = tri::point_tin(u, v, samples.height, frame, options);
      EXPECT_LE(made.errors.largest, std::max(bound, 1.3 * once.errors.largest));
    }
  }
}

}  // namespace
}  // namespace terrace
