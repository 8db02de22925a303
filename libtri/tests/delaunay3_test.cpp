// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/delaunay3.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <type_traits>

#include <gtest/gtest.h>
#include <terrace/base/simd.hpp>

#include "delaunay3/access.hpp"
#include "points3.hpp"

namespace terrace::tri {
namespace {

template <class Coord>
class Delaunay3Test : public ::testing::Test {
 public:
  static std::uint64_t rebuilt_hash(const Delaunay3<Coord>& triangulation) {
    std::vector<std::array<Coord, 3>> points;
    for (const VertexId v : triangulation.all_vertices()) points.push_back(triangulation.point(v));
    std::mt19937_64 random(points.size());
    std::shuffle(points.begin(), points.end(), random);
    Delaunay3<Coord> other;
    other.build(points);
    return other.hash();
  }
};

using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(Delaunay3Test, Coords);

TYPED_TEST(Delaunay3Test, BuildIsValidAndCompleteForEveryKindOfPoints) {
  for (const PointSet3 kind : kPointSets3) {
    for (const std::size_t count : {0u, 1u, 2u, 3u, 4u, 5u, 9u, 40u, 1000u}) {
      if (kind == PointSet3::curves && count > 100) continue;
      SCOPED_TRACE(name(kind) + " " + std::to_string(count));
      const auto points = make_points3<TypeParam>(kind, count, 17 + count);
      Delaunay3<TypeParam> triangulation;
      const std::vector<VertexId> vertices = triangulation.build(points);
      ASSERT_EQ(find_fault(triangulation), "");
      ASSERT_EQ(vertices.size(), points.size());
      std::set<std::array<TypeParam, 3>> different(points.begin(), points.end());
      EXPECT_EQ(triangulation.vertex_count(), different.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_TRUE(triangulation.alive(vertices[i]));
        ASSERT_EQ(triangulation.point(vertices[i]), points[i]);
      }
    }
  }
}

TYPED_TEST(Delaunay3Test, ResultDoesNotDependOnThreads) {
  // Enough points for passes in parts, with duplicates across their border, large cavities, and
  // ties.
  for (const PointSet3 kind : {PointSet3::uniform, PointSet3::grid, PointSet3::five_bits,
                               PointSet3::slab, PointSet3::clusters}) {
    SCOPED_TRACE(name(kind));
    auto points = make_points3<TypeParam>(kind, 20'000, 6);
    Delaunay3<TypeParam> one;
    Delaunay3<TypeParam> two;
    Delaunay3<TypeParam> inserted;
    const auto vertices = one.build(points, 1);
    ASSERT_EQ(two.build(points, 2), vertices);
    ASSERT_EQ(find_fault(one), "");
    const auto& first = Delaunay3Access::mesh(one);
    const auto& second = Delaunay3Access::mesh(two);
    ASSERT_EQ(first.tetrahedron.size(), second.tetrahedron.size());
    ASSERT_EQ(first.free_tetrahedron, second.free_tetrahedron);
    for (std::uint32_t t = 0; t < first.tetrahedron.size(); ++t) {
      ASSERT_EQ(first.tetrahedron[t].corner[0], second.tetrahedron[t].corner[0]);
      if (first.tetrahedron[t].corner[0] == spatial::kFreeCorner) continue;
      ASSERT_EQ(first.tetrahedron[t].corner, second.tetrahedron[t].corner);
      ASSERT_EQ(first.tetrahedron[t].mate, second.tetrahedron[t].mate);
    }
    inserted.insert(points, {});
    ASSERT_EQ(inserted.hash(), one.hash());
    // From here on it behaves like any triangulation.
    const std::vector<VertexId> some(vertices.begin(), vertices.begin() + 300);
    std::set<VertexId> going(some.begin(), some.end());
    two.remove(std::vector<VertexId>(going.begin(), going.end()));
    ASSERT_EQ(find_fault(two), "");
  }
}

TYPED_TEST(Delaunay3Test, OneByOneEqualsBuild) {
  for (const PointSet3 kind : kPointSets3) {
    SCOPED_TRACE(name(kind));
    const auto points = make_points3<TypeParam>(kind, 200, 3);
    Delaunay3<TypeParam> built;
    built.build(points);
    Delaunay3<TypeParam> inserted;
    std::map<std::array<TypeParam, 3>, VertexId> known;
    for (const auto& point : points) {
      const auto [vertex, created] = inserted.insert(point);
      ASSERT_EQ(created, known.emplace(point, vertex).second);
      ASSERT_EQ(known[point], vertex);
    }
    ASSERT_EQ(find_fault(inserted), "");
    EXPECT_EQ(inserted.hash(), built.hash());
    EXPECT_EQ(inserted.vertex_count(), built.vertex_count());
    EXPECT_EQ(inserted.tetrahedron_count(), built.tetrahedron_count());
  }
}

TYPED_TEST(Delaunay3Test, RemovalIsTheInverseOfInsertion) {
  for (const PointSet3 kind : kPointSets3) {
    for (const bool as_set : {false, true}) {
      SCOPED_TRACE(name(kind) + (as_set ? " as a set" : " one by one"));
      std::mt19937_64 random(11);
      const auto points = make_points3<TypeParam>(kind, 150, 5);
      Delaunay3<TypeParam> triangulation;
      std::vector<VertexId> vertices = triangulation.build(points);
      std::sort(vertices.begin(), vertices.end());
      vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
      std::shuffle(vertices.begin(), vertices.end(), random);
      while (!vertices.empty()) {
        const std::size_t count = std::min(vertices.size(), 1 + random() % 20);
        const std::span<const VertexId> some(vertices.end() - static_cast<std::ptrdiff_t>(count),
                                             vertices.end());
        if (as_set) {
          triangulation.remove(some);
        } else {
          for (const VertexId v : some) triangulation.remove(v);
        }
        vertices.resize(vertices.size() - count);
        ASSERT_EQ(triangulation.vertex_count(), vertices.size());
        ASSERT_EQ(find_fault(triangulation), "");
        ASSERT_EQ(triangulation.hash(), this->rebuilt_hash(triangulation));
      }
    }
  }
}

TYPED_TEST(Delaunay3Test, RandomOperationsEqualRebuild) {
  for (const PointSet3 kind : kPointSets3) {
    for (std::uint64_t seed = 0; seed < 2; ++seed) {
      SCOPED_TRACE(name(kind) + " seed " + std::to_string(seed));
      std::mt19937_64 random(seed);
      const auto points = make_points3<TypeParam>(kind, 200, seed + 100);
      Delaunay3<TypeParam> triangulation;
      std::vector<typename Delaunay3<TypeParam>::Insertion> results;
      for (int step = 0; step < 30; ++step) {
        std::vector<VertexId> alive;
        for (const VertexId v : triangulation.all_vertices()) alive.push_back(v);
        const VertexId hint =
            alive.empty() || random() % 3 == 0 ? kNoVertex : alive[random() % alive.size()];
        const std::size_t begin = random() % points.size();
        const std::size_t count = std::min<std::size_t>(random() % 50, points.size() - begin);
        const auto some = std::span(points).subspan(begin, count);
        switch (random() % 4) {
          case 0:
            for (const auto& p : some) triangulation.insert(p, hint);
            break;
          case 1:
            results.resize(count);
            triangulation.insert(some, results, hint);
            for (std::size_t i = 0; i < count; ++i)
              ASSERT_EQ(triangulation.point(results[i].vertex), some[i]);
            break;
          case 2:
            std::shuffle(alive.begin(), alive.end(), random);
            alive.resize(random() % (alive.size() + 1));
            for (const VertexId v : alive) triangulation.remove(v);
            break;
          default:
            std::shuffle(alive.begin(), alive.end(), random);
            alive.resize(random() % (alive.size() + 1));
            triangulation.remove(std::span<const VertexId>(alive));
        }
        ASSERT_EQ(find_fault(triangulation), "") << "step " << step;
        ASSERT_EQ(triangulation.hash(), this->rebuilt_hash(triangulation)) << "step " << step;
      }
    }
  }
}

TYPED_TEST(Delaunay3Test, ReinsertingCompactSetsRestoresAll) {
  for (const PointSet3 kind : {PointSet3::uniform, PointSet3::grid, PointSet3::slab,
                               PointSet3::five_bits, PointSet3::clusters}) {
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      SCOPED_TRACE(name(kind) + " seed " + std::to_string(seed));
      std::mt19937_64 random(seed);
      const auto points = make_points3<TypeParam>(kind, 1500, 8);
      Delaunay3<TypeParam> triangulation;
      triangulation.build(points);
      const std::uint64_t before = triangulation.hash();
      // The vertices nearest to a centre, some of them left out as islands.
      const auto centre = points[random() % points.size()];
      std::vector<std::pair<double, VertexId>> by_distance;
      for (const VertexId v : triangulation.all_vertices()) {
        double square = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const double d = static_cast<double>(triangulation.point(v)[k] - centre[k]);
          square += d * d;
        }
        by_distance.emplace_back(square, v);
      }
      std::sort(by_distance.begin(), by_distance.end());
      std::vector<VertexId> set;
      std::vector<std::array<TypeParam, 3>> gone;
      for (std::size_t i = 0; i < std::size_t{100} << seed && i < by_distance.size(); ++i) {
        if (seed % 2 == 1 && random() % 3 == 0) continue;
        set.push_back(by_distance[i].second);
        gone.push_back(triangulation.point(set.back()));
      }
      triangulation.remove(std::span<const VertexId>(set));
      ASSERT_EQ(find_fault(triangulation), "");
      ASSERT_EQ(triangulation.hash(), this->rebuilt_hash(triangulation));
      triangulation.insert(gone, {});
      ASSERT_EQ(find_fault(triangulation), "");
      ASSERT_EQ(triangulation.hash(), before);
    }
  }
}

TYPED_TEST(Delaunay3Test, FillsCavitiesAndHolesOfAnySize) {
  // Points near a sphere, whose centre is joined to all of them, with 2 n - 4 facets around it. The
  // sizes are below and above those that are handled separately.
  for (const std::size_t count : {5u, 40u, 61u, 62u, 63u, 64u, 65u, 66u, 130u, 200u, 3000u}) {
    SCOPED_TRACE(count);
    std::mt19937_64 random(count);
    std::vector<std::array<TypeParam, 3>> points;
    while (points.size() < count) {
      std::array<double, 3> p;
      double square = 0;
      for (double& c : p) {
        c = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
        square += c * c;
      }
      if (square > 1 || square < 0.01) continue;
      std::array<TypeParam, 3>& q = points.emplace_back();
      for (std::size_t k = 0; k < 3; ++k)
        q[k] = static_cast<TypeParam>(1e6 + 1e6 * p[k] / std::sqrt(square));
    }
    Delaunay3<TypeParam> triangulation;
    triangulation.build(points);
    const std::uint64_t before = triangulation.hash();
    const VertexId centre = triangulation.insert({1'000'000, 1'000'000, 1'000'000}).vertex;
    ASSERT_EQ(find_fault(triangulation), "");
    ASSERT_EQ(triangulation.hash(), this->rebuilt_hash(triangulation));
    std::vector<VertexId> around;
    triangulation.adjacent(centre, around);
    ASSERT_GE(around.size(), count > 60 ? count / 2 : 4);
    triangulation.remove(centre);
    ASSERT_EQ(find_fault(triangulation), "");
    ASSERT_EQ(triangulation.hash(), before);
  }
}

TYPED_TEST(Delaunay3Test, AllInstructionSetsGiveTheSameTetrahedra) {
  for (const PointSet3 kind : kPointSets3) {
    if (kind == PointSet3::curves) continue;
    SCOPED_TRACE(name(kind));
    const auto points = make_points3<TypeParam>(kind, 200, 12);
    std::vector<Delaunay3<TypeParam>> triangulations;
    for (const auto set :
         {base::SimdPath::portable, base::SimdPath::avx2, base::SimdPath::avx512}) {
      if (!base::supports(set)) continue;
      auto& triangulation = triangulations.emplace_back();
      triangulation.build(points);
      Delaunay3Access::mesh(triangulation).hole.scan = spatial::scan_function(set);
      std::mt19937_64 random(1);
      std::vector<VertexId> going;
      for (const VertexId v : triangulation.all_vertices())
        if (random() % 2 == 0) going.push_back(v);
      triangulation.remove(std::span<const VertexId>(going));
      ASSERT_EQ(find_fault(triangulation), "");
      // The slots are the same too.
      const auto& first = Delaunay3Access::mesh(triangulations.front());
      const auto& mesh = Delaunay3Access::mesh(triangulation);
      ASSERT_EQ(mesh.tetrahedron.size(), first.tetrahedron.size());
      for (std::uint32_t t = 0; t < mesh.tetrahedron.size(); ++t) {
        ASSERT_EQ(mesh.tetrahedron[t].corner[0], first.tetrahedron[t].corner[0]);
        if (mesh.tetrahedron[t].corner[0] == spatial::kFreeCorner) continue;
        ASSERT_EQ(mesh.tetrahedron[t].corner, first.tetrahedron[t].corner);
        ASSERT_EQ(mesh.tetrahedron[t].mate, first.tetrahedron[t].mate);
      }
    }
  }
}

TYPED_TEST(Delaunay3Test, JournalReportsNetChanges) {
  using Corners = std::array<VertexId, 4>;
  for (const PointSet3 kind : kPointSets3) {
    SCOPED_TRACE(name(kind));
    std::mt19937_64 random(9);
    // On the curves there are as many tetrahedra as pairs of points.
    const auto points = make_points3<TypeParam>(kind, kind == PointSet3::curves ? 40 : 150, 4);
    Delaunay3<TypeParam> triangulation;
    // A consumer's state: arrays by slot, kept up to date by changes only.
    std::map<TetrahedronId, Corners> tetrahedra;
    std::map<VertexId, std::array<TypeParam, 3>> vertices;
    typename Delaunay3<TypeParam>::Changes changes;
    triangulation.start_journal();
    for (int step = 0; step < 30; ++step) {
      if (step == 20) triangulation.clear();
      if (triangulation.vertex_count() == 0 && step % 2 == 0)
        triangulation.build(std::span(points).first(points.size() * 2 / 3));
      for (int k = 0; k < 3; ++k) {
        std::vector<VertexId> alive;
        for (const VertexId v : triangulation.all_vertices()) alive.push_back(v);
        std::shuffle(alive.begin(), alive.end(), random);
        alive.resize(std::min<std::size_t>(alive.size(), random() % 40));
        triangulation.remove(std::span<const VertexId>(alive));
        for (std::size_t i = random() % 40; i > 0; --i)
          triangulation.insert(points[random() % points.size()]);
      }
      triangulation.take_changes(changes);
      ASSERT_EQ(changes.removed_points.size(), changes.removed_vertices.size());
      ASSERT_EQ(changes.removed_corners.size(), changes.removed_tetrahedra.size());
      for (std::size_t i = 0; i < changes.removed_tetrahedra.size(); ++i) {
        const auto found = tetrahedra.find(changes.removed_tetrahedra[i]);
        ASSERT_NE(found, tetrahedra.end());
        ASSERT_EQ(found->second, changes.removed_corners[i]);
        tetrahedra.erase(found);
      }
      for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i) {
        const auto found = vertices.find(changes.removed_vertices[i]);
        ASSERT_NE(found, vertices.end());
        ASSERT_EQ(found->second, changes.removed_points[i]);
        vertices.erase(found);
      }
      for (const VertexId v : changes.added_vertices)
        ASSERT_TRUE(vertices.emplace(v, triangulation.point(v)).second);
      for (const TetrahedronId t : changes.added_tetrahedra)
        ASSERT_TRUE(tetrahedra.emplace(t, triangulation.vertices(t)).second);

      ASSERT_EQ(vertices.size(), triangulation.vertex_count());
      ASSERT_EQ(tetrahedra.size(), triangulation.tetrahedron_count());
      for (const auto& [t, corners] : tetrahedra) {
        ASSERT_TRUE(triangulation.alive(t));
        ASSERT_EQ(triangulation.vertices(t), corners);
      }
    }
  }
}

