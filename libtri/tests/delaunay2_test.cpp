// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/delaunay2.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <type_traits>

#include <gtest/gtest.h>

#include "delaunay2/access.hpp"
#include "points.hpp"

namespace terrace::tri {
namespace {

template <class Coord>
class Delaunay2Test : public ::testing::Test {
 public:
  static std::uint64_t rebuilt_hash(const Delaunay2<Coord>& triangulation) {
    std::vector<std::array<Coord, 2>> points;
    for (const VertexId v : triangulation.all_vertices()) points.push_back(triangulation.point(v));
    std::mt19937_64 random(points.size());
    std::shuffle(points.begin(), points.end(), random);
    Delaunay2<Coord> other;
    other.build(points);
    return other.hash();
  }
};

using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(Delaunay2Test, Coords);

TYPED_TEST(Delaunay2Test, BuildIsValidAndCompleteForEveryKindOfPoints) {
  for (const PointSet kind : kPointSets) {
    for (const std::size_t count : {0u, 1u, 2u, 3u, 4u, 7u, 40u, 3000u}) {
      SCOPED_TRACE(name(kind) + " " + std::to_string(count));
      const auto points = make_points<TypeParam>(kind, count, 17 + count);
      Delaunay2<TypeParam> triangulation;
      const std::vector<VertexId> vertices = triangulation.build(points);
      ASSERT_EQ(find_fault(triangulation), "");
      ASSERT_EQ(vertices.size(), points.size());
      std::set<std::array<TypeParam, 2>> different(points.begin(), points.end());
      EXPECT_EQ(triangulation.vertex_count(), different.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_TRUE(triangulation.alive(vertices[i]));
        ASSERT_EQ(triangulation.point(vertices[i]), points[i]);
      }
    }
  }
}

TYPED_TEST(Delaunay2Test, OneByOneEqualsBuild) {
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    const auto points = make_points<TypeParam>(kind, 500, 3);
    Delaunay2<TypeParam> built;
    const std::vector<VertexId> vertices = built.build(points);
    Delaunay2<TypeParam> inserted;
    std::map<std::array<TypeParam, 2>, VertexId> known;
    for (const auto& point : points) {
      const auto [vertex, created] = inserted.insert(point);
      ASSERT_EQ(created, known.emplace(point, vertex).second);
      ASSERT_EQ(known[point], vertex);
    }
    ASSERT_EQ(find_fault(inserted), "");
    EXPECT_EQ(inserted.hash(), built.hash());
    EXPECT_EQ(inserted.vertex_count(), built.vertex_count());
    EXPECT_EQ(inserted.triangle_count(), built.triangle_count());
  }
}

TYPED_TEST(Delaunay2Test, RemovalDownToNothingStaysValid) {
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    Delaunay2<TypeParam> triangulation;
    triangulation.build(make_points<TypeParam>(kind, 120, 5));
    std::mt19937_64 random(1);
    while (triangulation.vertex_count() > 0) {
      std::vector<VertexId> left;
      for (const VertexId v : triangulation.all_vertices()) left.push_back(v);
      triangulation.remove(left[random() % left.size()]);
      ASSERT_EQ(find_fault(triangulation), "") << triangulation.vertex_count() << " left";
      ASSERT_EQ(triangulation.hash(), this->rebuilt_hash(triangulation));
    }
    EXPECT_EQ(triangulation.triangle_count(), 0u);
  }
}

