// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "delaunay2/access.hpp"
#include "metrics.hpp"
#include "points.hpp"

namespace terrace::tri::test {
namespace {

using planar::Int128;
using planar::WindowedKernel;
using Plain2 = Delaunay2<std::int32_t>;
using Windowed2 = Delaunay2<std::int32_t, Windowed>;
using Cell = Windowed2::Point;
constexpr std::int32_t kCells = Windowed::kCells;
constexpr std::int32_t kLimit = WindowedKernel::kLimit;

template <class Triangulation>
concept HasNearest = requires(Triangulation t) {
  t.nearest({0, 0});
};
static_assert(HasNearest<Plain2> && !HasNearest<Windowed2>);

// ---- Points ------------------------------------------------------------------------------------

enum class Scene {
  scattered,   ///< in 8 x 8 windows
  dense,       ///< in 2 x 2 windows
  corners,     ///< of windows, and a few other points
  sides,       ///< on the sides of windows
  crease,      ///< on one line between windows, except at most one
  column,      ///< on one line within windows
  coarse,      ///< multiples of a third of a window: cocircular points, duplicates
  one_window,  ///< and its sides
  high,        ///< at the upper end of the range
  far,         ///< pairs of close points far apart
  extreme,     ///< at the ends of the range and anywhere in between
};
constexpr Scene kScenes[] = {Scene::scattered, Scene::dense,  Scene::corners, Scene::sides,
                             Scene::crease,    Scene::column, Scene::coarse,  Scene::one_window,
                             Scene::high,      Scene::far,    Scene::extreme};

std::string name(Scene scene) {
  constexpr const char* kNames[] = {"scattered", "dense",  "corners", "sides",
                                    "crease",    "column", "coarse",  "one window",
                                    "high",      "far",    "extreme"};
  return kNames[static_cast<std::size_t>(scene)];
}

/// Returns a function that draws from 0, ..., bound - 1.
auto below_by(std::mt19937_64& random) {
  return [&random](std::int32_t bound) {
    return static_cast<std::int32_t>(random() % static_cast<std::uint64_t>(bound));
  };
}

std::vector<Cell> make_scene(Scene scene, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto below = below_by(random);
  std::vector<Cell> points;
  for (std::size_t i = 0; i < count; ++i) {
    Cell p{};
    switch (scene) {
      case Scene::scattered:
        p = {below(8 * kCells + 1), below(8 * kCells + 1)};
        break;
      case Scene::dense:
        p = {kCells + below(2 * kCells + 1), kCells + below(2 * kCells + 1)};
        break;
      case Scene::corners:
        p = {below(5) * kCells, below(5) * kCells};
        if (i % 4 == 3) p = {p[0] + below(kCells), p[1] + below(kCells)};
        break;
      case Scene::sides:
        p = {below(5) * kCells, below(5 * kCells)};
        if (random() % 2 == 0) std::swap(p[0], p[1]);
        break;
      case Scene::crease:
        p = {3 * kCells, below(5 * kCells)};
        if (i + 1 == count && seed % 2 == 0) p[0] = below(5 * kCells);
        break;
      case Scene::column:
        p = {kCells + 5, below(5 * kCells)};
        break;
      case Scene::coarse:
        p = {below(12) * kCells / 3, below(12) * kCells / 3};
        break;
      case Scene::one_window:
        p = {kCells + below(kCells + 1), 2 * kCells + below(kCells + 1)};
        break;
      case Scene::high:
        p = {kLimit - 1 - below(3 * kCells), kLimit - 1 - below(3 * kCells)};
        break;
      case Scene::far:
        p = {below(1 << 21) * 500, below(1 << 21) * 500};
        if (i % 2 == 1)
          p = {std::max(points.back()[0] - below(99), 0),
               std::max(points.back()[1] - below(99), 0)};
        break;
      case Scene::extreme:
        for (std::int32_t& c : p) {
          c = random() % 3 == 0 ? below(kLimit) : below(2 * kCells);
          if (random() % 2 == 0) c = kLimit - 1 - c;
        }
        break;
    }
    points.push_back(p);
  }
  return points;
}

// ---- The definition ----------------------------------------------------------------------------

/// The linear interpolation of t^2 between multiples of kCells.
Int128 interpolated_square(std::int32_t t) {
  const std::int64_t low = t / kCells * kCells;
  return Int128{low} * low + Int128{2 * low + kCells} * (t - low);
}

int sign_of(Int128 value) { return (value > 0) - (value < 0); }

/// 1 if the last point is below the plane through the others, which are counter-clockwise, 0 if on
/// it, -1 if above. Expanded along the lifts, which are below 2^62; their factors are below 2^62.
int below_plane(const std::array<Cell, 4>& points, const std::array<Int128, 4>& lift) {
  const auto area = [&](std::size_t i, std::size_t j, std::size_t k) {
    return planar::IntKernel::angle(points[i], points[j], points[k]).cross;
  };
  return sign_of(lift[0] * area(3, 1, 2) + lift[1] * area(3, 2, 0) + lift[2] * area(3, 0, 1) -
                 lift[3] * area(0, 1, 2));
}

/// below_plane() for the lift by windows, or, if they are on one plane, for x^2 + y^2.
int below_lifted_plane(const std::array<Cell, 4>& points) {
  std::array<Int128, 4> by_windows, by_squares;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& [x, y] = points[i];
    by_windows[i] = interpolated_square(x) + interpolated_square(y);
    by_squares[i] = Int128{x} * x + Int128{y} * y;
  }
  const int first = below_plane(points, by_windows);
  return first != 0 ? first : below_plane(points, by_squares);
}

/// The same with the perturbation: of points on one plane the lexicographically largest is raised
/// first, then the next.
bool conflicts(const std::array<Cell, 4>& points) {
  if (const int order = below_lifted_plane(points); order != 0) return order > 0;
  std::array<std::size_t, 4> descending{0, 1, 2, 3};
  std::sort(descending.begin(), descending.end(),
            [&](std::size_t a, std::size_t b) { return points[a] > points[b]; });
  for (const std::size_t raised : descending) {
    std::array<Int128, 4> lift{};
    lift[raised] = 1;
    if (const int order = below_plane(points, lift); order != 0) return order > 0;
  }
  ADD_FAILURE() << "four points are on one line";
  return false;
}

PlanePoint to_plane(const Cell& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1])};
}

