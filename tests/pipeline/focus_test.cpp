// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the surface of mixed levels with the mesh of mixed levels, and with the surfaces of
// single levels where they must be the same.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/store.hpp>
#include <terrace/tri/predicates.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "focus_case.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/profile.hpp"
#include "terrace/terrain/raster.hpp"

namespace terrace::focus_test {
namespace {

using terrain::Detail;
using terrain::FinerRegion;
using terrain::Point2;
using terrain::SurfacePoint;
using tests::covers;
using tests::FocusMesh;
using tests::is_in_full_detail;
using tests::Random;
using tests::same_bits;
using tests::Triangle;
using tests::Whole;
using tri::Interpolation;

constexpr int kSeeds = 4;

bool same(const SurfacePoint& a, const SurfacePoint& b) {
  return same_bits(a.height, b.height) && same_bits(a.per_column, b.per_column) &&
         same_bits(a.per_row, b.per_row);
}

std::vector<SurfacePoint> sampled(const stream::Store& store, const Detail& detail,
                                  const std::vector<Point2>& places,
                                  Interpolation method = Interpolation::linear,
                                  const terrain::Context& context = {}) {
  std::vector<SurfacePoint> out(places.size());
  terrain::make_sampler(store, {.method = method, .level = detail.level, .focuses = detail.focuses},
                        context)
      ->sample(places, out);
  return out;
}

/// Checks that neither threads, memory nor the number of places change a bit.
std::vector<SurfacePoint> sampled_anyhow(const stream::Store& store, const Detail& detail,
                                         const std::vector<Point2>& places, Interpolation method) {
  const std::vector<SurfacePoint> out = sampled(store, detail, places, method);
  const auto again = sampled(store, detail, places, method,
                             {.threads = 3, .memory_bytes = std::uint64_t{100} << 20});
  const auto alone = terrain::make_sampler(
      store, {.method = method, .level = detail.level, .focuses = detail.focuses});
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_TRUE(same(out[i], again[i])) << "place " << i;
    if (i % 17 != 0) continue;
    SurfacePoint one;
    alone->sample({&places[i], 1}, {&one, 1});
    EXPECT_TRUE(same(out[i], one)) << "place " << i;
  }
  return out;
}

std::vector<Point2> places_of(const stream::Store& store, const tests::Points& points,
                              Random& random) {
  std::vector<Point2> places;
  const stream::Box3& box = store.bounds();
  for (int i = 0; i < 400; ++i) {
    const auto point = [&] {
      const stream::Point3& p = points[random.below(points.size())];
      return Point2{p[0], p[1]};
    };
    if (i % 4 == 0) {
      places.push_back({box.min[0] + random(-0.02, 1.02) * (box.max[0] - box.min[0]),
                        box.min[1] + random(-0.02, 1.02) * (box.max[1] - box.min[1])});
    } else if (i % 4 == 1) {
      places.push_back(point());
    } else {
      // Close to a point, so mostly where points are crowded.
      const Point2 a = point(), b = point();
      const double t = i % 4 == 2 ? 1e-2 : 1e-3;
      places.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])});
    }
  }
  return places;
}

/// Returns the corners of the triangle that contains the place in its interior.
std::optional<Triangle> triangle_at(const Whole& whole, const Point2& place) {
  if (whole.triangulation.triangle_count() == 0) return {};
  const tri::Location found = whole.triangulation.locate(place);
  if (found.place != tri::Place::inside) return {};
  const terrain::SurfaceTriangle t = whole.corners(found.triangle);
  return Triangle{t[0].place, t[1].place, t[2].place};
}

class SurfaceOfMixedLevels : public testing::TestWithParam<std::string> {};