TYPED_TEST(Delaunay2Test, RemovalOfSetsEqualsRebuild) {
  for (const PointSet kind : kPointSets) {
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
      SCOPED_TRACE(name(kind) + " seed " + std::to_string(seed));
      std::mt19937_64 random(seed);
      const auto points = make_points<TypeParam>(kind, 30 + random() % 600, seed);
      Delaunay2<TypeParam> triangulation;
      triangulation.build(points);
      std::vector<VertexId> vertices;
      for (const VertexId v : triangulation.all_vertices()) vertices.push_back(v);
      // Compact sets: the vertices nearest to a vertex, some of them sometimes left out (islands).
      const auto centre = triangulation.point(vertices[random() % vertices.size()]);
      const auto distance = [&](VertexId v) {
        const auto p = triangulation.point(v);
        const double x = static_cast<double>(p[0]) - static_cast<double>(centre[0]);
        const double y = static_cast<double>(p[1]) - static_cast<double>(centre[1]);
        return x * x + y * y;
      };
      std::stable_sort(vertices.begin(), vertices.end(),
                       [&](VertexId a, VertexId b) { return distance(a) < distance(b); });
      vertices.resize(random() % (vertices.size() + 1));
      const std::uint64_t keep_out = random() % 4;
      if (keep_out > 0)
        std::erase_if(vertices, [&](VertexId) {
          return random() % (std::uint64_t{4} << (2 * keep_out)) == 0;
        });
      triangulation.remove(std::span<const VertexId>(vertices));
      ASSERT_EQ(find_fault(triangulation), "");
      ASSERT_EQ(triangulation.hash(), this->rebuilt_hash(triangulation));
    }
  }
}

TYPED_TEST(Delaunay2Test, RandomOperationsEqualRebuild) {
  for (const PointSet kind : kPointSets) {
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      SCOPED_TRACE(name(kind) + " seed " + std::to_string(seed));
      std::mt19937_64 random(seed);
      const auto points = make_points<TypeParam>(kind, 400, seed + 100);
      Delaunay2<TypeParam> triangulation;
      std::vector<typename Delaunay2<TypeParam>::Insertion> results;
      for (int step = 0; step < 60; ++step) {
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

TYPED_TEST(Delaunay2Test, JournalReportsNetChanges) {
  using Triple = std::array<VertexId, 3>;
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    std::mt19937_64 random(9);
    const auto points = make_points<TypeParam>(kind, 300, 4);
    Delaunay2<TypeParam> triangulation;
    // A consumer's state: arrays by slot, kept up to date by changes only.
    std::map<TriangleId, Triple> triangles;
    std::map<VertexId, std::array<TypeParam, 2>> vertices;
    typename Delaunay2<TypeParam>::Changes changes;
    triangulation.start_journal();
    for (int step = 0; step < 40; ++step) {
      if (step == 0 || (triangulation.vertex_count() == 0 && step % 2 == 0)) {
        triangulation.build(std::span(points).first(200));
      } else if (step == 30) {
        triangulation.clear();
      }
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
      ASSERT_EQ(changes.removed_corners.size(), changes.removed_triangles.size());
      for (std::size_t i = 0; i < changes.removed_triangles.size(); ++i) {
        const auto found = triangles.find(changes.removed_triangles[i]);
        ASSERT_NE(found, triangles.end());
        ASSERT_EQ(found->second, changes.removed_corners[i]);
        triangles.erase(found);
      }
      for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i) {
        const auto found = vertices.find(changes.removed_vertices[i]);
        ASSERT_NE(found, vertices.end());
        ASSERT_EQ(found->second, changes.removed_points[i]);
        vertices.erase(found);
      }
      for (const VertexId v : changes.added_vertices)
        ASSERT_TRUE(vertices.emplace(v, triangulation.point(v)).second);
      for (const TriangleId t : changes.added_triangles)
        ASSERT_TRUE(triangles.emplace(t, triangulation.vertices(t)).second);

      ASSERT_EQ(vertices.size(), triangulation.vertex_count());
      ASSERT_EQ(triangles.size(), triangulation.triangle_count());
      for (const auto& [t, corners] : triangles) {
        ASSERT_TRUE(triangulation.alive(t));
        ASSERT_EQ(triangulation.vertices(t), corners);
      }
    }
  }
}

TYPED_TEST(Delaunay2Test, RestartedBehavesLikeNew) {
  Delaunay2<TypeParam> triangulation;
  std::uint64_t seed = 20;
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    const auto points = make_points<TypeParam>(kind, 150, ++seed);
    triangulation.build(points);
    Delaunay2<TypeParam> fresh;
    fresh.build(points);
    ASSERT_EQ(find_fault(triangulation), "");
    ASSERT_EQ(triangulation.hash(), fresh.hash());
    // In the middle of other changes.
    triangulation.start_journal();
    std::vector<VertexId> some;
    for (const VertexId v : triangulation.all_vertices()) {
      if (some.size() < 40) some.push_back(v);
    }
    triangulation.remove(std::span<const VertexId>(some));
    const std::size_t held = triangulation.memory_bytes();
    triangulation.restart();
    ASSERT_EQ(find_fault(triangulation), "");
    ASSERT_EQ(triangulation.vertex_count(), 0u);
    ASSERT_EQ(triangulation.triangle_count(), 0u);
    ASSERT_LE(triangulation.memory_bytes(), held);
    triangulation.insert(points.front());
    ASSERT_EQ(triangulation.vertex_count(), 1u);
    triangulation.restart();
  }
}