/// All triangles below whose plane there is no lifted point. O(n^4).
std::vector<Corners> lower_hull(const std::vector<Cell>& input) {
  const std::set<Cell> different(input.begin(), input.end());
  const std::vector<Cell> points(different.begin(), different.end());
  std::vector<Corners> result;
  for (const Cell& a : points) {
    for (const Cell& b : points) {
      for (const Cell& c : points) {
        if (!(a < b && a < c) || planar::IntKernel::orientation(a, b, c) <= 0) continue;
        const auto excludes = [&](const Cell& p) {
          return p == a || p == b || p == c || !conflicts({a, b, c, p});
        };
        if (!std::all_of(points.begin(), points.end(), excludes)) continue;
        result.push_back({to_plane(a), to_plane(b), to_plane(c)});
      }
    }
  }
  std::sort(result.begin(), result.end());
  return result;
}

template <class Triangulation>
Triangulation built(const std::vector<Cell>& points) {
  Triangulation result;
  result.build(points);
  EXPECT_EQ(find_fault(result), "");
  return result;
}

TEST(WindowedDelaunay2, PredicateFollowsTheDefinition) {
  std::mt19937_64 random(1);
  const auto below = below_by(random);
  int ties = 0;
  for (int round = 0; round < 200'000; ++round) {
    // Extents on both sides of the limit between 64 and 128 bits.
    const std::int32_t extent = 1 << (1 + random() % 30);
    const std::int32_t step = random() % 2 == 0 ? 1 : std::max(extent / 4, 1);
    std::array<Cell, 4> points{};
    for (std::size_t k = 0; k < 2; ++k) {
      const std::int32_t origin = below(kLimit - extent + 1);
      for (Cell& p : points) p[k] = origin + below(extent) / step * step;
    }
    auto& [a, b, c, p] = points;
    const int turn = WindowedKernel::orientation(a, b, c);
    if (turn == 0) continue;
    if (turn < 0) std::swap(a, b);
    const int expected = below_lifted_plane(points);
    ties += expected == 0 ? 1 : 0;
    ASSERT_EQ(WindowedKernel::in_circle(a, b, c, p), expected) << "round " << round;
  }
  EXPECT_GT(ties, 1000);
}