TYPED_TEST(Delaunay3Test, LocateAndNearestAgreeWithBruteForce) {
  using Point = typename Delaunay3<TypeParam>::Point;
  for (const PointSet3 kind : {PointSet3::uniform, PointSet3::few_bits, PointSet3::five_bits,
                               PointSet3::grid, PointSet3::slab, PointSet3::line, PointSet3::plane,
                               PointSet3::off_plane, PointSet3::sphere, PointSet3::clusters}) {
    SCOPED_TRACE(name(kind));
    const auto points = make_points3<TypeParam>(kind, 80, 8);
    Delaunay3<TypeParam> triangulation;
    triangulation.build(points);
    using Kernel =
        typename std::remove_cvref_t<decltype(Delaunay3Access::mesh(triangulation))>::Kernel;
    std::vector<Point> queries = make_points3<TypeParam>(kind, 150, 9);
    for (const PointSet3 other : {PointSet3::few_bits, PointSet3::grid})
      for (const Point& p : make_points3<TypeParam>(other, 60, 10)) queries.push_back(p);
    for (const Point& q : queries) {
      bool is_vertex = false;
      VertexId best = kNoVertex;
      for (const VertexId v : triangulation.all_vertices()) {
        const Point p = triangulation.point(v);
        is_vertex = is_vertex || p == q;
        if (best == kNoVertex) best = v;
        const int order = Kernel::compare_distance(q, p, triangulation.point(best));
        if (order < 0 || (order == 0 && p < triangulation.point(best))) best = v;
      }
      ASSERT_EQ(triangulation.nearest(q), best);
      const Location3 location = triangulation.locate(q, best);
      ASSERT_EQ(location.place == Place3::vertex, is_vertex);
      ASSERT_TRUE(triangulation.alive(location.vertex));
      if (is_vertex) {
        ASSERT_EQ(triangulation.point(location.vertex), q);
        continue;
      }
      const auto side = [&](TetrahedronId t, std::size_t i) {
        auto v = triangulation.vertices(t);
        std::array<Point, 4> p;
        for (std::size_t k = 0; k < 4; ++k) p[k] = triangulation.point(v[k]);
        p[i] = q;
        return Kernel::orientation(p[0], p[1], p[2], p[3]);
      };
      bool inside_any = false;
      int zeros_of_best = 0;
      for (const TetrahedronId t : triangulation.all_tetrahedra()) {
        const std::array<int, 4> sides = {side(t, 0), side(t, 1), side(t, 2), side(t, 3)};
        if (*std::min_element(sides.begin(), sides.end()) < 0) continue;
        inside_any = true;
        zeros_of_best = static_cast<int>(std::count(sides.begin(), sides.end(), 0));
      }
      if (location.place == Place3::outside) {
        ASSERT_FALSE(inside_any);
        if (triangulation.tetrahedron_count() == 0) continue;
        ASSERT_LT(side(location.tetrahedron, location.corner[0]), 0);
        ASSERT_EQ(triangulation.neighbours(location.tetrahedron)[location.corner[0]],
                  kNoTetrahedron);
        continue;
      }
      ASSERT_TRUE(inside_any);
      ASSERT_EQ(zeros_of_best, location.place == Place3::inside  ? 0
                               : location.place == Place3::facet ? 1
                                                                 : 2);
      for (std::size_t i = 0; i < 4; ++i) {
        const bool on = (zeros_of_best > 0 && i == location.corner[0]) ||
                        (zeros_of_best > 1 && i == location.corner[1]);
        ASSERT_EQ(side(location.tetrahedron, i), on ? 0 : 1);
      }
    }
  }
}