TYPED_TEST(Delaunay2Test, LocateAndNearestAgreeWithBruteForce) {
  using Point = typename Delaunay2<TypeParam>::Point;
  for (const PointSet kind :
       {PointSet::uniform, PointSet::few_bits, PointSet::seven_bits, PointSet::grid,
        PointSet::horizontal, PointSet::off_line, PointSet::circle, PointSet::clusters}) {
    SCOPED_TRACE(name(kind));
    const auto points = make_points<TypeParam>(kind, 100, 8);
    Delaunay2<TypeParam> triangulation;
    triangulation.build(points);
    using Kernel =
        typename std::remove_cvref_t<decltype(Delaunay2Access::mesh(triangulation))>::Kernel;
    std::vector<Point> queries = make_points<TypeParam>(kind, 300, 9);
    for (const PointSet other : {PointSet::few_bits, PointSet::grid})
      for (const Point& p : make_points<TypeParam>(other, 100, 10)) queries.push_back(p);
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
      const Location location = triangulation.locate(q, best);
      ASSERT_EQ(location.place == Place::vertex, is_vertex);
      if (is_vertex) {
        ASSERT_EQ(triangulation.point(location.vertex), q);
        continue;
      }
      bool inside_any = false;
      bool on_edge = false;
      const auto side = [&](TriangleId t, std::size_t i) {
        const auto v = triangulation.vertices(t);
        return Kernel::orientation(triangulation.point(v[(i + 1) % 3]),
                                   triangulation.point(v[(i + 2) % 3]), q);
      };
      for (const TriangleId t : triangulation.all_triangles()) {
        const int least = std::min({side(t, 0), side(t, 1), side(t, 2)});
        inside_any = inside_any || least >= 0;
        on_edge = on_edge || least == 0;
      }
      switch (location.place) {
        case Place::vertex:
          FAIL();
          break;
        case Place::inside:
          ASSERT_TRUE(inside_any && !on_edge);
          for (std::size_t i = 0; i < 3; ++i) ASSERT_GT(side(location.triangle, i), 0);
          break;
        case Place::edge:
          ASSERT_TRUE(on_edge);
          ASSERT_EQ(side(location.triangle, location.edge), 0);
          break;
        case Place::outside:
          ASSERT_FALSE(inside_any);
          if (triangulation.triangle_count() == 0) break;
          ASSERT_LT(side(location.triangle, location.edge), 0);
          ASSERT_EQ(triangulation.neighbours(location.triangle)[location.edge], kNoTriangle);
      }
    }
  }
}