TEST_P(SurfaceOfMixedLevels, IsTheMeshAndThatOfALevelInsideAndOutsideOfFocuses) {
  const tests::TemporaryFolder folder;
  const bool is_view = GetParam() == "view";
  const stream::Store all = stream::Store::open(
      tests::cloud_store(folder.path(), tests::points_of(is_view ? "random" : GetParam())));
  const stream::Store store = is_view ? all.where("z > 2") : all;
  ASSERT_GT(store.top(), 0u);
  const Whole full(store, 0);
  std::size_t inside = 0, outside = 0, between = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Detail detail = tests::random_detail(store, random);
    const FocusMesh mesh(store, detail);
    const Whole mixed(mesh.points), coarse(store, detail.level);
    ASSERT_EQ(mixed.triangulation.triangle_count(), mesh.triangles.size());
    const std::vector<Point2> places = places_of(store, mesh.points, random);
    const auto found = sampled_anyhow(store, detail, places, Interpolation::linear);
    const auto fine = sampled(store, {.level = 0}, places);
    const auto rough = sampled(store, {.level = detail.level}, places);
    const auto nearest = sampled(store, detail, places, Interpolation::nearest);
    for (std::size_t i = 0; i < places.size(); ++i) {
      SCOPED_TRACE("place " + std::to_string(i));
      ASSERT_TRUE(same(found[i], mixed.at(places[i])));
      const tri::VertexId near = mixed.triangulation.nearest(places[i]);
      ASSERT_TRUE(same_bits(nearest[i].height, mixed.heights[tri::slot(near)]));
      bool is_inside = false;
      if (const auto t = triangle_at(full, places[i])) {
        for (const FinerRegion& focus : detail.focuses) {
          is_inside =
              is_inside || (focus.level == 0 && std::all_of(t->begin(), t->end(), [&](auto& p) {
                              return covers(focus, store, p);
                            }));
        }
      }
      bool is_outside = false;
      if (const auto t = triangle_at(coarse, places[i])) {
        is_outside = std::none_of(mesh.points.begin(), mesh.points.end(), [&](const auto& p) {
          const Point2 q{p[0], p[1]};
          return std::find(t->begin(), t->end(), q) == t->end() &&
                 tri::inside_circle((*t)[0], (*t)[1], (*t)[2], q);
        });
      }
      if (is_inside) {
        ASSERT_TRUE(same(found[i], fine[i]));
      }
      if (is_outside) {
        ASSERT_TRUE(same(found[i], rough[i]));
      }
      ++(is_inside ? inside : is_outside ? outside : between);
    }
  }
  if (GetParam().ends_with("line")) return;  // no or too narrow triangles
  EXPECT_GT(inside, 0u);
  EXPECT_GT(outside, 0u);
  EXPECT_GT(between, 0u);
}

INSTANTIATE_TEST_SUITE_P(Focus, SurfaceOfMixedLevels,
                         testing::Values("random", "lattice", "duplicates", "voids", "clusters",
                                         "turned", "straight borders", "line", "nearly a line",
                                         "view"),
                         [](const auto& one) {
                           std::string name = one.param;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

std::vector<Point2> places_on_lattice(const stream::Store& store, Random& random) {
  std::vector<Point2> places;
  for (int i = 0; i < 3000; ++i) {
    Point2 p{random(-1, static_cast<double>(store.schema().columns)),
             random(-1, static_cast<double>(store.schema().rows))};
    for (std::size_t k = 0; k < 2; ++k) {
      if (i % 4 == 1 || (i % 4 == 2 && k == 0)) p[k] = std::round(p[k]);
    }
    if (i % 8 == 3) p = {std::floor(p[0]) + 0.25, std::floor(p[1]) + 0.75};
    places.push_back(p);
  }
  places.push_back({NAN, 0});
  places.push_back({0, INFINITY});
  return places;
}

TEST(Focus, OfARasterIsExactInsideAndTheMeshElsewhere) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(tests::raster_store(folder.path()));
  ASSERT_GT(store.top(), 0u);
  std::size_t inside = 0, missing = 0, elsewhere = 0;
  for (std::uint64_t seed = 1; seed <= 2 * kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Detail detail = tests::random_detail(store, random);
    const std::vector<Point2> places = places_on_lattice(store, random);
    const FocusMesh mesh(store, detail);
    const Whole mixed(mesh.points);
    std::set<Triangle> in_mesh;
    for (auto t : mesh.triangles) {
      Triangle corners{Point2{t[0][0], t[0][1]}, {t[1][0], t[1][1]}, {t[2][0], t[2][1]}};
      if (tri::orientation(corners[0], corners[1], corners[2]) < 0)
        std::swap(corners[1], corners[2]);
      in_mesh.insert(tests::turned(corners));
    }
    for (const Interpolation method :
         {Interpolation::linear, Interpolation::natural_neighbour, Interpolation::nearest}) {
      SCOPED_TRACE("method " + std::to_string(static_cast<int>(method)));
      const auto found = sampled_anyhow(store, detail, places, method);
      const auto fine = sampled(store, {.level = 0}, places, method);
      for (std::size_t i = 0; i < places.size(); ++i) {
        SCOPED_TRACE("place " + std::to_string(i));
        if (!std::isfinite(places[i][0] + places[i][1])) {
          ASSERT_TRUE(std::isnan(found[i].height));
          continue;
        }
        if (is_in_full_detail(store, detail, places[i], 2)) {
          ASSERT_TRUE(same(found[i], fine[i]));
          ++(std::isnan(fine[i].height) ? missing : inside);
          continue;
        }
        if (method != Interpolation::linear) continue;
        const auto t = triangle_at(mixed, places[i]);
        if (!t || !in_mesh.contains(tests::turned(*t))) continue;
        const SurfacePoint expected = mixed.at(places[i]);
        ASSERT_NEAR(found[i].height, expected.height, 1e-9);
        ++elsewhere;
      }
    }
  }
  EXPECT_GT(inside, 0u);
  EXPECT_GT(missing, 0u);
  EXPECT_GT(elsewhere, 0u);
}

TEST(Focus, HasTheHeightsOfTheVerticesOfTheMesh) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(tests::raster_store(folder.path()));
  for (std::uint64_t seed = 11; seed < 11 + kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Detail detail = tests::random_detail(store, random);
    const FocusMesh mesh(store, detail);
    std::vector<Point2> places;
    for (const stream::Point3& p : mesh.points) places.push_back({p[0], p[1]});
    const auto found = sampled(store, detail, places);
    for (std::size_t i = 0; i < places.size(); ++i) {
      ASSERT_EQ(found[i].height, mesh.points[i][2]) << "vertex " << i;
    }
  }
}