TYPED_TEST(Delaunay3Test, NeighboursAgreeWithTetrahedra) {
  const auto points = make_points3<TypeParam>(PointSet3::five_bits, 200, 2);
  Delaunay3<TypeParam> triangulation;
  triangulation.build(points);
  std::map<VertexId, std::set<VertexId>> joined;
  std::map<VertexId, std::vector<TetrahedronId>> at;
  for (const TetrahedronId t : triangulation.all_tetrahedra()) {
    const auto corners = triangulation.vertices(t);
    for (std::size_t i = 0; i < 4; ++i) {
      at[corners[i]].push_back(t);
      for (const VertexId v : corners)
        if (v != corners[i]) joined[corners[i]].insert(v);
      const TetrahedronId other = triangulation.neighbours(t)[i];
      if (other == kNoTetrahedron) continue;
      const auto mate_corners = triangulation.vertices(other);
      for (std::size_t k = 0; k < 4; ++k)
        ASSERT_EQ(std::count(mate_corners.begin(), mate_corners.end(), corners[k]), k == i ? 0 : 1);
    }
  }
  std::vector<VertexId> around;
  std::vector<TetrahedronId> tetrahedra;
  for (const VertexId v : triangulation.all_vertices()) {
    triangulation.adjacent(v, around);
    ASSERT_TRUE(std::ranges::equal(around, joined[v]));
    triangulation.tetrahedra_at(v, tetrahedra);
    ASSERT_EQ(tetrahedra, at[v]);
    ASSERT_TRUE(std::ranges::count(tetrahedra, triangulation.tetrahedron_at(v)) == 1);
  }
}

TEST(Delaunay3, RefusesBadCoordinatesAndStaysUnchanged) {
  Delaunay3<std::int32_t> integers;
  EXPECT_THROW(integers.build(std::vector<std::array<std::int32_t, 3>>{{1, 2, 3}, {0, 0, -1}}),
               std::invalid_argument);
  EXPECT_THROW(integers.insert({0, 1 << 30, 0}), std::invalid_argument);
  EXPECT_EQ(integers.vertex_count(), 0u);
  Delaunay3<double> doubles;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  try {
    doubles.build(std::vector<std::array<double, 3>>{{0, 0, 0}, {1, 0, 0}, {0, 0, nan}});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("point 2"), std::string::npos) << error.what();
  }
  EXPECT_THROW(doubles.insert({infinity, 0, 0}), std::invalid_argument);
  EXPECT_EQ(doubles.vertex_count(), 0u);
}

TEST(Delaunay3, MemoryPerVertexIsBounded) {
  Delaunay3<std::int32_t> triangulation;
  const auto points = make_points3<std::int32_t>(PointSet3::uniform, 50'000, 1);
  triangulation.build(points);
  EXPECT_LE(triangulation.memory_bytes(), 262 * points.size());
}

}  // namespace
}  // namespace terrace::tri