TEST(WindowedDelaunay2, IsTheLowerHull) {
  for (const Scene scene : kScenes) {
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      SCOPED_TRACE(name(scene) + " seed " + std::to_string(seed));
      const auto points = make_scene(scene, 3 + 3 * (seed % 12), seed);
      ASSERT_EQ(triangles_of(built<Windowed2>(points)), lower_hull(points));
    }
  }
}

// ---- Laws --------------------------------------------------------------------------------------

/// The vertices in each closed window that has any, by its lower corner in windows.
std::map<Cell, std::vector<Cell>> by_window(const std::vector<Cell>& points) {
  std::map<Cell, std::vector<Cell>> result;
  for (const auto& [x, y] : std::set<Cell>(points.begin(), points.end())) {
    for (std::int32_t i = std::max(x - 1, 0) / kCells; i <= x / kCells; ++i)
      for (std::int32_t j = std::max(y - 1, 0) / kCells; j <= y / kCells; ++j)
        result[{i, j}].push_back({x, y});
  }
  return result;
}

/// The triangles whose corners are all in a window, by window. Fails if there is another triangle
/// and `all_in_windows` is set.
std::map<Cell, std::vector<Corners>> triangles_by_window(const std::vector<Corners>& triangles,
                                                         bool all_in_windows) {
  std::map<Cell, std::vector<Corners>> result;
  for (const Corners& t : triangles) {
    Cell window{};
    bool in_window = true;
    for (std::size_t k = 0; k < 2; ++k) {
      const double low = std::min({t[0][k], t[1][k], t[2][k]});
      const double high = std::max({t[0][k], t[1][k], t[2][k]});
      window[k] = static_cast<std::int32_t>(low) / kCells;
      in_window = in_window && high <= (window[k] + 1.0) * kCells;
    }
    if (in_window) result[window].push_back(t);
    EXPECT_TRUE(in_window || !all_in_windows);
  }
  return result;
}

void expect_euclidean_windows(const std::vector<Cell>& points, bool all_in_windows = false) {
  const auto shown = triangles_by_window(triangles_of(built<Windowed2>(points)), all_in_windows);
  std::map<Cell, std::vector<Corners>> expected;
  for (const auto& [window, inside] : by_window(points)) {
    const auto triangles = triangles_of(built<Plain2>(inside));
    if (!triangles.empty()) expected[window] = triangles;
  }
  ASSERT_EQ(shown, expected);
}

TEST(WindowedDelaunay2, EveryWindowIsEuclidean) {
  for (const Scene scene : kScenes) {
    for (const std::size_t count : {4u, 20u, 200u, 2000u}) {
      SCOPED_TRACE(name(scene) + " " + std::to_string(count));
      ASSERT_NO_FATAL_FAILURE(expect_euclidean_windows(make_scene(scene, count, count)));
    }
  }
}

TEST(WindowedDelaunay2, NoEdgeCrossesTheSidesOfWindowsWithCorners) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    auto points = make_scene(Scene::scattered, 40 * seed, seed);
    for (std::int32_t i = 0; i <= 8; ++i)
      for (std::int32_t j = 0; j <= 8; ++j) points.push_back({i * kCells, j * kCells});
    ASSERT_NO_FATAL_FAILURE(expect_euclidean_windows(points, true));
  }
}