TEST(Focus, ThatIsNotFinerThanTheLevelChangesNothing) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      stream::Store::open(tests::cloud_store(folder.path(), tests::points_of("random")));
  Random random(3);
  const std::vector<Point2> places = places_of(store, tests::points_of("random"), random);
  const FinerRegion here{terrain::Region::parse("100,100,500,500"), 1};
  const auto expected = sampled(store, {.level = 1}, places);
  const auto found = sampled(store, {.level = 1, .focuses = {here}}, places);
  for (std::size_t i = 0; i < places.size(); ++i) ASSERT_TRUE(same(found[i], expected[i]));
  const FinerRegion absent{here.region, store.top() + 1};
  EXPECT_THROW(sampled(store, {.level = store.top(), .focuses = {absent}}, places),
               terrain::UsageError);
}

/// A place where a line crosses an edge.
struct Crossing {
  double t = 0;  ///< from 0 to 1 along the line
  double height = 0;
};

/// Returns the crossings of the line with edges of the triangles, in order.
std::vector<Crossing> crossings(const Whole& whole, const Point2& from, const Point2& to) {
  using End = std::pair<Point2, double>;
  std::set<std::pair<End, End>> edges;
  for (const auto& [corners, heights] : whole.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t next = (i + 1) % 3;
      const End a{corners[i], heights[i]}, b{corners[next], heights[next]};
      if (tri::orientation(from, to, a.first) * tri::orientation(from, to, b.first) < 0) {
        edges.insert(std::minmax(a, b));
      }
    }
  }
  std::vector<Crossing> found;
  const Point2 way{to[0] - from[0], to[1] - from[1]};
  for (const auto& [a, b] : edges) {
    const Point2 edge{b.first[0] - a.first[0], b.first[1] - a.first[1]};
    const Point2 off{a.first[0] - from[0], a.first[1] - from[1]};
    const double area = way[0] * edge[1] - way[1] * edge[0];
    const double t = (off[0] * edge[1] - off[1] * edge[0]) / area;
    const double share = (off[0] * way[1] - off[1] * way[0]) / area;
    if (t > 0 && t < 1) found.push_back({t, a.second + share * (b.second - a.second)});
  }
  std::sort(found.begin(), found.end(), [](auto& a, auto& b) { return a.t < b.t; });
  return found;
}

std::vector<terrain::ProfilePoint> profile_of(const stream::Store& store, const Detail& detail,
                                              const Point2& from, const Point2& to,
                                              std::optional<double> step = {}) {
  std::vector<terrain::ProfilePoint> rows;
  terrain::profile(store,
                   {.sampler = {.level = detail.level, .focuses = detail.focuses},
                    .line = {from, to},
                    .step = step},
                   [&](auto points) { rows.insert(rows.end(), points.begin(), points.end()); });
  return rows;
}