TYPED_TEST(Delaunay2Test, GridEqualsBuild) {
  for (const auto& [columns, rows] : std::vector<std::array<std::uint32_t, 2>>{
           {0, 0}, {0, 3}, {1, 1}, {1, 5}, {6, 1}, {2, 2}, {2, 5}, {7, 2}, {3, 3}, {13, 9}}) {
    SCOPED_TRACE(std::to_string(columns) + " x " + std::to_string(rows));
    Delaunay2<TypeParam> grid;
    const VertexId first = grid.build_grid(3, 11, 5, columns, rows);
    ASSERT_EQ(find_fault(grid), "");
    std::vector<std::array<TypeParam, 2>> points;
    for (std::uint32_t j = 0; j < rows; ++j) {
      for (std::uint32_t i = 0; i < columns; ++i) {
        points.push_back({static_cast<TypeParam>(3 + 5 * i), static_cast<TypeParam>(11 + 5 * j)});
        ASSERT_EQ(grid.point(VertexId{slot(first) + j * columns + i}), points.back());
      }
    }
    Delaunay2<TypeParam> built;
    built.build(points);
    EXPECT_EQ(grid.hash(), built.hash());
    EXPECT_EQ(grid.triangle_count(), built.triangle_count());
    // From here on it behaves like any triangulation.
    if (columns * rows < 2) continue;
    grid.remove(first);
    grid.insert({static_cast<TypeParam>(4), static_cast<TypeParam>(12)});
    ASSERT_EQ(find_fault(grid), "");
    EXPECT_EQ(grid.hash(), this->rebuilt_hash(grid));
  }
}

TYPED_TEST(Delaunay2Test, NeighboursAreCounterClockwise) {
  const auto points = make_points<TypeParam>(PointSet::seven_bits, 200, 2);
  Delaunay2<TypeParam> triangulation;
  triangulation.build(points);
  std::vector<VertexId> around;
  std::size_t ends = 0;
  for (const VertexId v : triangulation.all_vertices()) {
    triangulation.adjacent(v, around);
    ASSERT_GE(around.size(), 2u);
    // Every two consecutive neighbours are corners of a triangle with v.
    std::size_t triangles = 0;
    for (std::size_t i = 0; i < around.size(); ++i) {
      for (const TriangleId t : triangulation.all_triangles()) {
        auto corners = triangulation.vertices(t);
        std::rotate(corners.begin(), std::find(corners.begin(), corners.end(), v), corners.end());
        if (corners[0] == v && corners[1] == around[i] &&
            corners[2] == around[(i + 1) % around.size()])
          ++triangles;
      }
    }
    ASSERT_GE(triangles + 1, around.size());
    ends += around.size() - triangles;
    ASSERT_EQ(triangulation.vertices(triangulation.triangle_at(v)).size(), 3u);
  }
  // There is one gap per hull vertex, which agrees with the number of triangles.
  EXPECT_EQ(triangulation.triangle_count() + 2 + ends, 2 * triangulation.vertex_count());
}