TEST(WindowedDelaunay2, ConsecutiveVerticesOnASideAreJoined) {
  for (const Scene scene : kScenes) {
    SCOPED_TRACE(name(scene));
    const auto points = make_scene(scene, 300, 5);
    Windowed2 triangulation;
    std::map<Cell, VertexId> vertices;
    for (const Cell& p : points) vertices[p] = triangulation.insert(p).vertex;
    std::vector<VertexId> around;
    for (const auto& [window, inside] : by_window(points)) {
      for (const std::size_t k : {0u, 1u}) {
        for (const std::int32_t side : {window[k] * kCells, (window[k] + 1) * kCells}) {
          std::vector<Cell> on_side;
          for (const Cell& p : inside)
            if (p[k] == side) on_side.push_back(p);
          for (std::size_t i = 1; i < on_side.size(); ++i) {
            triangulation.adjacent(vertices[on_side[i]], around);
            ASSERT_NE(std::find(around.begin(), around.end(), vertices[on_side[i - 1]]),
                      around.end());
          }
        }
      }
    }
  }
}

TEST(WindowedDelaunay2, RandomOperationsEqualRebuild) {
  for (const Scene scene : kScenes) {
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      SCOPED_TRACE(name(scene) + " seed " + std::to_string(seed));
      std::mt19937_64 random(seed);
      const auto points = make_scene(scene, 400, seed + 100);
      Windowed2 triangulation;
      std::vector<Windowed2::Insertion> results;
      for (int step = 0; step < 40; ++step) {
        std::vector<VertexId> alive;
        for (const VertexId v : triangulation.all_vertices()) alive.push_back(v);
        const std::size_t begin = random() % points.size();
        const std::size_t count = std::min<std::size_t>(random() % 80, points.size() - begin);
        const auto some = std::span(points).subspan(begin, count);
        switch (random() % 4) {
          case 0:
            for (const Cell& p : some) triangulation.insert(p);
            break;
          case 1:
            results.resize(count);
            triangulation.insert(some, results);
            for (std::size_t i = 0; i < count; ++i)
              ASSERT_EQ(triangulation.point(results[i].vertex), some[i]);
            break;
          case 2:
            std::shuffle(alive.begin(), alive.end(), random);
            alive.resize(random() % (alive.size() + 1));
            for (const VertexId v : alive) triangulation.remove(v);
            break;
          default:
            // Compact sets half of the time: those nearest to the left.
            std::shuffle(alive.begin(), alive.end(), random);
            if (random() % 2 == 0)
              std::sort(alive.begin(), alive.end(), [&](VertexId a, VertexId b) {
                return triangulation.point(a) < triangulation.point(b);
              });
            alive.resize(random() % (alive.size() + 1));
            triangulation.remove(std::span<const VertexId>(alive));
        }
        ASSERT_EQ(find_fault(triangulation), "") << "step " << step;
        std::vector<Cell> left;
        for (const VertexId v : triangulation.all_vertices())
          left.push_back(triangulation.point(v));
        std::shuffle(left.begin(), left.end(), random);
        ASSERT_EQ(triangulation.hash(), built<Windowed2>(left).hash()) << "step " << step;
      }
    }
  }
}

TEST(WindowedDelaunay2, LocatesLikeTheEuclideanOne) {
  for (const Scene scene : kScenes) {
    SCOPED_TRACE(name(scene));
    const auto points = make_scene(scene, 300, 6);
    const auto windowed = built<Windowed2>(points);
    const auto plain = built<Plain2>(points);
    for (const Cell& p : make_scene(scene, 300, 7)) {
      const Location ours = windowed.locate(p), other = plain.locate(p);
      ASSERT_EQ(ours.place == terrace::tri::Place::vertex,
                other.place == terrace::tri::Place::vertex);
      ASSERT_EQ(ours.place == terrace::tri::Place::outside,
                other.place == terrace::tri::Place::outside);
      if (ours.place != terrace::tri::Place::vertex) continue;
      ASSERT_EQ(windowed.point(ours.vertex), p);
    }
  }
}

// ---- Lattices ----------------------------------------------------------------------------------