TEST(Focus, ProfilesCrossTheEdgesOfTheMesh) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      stream::Store::open(tests::cloud_store(folder.path(), tests::points_of("voids")));
  std::size_t inside = 0;
  for (std::uint64_t seed = 21; seed < 21 + 2 * kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Detail detail = tests::random_detail(store, random);
    const Whole mixed(FocusMesh(store, detail).points);
    const stream::Box3& box = detail.focuses.front().region.box();
    const Point2 from{random(box.min[0], box.max[0]), random(box.min[1], box.max[1])};
    const Point2 to{random(100, 900), random(100, 900)};
    const auto rows = profile_of(store, detail, from, to);
    const std::vector<Crossing> expected = crossings(mixed, from, to);
    ASSERT_EQ(rows.size(), expected.size() + 2);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_NEAR(rows[i + 1].place[0], from[0] + expected[i].t * (to[0] - from[0]), 1e-6);
      EXPECT_NEAR(rows[i + 1].height, expected[i].height, 1e-6);
    }
    const auto steps = profile_of(store, detail, from, to, 3.0);
    const auto fine = profile_of(store, {.level = 0}, from, to, 3.0);
    const Whole full(store, 0);
    ASSERT_EQ(steps.size(), fine.size());
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const auto t = triangle_at(full, steps[i].place);
      const bool is_inside =
          t && std::any_of(detail.focuses.begin(), detail.focuses.end(), [&](const auto& focus) {
            return focus.level == 0 && std::all_of(t->begin(), t->end(), [&](const Point2& p) {
                     return covers(focus, store, p);
                   });
          });
      if (!is_inside) continue;
      EXPECT_TRUE(same_bits(steps[i].height, fine[i].height));
      ++inside;
    }
  }
  EXPECT_GT(inside, 0u);
}

TEST(Focus, ProfilesOfARasterHaveNoHeightsWhereTheLatticeHasNone) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(tests::raster_store(folder.path()));
  // Around the missing samples, which are within 30 columns of (60, 50).
  const Detail detail{.level = store.top(),
                      .focuses = {{terrain::Region::parse("500750,5197250,503000,5199750"), 0}}};
  const Point2 from{500900, 5198510}, to{502900, 5198470};
  const auto rows = profile_of(store, detail, from, to);
  const auto lattice = profile_of(store, {.level = 0}, from, to);
  ASSERT_FALSE(rows.empty());
  std::size_t with = 0, without = 0;
  for (const terrain::ProfilePoint& row : rows) {
    const Point2 stored = stored_place(store.schema(), row.place);
    const double centre = std::hypot(stored[0] - 60, stored[1] - 50);
    if (centre < 28) {
      EXPECT_TRUE(std::isnan(row.height));
      ++without;
    } else if (centre > 32) {
      const auto near = std::find_if(lattice.begin(), lattice.end(), [&](const auto& other) {
        return std::abs(other.metres - row.metres) < 1e-6;
      });
      ASSERT_TRUE(near != lattice.end());
      EXPECT_NEAR(row.height, near->height, 1e-6);
      ++with;
    }
  }
  EXPECT_GT(with, 0u);
  EXPECT_GT(without, 0u);
}

/// Writes a raster of the store and builds a store of it.
stream::Store raster_of(const std::filesystem::path& folder, const std::string& name,
                        const stream::Store& store, const Detail& detail) {
  const std::filesystem::path file = folder / (name + ".tif");
  terrain::write_raster(store, {.sampler = {.level = detail.level, .focuses = detail.focuses},
                                .output = file.string()});
  terrain::BuildRequest request;
  request.inputs = {file.string()};
  request.store = folder / (name + ".store");
  terrain::build_store(request);
  return stream::Store::open(request.store);
}

TEST(Focus, RastersHaveTheCellsOfLevel0Inside) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(tests::raster_store(folder.path()));
  const stream::Store fine = raster_of(folder.path(), "fine", store, {.level = 0});
  std::size_t inside = 0;
  for (std::uint64_t seed = 31; seed < 31 + kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    Detail detail = tests::random_detail(store, random);
    detail.focuses.front().level = 0;
    const stream::Store mixed =
        raster_of(folder.path(), "mixed" + std::to_string(seed), store, detail);
    ASSERT_EQ(mixed.schema().columns, fine.schema().columns);
    ASSERT_EQ(mixed.schema().rows, fine.schema().rows);
    std::vector<Point2> cells;
    for (double row = 0; row < 120; ++row) {
      for (double column = 0; column < 150; ++column) cells.push_back({column, row});
    }
    const auto found = sampled(mixed, {.level = 0}, cells);
    const auto expected = sampled(fine, {.level = 0}, cells);
    const auto surface = sampled(store, detail, cells);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      ASSERT_TRUE(same_bits(found[i].height, static_cast<float>(surface[i].height)))
          << "cell " << i;
      if (!is_in_full_detail(store, detail, cells[i], 2)) continue;
      ASSERT_TRUE(same_bits(found[i].height, expected[i].height)) << "cell " << i;
      ++inside;
    }
  }
  EXPECT_GT(inside, 0u);
}

}  // namespace
}  // namespace terrace::focus_test