// Clusters of rasters: squares with complete surroundings are written directly and must equal
// insertion one by one.
TEST(Delaunay2, LatticeSetsEqualInsertionOneByOne) {
  using Point = std::array<std::int32_t, 2>;
  for (std::uint32_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto below = [&](std::int32_t n) {
      return static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(n));
    };
    // A blob of rows, with holes or in two parts, at the origin or elsewhere.
    const Point at = seed % 3 == 0 ? Point{0, 0} : Point{below(1 << 20), below(1 << 20)};
    std::set<Point> blob;
    const std::int32_t rows = 3 + below(30);
    for (std::int32_t y = 0; y < rows; ++y) {
      const std::int32_t begin = below(4), end = 4 + below(30);
      for (std::int32_t x = begin; x < end; ++x) {
        if (seed % 5 == 1 && below(40) == 0) continue;
        if (seed % 7 == 2 && (x == 12 || y == 9)) continue;
        blob.insert({at[0] + x, at[1] + y});
      }
    }
    std::vector<Point> points(blob.begin(), blob.end());
    std::shuffle(points.begin(), points.end(), random);
    // A coarse triangulation surrounds it. Some of its vertices are in the blob too.
    std::vector<Point> base{{at[0] > 100 ? at[0] - 100 : 0, at[1] > 90 ? at[1] - 90 : 0},
                            {at[0] + 200, at[1] > 50 ? at[1] - 50 : 0},
                            {at[0] + 90, at[1] + 170}};
    for (int i = 0; i < 40; ++i) base.push_back({at[0] + below(60), at[1] + below(60)});
    // The head is a vertex that is not in the set.
    const Point head = points.back();
    points.pop_back();
    if (seed % 2 == 0) base.push_back(head);
    Delaunay2<std::int32_t> together, alone;
    together.build(base);
    alone.build(base);
    together.start_journal();
    std::map<TriangleId, std::array<VertexId, 3>> triangles;
    for (const TriangleId t : together.all_triangles()) triangles[t] = together.vertices(t);
    std::vector<Delaunay2<std::int32_t>::Insertion> inserted(points.size());
    together.insert(points, inserted, together.nearest(head));
    ASSERT_EQ(find_fault(together), "");
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto one = alone.insert(points[i]);
      ASSERT_EQ(one.created, inserted[i].created) << i;
      ASSERT_EQ(together.point(inserted[i].vertex), points[i]) << i;
    }
    ASSERT_EQ(together.hash(), alone.hash());
    ASSERT_EQ(together.vertex_count(), alone.vertex_count());
    // The journal leads from one to the other.
    Delaunay2<std::int32_t>::Changes changes;
    together.take_changes(changes);
    for (const TriangleId t : changes.removed_triangles) ASSERT_EQ(triangles.erase(t), 1u);
    for (const TriangleId t : changes.added_triangles) {
      ASSERT_TRUE(triangles.emplace(t, together.vertices(t)).second);
    }
    std::size_t count = 0;
    for (const TriangleId t : together.all_triangles()) {
      ++count;
      ASSERT_EQ(triangles.at(t), together.vertices(t));
    }
    ASSERT_EQ(count, triangles.size());
    // Removal restores the previous state.
    std::vector<VertexId> created;
    for (const auto& i : inserted) {
      if (i.created) created.push_back(i.vertex);
    }
    together.remove(created);
    ASSERT_EQ(find_fault(together), "");
    Delaunay2<std::int32_t> before;
    before.build(base);
    ASSERT_EQ(together.hash(), before.hash());
  }
}

TEST(Delaunay2, RefusesBadCoordinatesAndStaysUnchanged) {
  Delaunay2<std::int32_t> integers;
  EXPECT_THROW(integers.build(std::vector<std::array<std::int32_t, 2>>{{1, 2}, {-1, 0}}),
               std::invalid_argument);
  EXPECT_THROW(integers.insert({0, 1 << 30}), std::invalid_argument);
  EXPECT_THROW(integers.build_grid(0, 0, 0, 2, 2), std::invalid_argument);
  EXPECT_THROW(integers.build_grid(0, 0, 1 << 20, 2000, 2), std::invalid_argument);
  EXPECT_EQ(integers.vertex_count(), 0u);
  Delaunay2<double> doubles;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  try {
    doubles.build(std::vector<std::array<double, 2>>{{0, 0}, {1, 0}, {0, nan}});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("point 2"), std::string::npos) << error.what();
  }
  EXPECT_THROW(doubles.insert({infinity, 0}), std::invalid_argument);
  EXPECT_THROW(doubles.build_grid(0.1, 0, 0.1, 10, 10), std::invalid_argument);
  EXPECT_EQ(doubles.vertex_count(), 0u);
}

TEST(Delaunay2, MemoryPerVertexIsBounded) {
  Delaunay2<std::int32_t> triangulation;
  const auto points = make_points<std::int32_t>(PointSet::uniform, 200'000, 1);
  triangulation.build(points);
  EXPECT_LE(triangulation.memory_bytes(), 66 * points.size());
}

}  // namespace
}  // namespace terrace::tri