TEST(WindowedDelaunay2, GridEqualsBuild) {
  struct Grid {
    Cell origin;
    std::int32_t step;
    std::uint32_t columns, rows;
  };
  for (const auto& [origin, step, columns, rows] :
       std::vector<Grid>{{{0, 0}, 1, 2 * kCells + 1, 2 * kCells + 1},
                         {{kCells - 3, 5}, 1, 7, 140},
                         {{3, 11}, 7, 60, 50},
                         {{kCells / 2, 0}, kCells / 2, 20, 20},
                         {{1, 2}, kCells - 1, 30, 20},
                         {{0, 0}, kCells, 12, 12},
                         {{1, kCells - 1}, kCells, 12, 12},
                         {{5, 0}, kCells + 5, 30, 20},
                         {{77, 99}, 1000, 20, 20},
                         {{0, 1}, (kLimit - 1) / 16, 16, 16}}) {
    SCOPED_TRACE("step " + std::to_string(step));
    Windowed2 grid;
    grid.build_grid(origin[0], origin[1], step, columns, rows);
    ASSERT_EQ(find_fault(grid), "");
    std::vector<Cell> points;
    for (std::uint32_t j = 0; j < rows; ++j) {
      for (std::uint32_t i = 0; i < columns; ++i)
        points.push_back({origin[0] + step * static_cast<std::int32_t>(i),
                          origin[1] + step * static_cast<std::int32_t>(j)});
    }
    ASSERT_EQ(grid.hash(), built<Windowed2>(points).hash());
    // The Euclidean triangulation is the same until a vertex is missing.
    ASSERT_EQ(grid.hash(), built<Plain2>(points).hash());
  }
}

TEST(WindowedDelaunay2, LatticeSetsEqualInsertionOneByOne) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    const auto below = below_by(random);
    // A blob of rows across the sides of windows, with holes.
    const Cell at{4 * kCells - below(30), 4 * kCells - below(30)};
    std::vector<Cell> points;
    for (std::int32_t y = 0; y < 30; ++y) {
      const std::int32_t begin = below(4), end = 4 + below(30);
      for (std::int32_t x = begin; x < end; ++x)
        if (seed % 3 != 0 || below(40) != 0) points.push_back({at[0] + x, at[1] + y});
    }
    std::shuffle(points.begin(), points.end(), random);
    auto base = make_scene(Scene::scattered, 100, seed);
    for (int i = 0; i < 20; ++i) base.push_back({at[0] + below(30), at[1] + below(30)});
    auto together = built<Windowed2>(base);
    std::vector<Windowed2::Insertion> inserted(points.size());
    together.insert(points, inserted);
    ASSERT_EQ(find_fault(together), "");
    auto alone = built<Windowed2>(base);
    for (const Cell& p : points) alone.insert(p);
    ASSERT_EQ(together.hash(), alone.hash());
    std::vector<VertexId> created;
    for (const auto& i : inserted)
      if (i.created) created.push_back(i.vertex);
    together.remove(created);
    ASSERT_EQ(find_fault(together), "");
    ASSERT_EQ(together.hash(), built<Windowed2>(base).hash());
  }
}

TEST(WindowedDelaunay2, FullWindowsThinOutAndFillAgain) {
  std::vector<Cell> points;
  for (std::int32_t x = 0; x <= 2 * kCells; ++x)
    for (std::int32_t y = 0; y <= kCells; ++y) points.push_back({x, y});
  auto triangulation = built<Windowed2>(points);
  const std::uint64_t full = triangulation.hash();
  std::mt19937_64 random(1);
  std::shuffle(points.begin(), points.end(), random);
  std::vector<VertexId> removed;
  for (const VertexId v : triangulation.all_vertices()) {
    const Cell p = triangulation.point(v);
    if (p[0] % kCells + p[1] % kCells != 0 && random() % 8 != 0) removed.push_back(v);
  }
  triangulation.remove(std::span<const VertexId>(removed));
  ASSERT_EQ(find_fault(triangulation), "");
  std::vector<Cell> left;
  for (const VertexId v : triangulation.all_vertices()) left.push_back(triangulation.point(v));
  ASSERT_NO_FATAL_FAILURE(expect_euclidean_windows(left, true));
  ASSERT_EQ(triangulation.hash(), built<Windowed2>(left).hash());
  triangulation.insert(points, {});
  ASSERT_EQ(triangulation.hash(), full);
}

}  // namespace
}  // namespace terrace::tri::test
