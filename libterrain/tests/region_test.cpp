// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/region.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <stop_token>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/portable_math.hpp>
#include <terrace/base/random.hpp>
#include <terrace/tri/predicates.hpp>

#include "temporary_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// A file that is removed with the object.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text) { std::ofstream(path_) << text; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  tests::TemporaryFolder scratch_;
  std::string path_ = scratch_.path() / "region.geojson";
};

Region region_of(const std::string& geojson) {
  return Region::parse(TemporaryFile(geojson).path());
}

TEST(Region, BoxesAreClosedAndMayBeNegative) {
  const Region flat = Region::parse("-10,-5.5,-2,1e2");
  EXPECT_TRUE(flat.contains({-10, 100, 1e9}));
  EXPECT_TRUE(flat.contains({-2, -5.5, -1e9}));
  EXPECT_FALSE(flat.contains({std::nextafter(-2.0, 0.0), 0, 0}));
  const Region solid = Region::parse("0,0,-1,10,10,1");
  EXPECT_TRUE(solid.contains({0, 10, 1}));
  EXPECT_FALSE(solid.contains({5, 5, 1.1}));
}

TEST(Region, RejectsInvalidBoxes) {
  for (const char* text : {"1,2,3", "1,2,3,4,5", "5,0,1,1", "0,0,0,1,1,-1", "1,2,,4"}) {
    EXPECT_THROW(Region::parse(text), UsageError) << text;
  }
  EXPECT_THROW(Region::parse("no-such-file.geojson"), stream::Error);
}

TEST(Region, ReadsAllKindsOfGeoJson) {
  const std::string square = "[[[0,0],[4,0],[4,4],[0,4],[0,0]],[[1,1],[3,1],[3,3],[1,3],[1,1]]]";
  const std::string polygon = R"({"type":"Polygon","coordinates":)" + square + "}";
  const std::string feature = R"({"type":"Feature","properties":{},"geometry":)" + polygon + "}";
  for (const std::string& json :
       {polygon, feature, R"({"type":"FeatureCollection","features":[)" + feature + "]}",
        R"({"type":"MultiPolygon","coordinates":[)" + square + "]}",
        R"({"type":"GeometryCollection","geometries":[)" + polygon + "]}"}) {
    SCOPED_TRACE(json);
    const Region region = region_of(json);
    EXPECT_EQ(region.box().min[0], 0);
    EXPECT_EQ(region.box().max[1], 4);
    EXPECT_TRUE(region.contains({0.5, 2, 77}));
    EXPECT_FALSE(region.contains({2, 2, 0}));  // in the hole
    EXPECT_TRUE(region.contains({1, 2, 0}));   // on the hole's border
    EXPECT_TRUE(region.contains({4, 4, 0}));   // a corner
    EXPECT_FALSE(region.contains({4.1, 2, 0}));
  }
}

TEST(Region, SkipsFeaturesWithoutGeometry) {
  const std::string empty = R"({"type":"Feature","properties":{},"geometry":null})";
  const std::string square =
      R"({"type":"Feature","properties":null,"geometry":)"
      R"({"type":"Polygon","coordinates":[[[0,0],[4,0],[4,4],[0,4],[0,0]]]}})";
  const Region region = region_of(R"({"type":"FeatureCollection","features":[)" + empty + "," +
                                  square + "," + empty + "]}");
  EXPECT_EQ(region.polygons().size(), 1u);
  EXPECT_TRUE(region.contains({2, 2, 0}));
  EXPECT_THROW(region_of(empty), stream::Error);
}

TEST(Region, RestrictsSource) {
  stream::Selection selection;
  region_of(R"({"type":"Polygon","coordinates":[[[0,0],[4,0],[0,4]],[[1,1],[2,1],[1,2]]]})")
      .restrict(selection);
  ASSERT_TRUE(selection.region && selection.covers);
  EXPECT_EQ(selection.region->min[0], 0);
  EXPECT_EQ(selection.region->max[1], 4);
  EXPECT_TRUE(selection.region->contains({1, 1, 1e300}));
  EXPECT_TRUE(selection.covers({2, 2}));       // on the ring
  EXPECT_FALSE(selection.covers({1.2, 1.2}));  // in the hole
  EXPECT_FALSE(selection.covers({3, 3}));
  Region::parse("1,2,3,4").restrict(selection);
  EXPECT_EQ(selection.region->max[0], 3);
  EXPECT_FALSE(selection.covers);
}

TEST(Region, RejectsHostileGeoJson) {
  std::string deep;
  for (int i = 0; i < 100; ++i) deep += R"({"type":"Feature","geometry":)";
  for (const std::string& json :
       {std::string(), std::string("[]"), std::string("{"), std::string(R"({"type":7})"),
        std::string(R"({"type":"Polygon"})"),
        std::string(R"({"type":"Point","coordinates":[1,2]})"),
        std::string(R"({"type":"Polygon","coordinates":[[[0,0],[1,1]]]})"),
        std::string(R"({"type":"Polygon","coordinates":[[[0,0],[1,"a"],[1,1]]]})"),
        std::string(R"({"type":"Polygon","coordinates":[[[0,0],[1e999,0],[1,1]]]})"),
        std::string(R"({"type":"FeatureCollection","features":[]})"),
        std::string(R"({"type":"FeatureCollection","features":3})"), deep}) {
    EXPECT_THROW(region_of(json), stream::Error) << json;
  }
}

// The typedef form, because GCC's __extension__ silences -Wpedantic only before such a declaration.
__extension__ typedef __int128 Wide;

// Law: the orientation of nearly collinear points equals that of their exact integers.
TEST(Orientation, IsExactForNearlyCollinearPoints) {
  std::mt19937_64 random(7);
  for (int trial = 0; trial < 20000; ++trial) {
    const auto coordinate = [&] {
      return static_cast<std::int64_t>(random() >> 12) - (std::int64_t{1} << 51);
    };
    const std::int64_t ax = coordinate(), ay = coordinate();
    const std::int64_t dx = static_cast<std::int64_t>(random() % 100000), dy = 99991;
    const std::int64_t bx = ax + 3 * dx, by = ay + 3 * dy;
    const std::int64_t cx = ax + 7 * dx + static_cast<std::int64_t>(random() % 3) - 1,
                       cy = ay + 7 * dy;
    const Wide exact = Wide{bx - ax} * (cy - ay) - Wide{by - ay} * (cx - ax);
    const auto d = [](std::int64_t v) { return static_cast<double>(v); };
    EXPECT_EQ(tri::orientation({d(ax), d(ay)}, {d(bx), d(by)}, {d(cx), d(cy)}), exact > 0   ? 1
                                                                                : exact < 0 ? -1
                                                                                            : 0);
  }
}

// Polygons compared with their definition in integer arithmetic.

/// A point on a lattice, with integer coordinates.
struct LatticePoint {
  std::int64_t x = 0, y = 0;
  friend bool operator==(const LatticePoint&, const LatticePoint&) = default;
};
using Ring = std::vector<LatticePoint>;

int side(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  const std::int64_t twice = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  return twice > 0 ? 1 : twice < 0 ? -1 : 0;
}

bool on_segment(const LatticePoint& p, const LatticePoint& a, const LatticePoint& b) {
  return side(a, b, p) == 0 && std::min(a.x, b.x) <= p.x && p.x <= std::max(a.x, b.x) &&
         std::min(a.y, b.y) <= p.y && p.y <= std::max(a.y, b.y);
}

bool segments_intersect(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                        const LatticePoint& d) {
  if (side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0) return true;
  return on_segment(c, a, b) || on_segment(d, a, b) || on_segment(a, c, d) || on_segment(b, c, d);
}

const LatticePoint& next(const Ring& ring, std::size_t i) { return ring[(i + 1) % ring.size()]; }

/// Whether the ring is simple, ignoring repeated consecutive corners.
bool is_simple(const Ring& corners) {
  Ring ring;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (!(corners[i] == next(corners, i))) ring.push_back(corners[i]);
  }
  if (ring.size() < 3) return false;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    if (on_segment(next(ring, i + 1), ring[i], next(ring, i)) ||
        on_segment(ring[i], next(ring, i), next(ring, i + 1))) {
      return false;
    }
    for (std::size_t k = i + 2; k < ring.size(); ++k) {
      if ((k + 1) % ring.size() == i) continue;
      if (segments_intersect(ring[i], next(ring, i), ring[k], next(ring, k))) return false;
    }
  }
  return true;
}

bool on_ring(const std::vector<Ring>& rings, const LatticePoint& p) {
  for (const Ring& ring : rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      if (on_segment(p, ring[i], next(ring, i))) return true;
    }
  }
  return false;
}

/// Whether p is on a ring, or inside by the even-odd rule.
bool contains(const std::vector<Ring>& rings, const LatticePoint& p) {
  bool inside = on_ring(rings, p);
  if (inside) return true;
  for (const Ring& ring : rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const LatticePoint &a = ring[i], &b = next(ring, i);
      if ((a.y <= p.y) != (b.y <= p.y) && (side(a, b, p) > 0) == (a.y <= p.y)) inside = !inside;
    }
  }
  return inside;
}

/// Returns how a convex figure, given by its corners, overlaps the polygon.
Overlap overlap_of(const std::vector<Ring>& rings, const Ring& figure) {
  bool intersects = contains(rings, figure[0]), crosses_border = false;
  for (const Ring& ring : rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      for (std::size_t k = 0; k < figure.size(); ++k) {
        crosses_border = crosses_border ||
                         segments_intersect(ring[i], next(ring, i), figure[k], next(figure, k));
      }
    }
    bool within = true;  // the ring is in the figure or, by the above, entirely outside
    for (std::size_t k = 0; k < figure.size(); ++k) {
      within = within && side(figure[k], next(figure, k), ring[0]) > 0;
    }
    crosses_border = crosses_border || within;
  }
  intersects = intersects || crosses_border;
  return !intersects ? Overlap::none : crosses_border ? Overlap::part : Overlap::whole;
}

/// Maps lattice points to doubles.
struct LatticeFrame {
  double origin, step;
  [[nodiscard]] Point2 operator()(const LatticePoint& p) const {
    return {origin + step * static_cast<double>(p.x), origin + step * static_cast<double>(p.y)};
  }
  [[nodiscard]] stream::Point3 at(const LatticePoint& p) const {
    return {(*this)(p)[0], (*this)(p)[1], 0};
  }
};
/// Steps of one half, coordinates of a projected CRS, steps as small as doubles allow at their
/// origin, and tiny steps.
constexpr LatticeFrame kFrames[] = {{0, 0.5}, {-7340032.25, 0.0625}, {0x1p52, 1}, {0, 0x1p-60}};
constexpr int kTestShare = TERRACE_TEST_SHARE;
constexpr double kAnyHeight = std::numeric_limits<double>::infinity();

class RandomLattice {
 public:
  explicit RandomLattice(std::uint64_t seed) : random_(seed) {}
  std::int64_t below(std::int64_t end) {
    return static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(end));
  }
  /// Few distinct points, so that they often coincide.
  LatticePoint point() { return {2 * below(10), 2 * below(10)}; }
  Ring ring(std::int64_t max_corners) {
    Ring ring(static_cast<std::size_t>(3 + below(max_corners - 2)));
    for (LatticePoint& p : ring) p = point();
    return ring;
  }

 private:
  std::mt19937_64 random_;
};

Polygon polygon_of(const std::vector<Ring>& rings, const LatticeFrame& frame) {
  Polygon polygon;
  for (const Ring& ring : rings) {
    polygon.emplace_back();
    for (const LatticePoint& p : ring) polygon.back().push_back(frame(p));
  }
  return polygon;
}

void expect_all_points(const Region& region, const std::vector<std::vector<Ring>>& polygons,
                       const LatticeFrame& frame) {
  for (std::int64_t y = -1; y < 21; ++y) {
    for (std::int64_t x = -1; x < 21; ++x) {
      const LatticePoint p{x, y};
      const bool expected = std::any_of(polygons.begin(), polygons.end(),
                                        [&](const auto& rings) { return contains(rings, p); });
      ASSERT_EQ(region.contains(frame.at(p)), expected) << x << ',' << y;
      ASSERT_EQ(region.covers(frame(p)), expected) << x << ',' << y;
    }
  }
}

void expect_boxes_and_triangles(const Region& region, const std::vector<Ring>& rings,
                                const LatticeFrame& frame, RandomLattice& random,
                                std::array<int, 3>& seen) {
  for (int i = 0; i < 20; ++i) {
    const LatticePoint a{random.below(22) - 1, random.below(22) - 1};
    const LatticePoint b{a.x + 1 + random.below(6), a.y + 1 + random.below(6)};
    const Point2 low = frame(a), high = frame(b);
    const Overlap box = overlap_of(rings, {a, {b.x, a.y}, b, {a.x, b.y}});
    ASSERT_EQ(region.overlap({{low[0], low[1], 0}, {high[0], high[1], 1}}), box);
    ++seen[static_cast<std::size_t>(box)];
    // An empty box: on a ring it is partly inside, elsewhere wholly inside or outside.
    const Overlap point = !contains(rings, a) ? Overlap::none
                          : on_ring(rings, a) ? Overlap::part
                                              : Overlap::whole;
    ASSERT_EQ(region.overlap({{low[0], low[1], 0}, {low[0], low[1], 0}}), point);
    const LatticePoint c{random.below(22) - 1, random.below(22) - 1};
    const int turn = side(a, b, c);
    if (turn == 0) continue;
    const Overlap triangle = overlap_of(rings, turn > 0 ? Ring{a, b, c} : Ring{a, c, b});
    ASSERT_EQ(region.touches({frame.at(a), frame.at(b), frame.at(c)}), triangle != Overlap::none);
  }
}

// Law: a ring is accepted if it is simple; then all answers equal those in integer arithmetic.
TEST(Region, SingleRingMatchesIntegerArithmetic) {
  int accepted = 0, rejected = 0;
  std::array<int, 3> seen{};
  for (std::uint64_t seed = 1; seed <= 600 / kTestShare; ++seed) {
    SCOPED_TRACE(seed);
    RandomLattice random(seed);
    const LatticeFrame& frame = kFrames[seed % std::size(kFrames)];
    const std::vector<Ring> rings{random.ring(7)};
    if (!is_simple(rings[0])) {
      ++rejected;
      EXPECT_THROW(Region::of_polygons({polygon_of(rings, frame)}, -kAnyHeight, kAnyHeight),
                   stream::Error);
      continue;
    }
    ++accepted;
    const Region region = Region::of_polygons({polygon_of(rings, frame)}, -kAnyHeight, kAnyHeight);
    expect_all_points(region, {rings}, frame);
    expect_boxes_and_triangles(region, rings, frame, random, seen);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(accepted, 100 / kTestShare);
  EXPECT_GT(rejected, 100 / kTestShare);
  for (const int count : seen) EXPECT_GT(count, 30 / kTestShare);
}

// Law: polygons with holes, and several that overlap, match integer arithmetic. GEOS decides which
// are valid.
TEST(Region, HolesAndOverlapsMatchIntegerArithmetic) {
  int holes = 0, pairs = 0;
  std::array<int, 3> seen{};
  for (std::uint64_t seed = 1; seed <= 500 / kTestShare; ++seed) {
    SCOPED_TRACE(seed);
    RandomLattice random(seed);
    const LatticeFrame& frame = kFrames[seed % std::size(kFrames)];
    const std::int64_t x = 2 * random.below(4), y = 2 * random.below(4);
    const std::vector<Ring> large{{{0, 0}, {18, 2}, {18, 18}, {2, 16}}, random.ring(4)};
    const std::vector<Ring> other{{{x, y}, {x + 4, y}, {x + 6, y + 8}, {x, y + 6}}};
    try {
      const Region region =
          Region::of_polygons({polygon_of(large, frame)}, -kAnyHeight, kAnyHeight);
      ++holes;
      expect_all_points(region, {large}, frame);
      expect_boxes_and_triangles(region, large, frame, random, seen);
      const Region both = Region::of_polygons({polygon_of(large, frame), polygon_of(other, frame)},
                                              -kAnyHeight, kAnyHeight);
      ++pairs;
      expect_all_points(both, {large, other}, frame);
    } catch (const stream::Error& error) {
      EXPECT_FALSE(error.parts().where.empty());
    }
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(holes, 30 / kTestShare);
  EXPECT_EQ(holes, pairs);
  for (const int count : seen) EXPECT_GT(count, 30 / kTestShare);
}

/// Returns a closed outline around `middle`, with corners at random distances.
std::vector<Point2> jagged_ring(std::size_t corners, const Point2& middle, double radius) {
  std::mt19937_64 random(corners);
  std::vector<Point2> ring;
  for (std::size_t i = 0; i < corners; ++i) {
    const double angle = 360.0 * static_cast<double>(i) / static_cast<double>(corners);
    const double r = radius * (0.8 + 0.2 * base::unit_interval(random()));
    ring.push_back(
        {middle[0] + r * base::cos_degrees(angle), middle[1] + r * base::sin_degrees(angle)});
  }
  return ring;
}

bool even_odd(const std::vector<Point2>& ring, const Point2& p) {
  bool inside = false;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Point2 &a = ring[i], &b = ring[(i + 1) % ring.size()];
    const auto between = [&](std::size_t k) {
      return std::min(a[k], b[k]) <= p[k] && p[k] <= std::max(a[k], b[k]);
    };
    if (between(0) && between(1) && tri::orientation(a, b, p) == 0) return true;
    if ((a[1] <= p[1]) == (b[1] <= p[1])) continue;
    if ((tri::orientation(a, b, p) > 0) == (a[1] <= p[1])) inside = !inside;
  }
  return inside;
}

// With this many corners the grid gives most answers. Oracle: exact even-odd rule.
// More threads query one object at once than it prepares for.
TEST(Region, LargeRegionIsThreadSafe) {
  constexpr std::size_t kThreads = 8, kQueries = 3000;
  const std::vector<Point2> ring = jagged_ring(5000, {4e6, 7e6}, 1e5);
  const Region region = Region::of_polygons({{ring}}, -kAnyHeight, kAnyHeight);
  std::array<std::size_t, kThreads> wrong{}, inside{};
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      std::mt19937_64 random(t);
      const auto near = [&] { return 2.2e5 * (base::unit_interval(random()) - 0.5); };
      for (std::size_t i = 0; i < kQueries; ++i) {
        // Every other one is the rounded middle of two corners, as near to a ring as possible.
        const Point2 &a = ring[random() % ring.size()], &b = ring[random() % ring.size()];
        const Point2 p = i % 2 == 0 ? Point2{4e6 + near(), 7e6 + near()}
                                    : Point2{(a[0] + b[0]) / 2, (a[1] + b[1]) / 2};
        const bool expected = even_odd(ring, p);
        inside[t] += expected ? 1 : 0;
        const stream::Box3 box{{p[0] - 20, p[1] - 20, 0}, {p[0] + 20, p[1] + 20, 0}};
        const Overlap overlap = region.overlap(box);
        const bool touches = region.touches(
            {stream::Point3{p[0], p[1], 0}, {p[0] + 10, p[1], 0}, {p[0], p[1] + 10, 0}});
        wrong[t] += region.covers(p) != expected || (expected && overlap == Overlap::none) ||
                            (!expected && overlap == Overlap::whole) || (expected && !touches) ||
                            (touches && overlap == Overlap::none)
                        ? 1
                        : 0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t t = 0; t < kThreads; ++t) {
    EXPECT_EQ(wrong[t], 0U) << t;
    EXPECT_GT(inside[t], kQueries / 5);
    EXPECT_LT(inside[t], kQueries);
  }
}

TEST(Region, OverlapsInHeight) {
  const Region region = Region::of_polygons({{{{0, 0}, {10, 0}, {10, 10}, {0, 10}}}}, 5, 8);
  EXPECT_EQ(region.overlap({{2, 2, 6}, {3, 3, 7}}), Overlap::whole);
  EXPECT_EQ(region.overlap({{2, 2, 4}, {3, 3, 7}}), Overlap::part);
  EXPECT_EQ(region.overlap({{2, 2, 9}, {3, 3, 11}}), Overlap::none);
  EXPECT_EQ(region.overlap({}), Overlap::none);
  EXPECT_FALSE(region.contains({2, 2, 4}));
  EXPECT_TRUE(region.covers({2, 2}));
  EXPECT_FALSE(region.touches({stream::Point3{2, 2, 1}, {3, 2, 2}, {2, 3, 4}}));
  const Region box = Region::of_box({{0, 0, 5}, {10, 10, 8}});
  EXPECT_EQ(box.overlap({{0, 2, 6}, {3, 3, 7}}), Overlap::whole);
  EXPECT_EQ(box.overlap({{-1, 2, 6}, {3, 3, 7}}), Overlap::part);
  EXPECT_EQ(box.overlap({{11, 2, 6}, {13, 3, 7}}), Overlap::none);
  EXPECT_TRUE(box.covers({2, 2}));
}

// Oracle: the same box as a polygon.
TEST(Region, BoxesTouchSameTrianglesAsPolygons) {
  RandomLattice random(5);
  const LatticeFrame& frame = kFrames[0];
  int touching = 0;
  for (int i = 0; i < 5000 / kTestShare; ++i) {
    SCOPED_TRACE(i);
    const LatticePoint low{6 + random.below(4), 6 + random.below(4)};
    const LatticePoint high{low.x + 1 + random.below(5), low.y + 1 + random.below(5)};
    const Region box = Region::of_box({frame.at(low), frame.at(high)});
    const Region polygon = Region::of_polygons(
        {polygon_of({{low, {high.x, low.y}, high, {low.x, high.y}}}, frame)}, 0, 0);
    const std::array<stream::Point3, 3> triangle{frame.at(random.point()), frame.at(random.point()),
                                                 frame.at(random.point())};
    EXPECT_EQ(box.touches(triangle), polygon.touches(triangle));
    touching += box.touches(triangle) ? 1 : 0;
  }
  EXPECT_GT(touching, 1000 / kTestShare);
  EXPECT_LT(touching, 4000 / kTestShare);
}

TEST(Region, AcceptsRingsInAnyForm) {
  for (const std::vector<Point2>& ring :
       std::vector<std::vector<Point2>>{{{0, 0}, {4, 0}, {4, 4}, {0, 4}},
                                        {{0, 4}, {4, 4}, {4, 0}, {0, 0}},
                                        {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}},
                                        {{0, 0}, {4, 0}, {4, 0}, {4, 0}, {4, 4}, {2, 4}, {0, 4}}}) {
    const Region region = Region::of_polygons({{ring}}, -kAnyHeight, kAnyHeight);
    EXPECT_TRUE(region.contains({4, 2, 0}));
    EXPECT_TRUE(region.contains({1, 1, 0}));
    EXPECT_FALSE(region.contains({4.01, 2, 0}));
  }
}

TEST(Region, DescribesFaultsOfRings) {
  struct Case {
    std::vector<Polygon> polygons;
    const char *where, *cause;
  };
  const std::vector<Point2> square{{0, 0}, {9, 0}, {9, 9}, {0, 9}};
  const std::vector<Point2> hole{{1, 1}, {5, 1}, {5, 5}, {1, 5}};
  for (const Case& test : std::vector<Case>{
           {{}, "", "no polygon"},
           {{{square}, {}}, "polygon 2", "no ring"},
           {{{{{0, 0}, {4, 4}}}}, "polygon 1, outer ring", "fewer than three corners"},
           {{{{{0, 0}, {4, 4}, {0, 0}, {4, 4}}}}, "polygon 1, outer ring", "not valid"},
           {{{{{0, 0}, {4, 4}, {2, 2}}}}, "polygon 1, outer ring", "not valid"},
           {{{{{0, 0}, {4, 4}, {4, 0}, {0, 4}}}},
            "polygon 1, outer ring",
            "Self-intersection at 2, 2"},
           {{{square}, {square, {{1, 1}, {3, 3}, {3, 1}, {1, 3}}}},
            "polygon 2, hole 1",
            "Self-intersection at 2, 2"},
           {{{{{0, 0}, {NAN, 4}, {4, 0}}}}, "polygon 1, outer ring", "not finite"},
           {{{{{0, 0}, {1, kAnyHeight}, {4, 0}}}}, "polygon 1, outer ring", "not finite"},
           {{{hole, square}}, "polygon 1", "do not form a valid polygon"},
           {{{square, hole, {{2, 2}, {7, 2}, {7, 7}}}}, "polygon 1", "do not form a valid polygon"},
           {{{square, {{20, 1}, {25, 1}, {25, 5}}}}, "polygon 1", "Hole lies outside shell at 2"},
       }) {
    SCOPED_TRACE(test.cause);
    try {
      Region::of_polygons(test.polygons, 0, 1);
      ADD_FAILURE() << "accepted";
    } catch (const stream::Error& error) {
      EXPECT_EQ(error.parts().where, test.where);
      EXPECT_NE(error.parts().cause.text().find(test.cause), std::string::npos) << error.what();
      EXPECT_NE(error.parts().remedy.text().find("Fix geometries"), std::string::npos);
    }
  }
  const TemporaryFile file(R"({"type":"Polygon","coordinates":[[[0,0],[4,4],[4,0],[0,4],[0,0]]]})");
  try {
    Region::parse(file.path());
    ADD_FAILURE() << "accepted";
  } catch (const stream::Error& error) {
    EXPECT_EQ(error.parts().file, file.path());
  }
}

TEST(Region, AcceptsRingsThatTouchOnlyAtPoints) {
  const std::vector<Point2> square{{0, 0}, {8, 0}, {8, 8}, {0, 8}};
  // The holes touch each other, and the shell at a corner and on a side.
  const std::vector<Point2> left{{0, 4}, {2, 3}, {4, 4}, {2, 5}}, right{{4, 4}, {6, 3}, {6, 5}};
  const std::vector<Point2> corner{{0, 0}, {2, 1}, {1, 2}};
  EXPECT_NO_THROW(Region::of_polygons({{square, left, right, corner}}, 0, 1));
  const auto error_of = [](const Polygon& polygon) -> std::string {
    try {
      Region::of_polygons({polygon}, 0, 1);
    } catch (const stream::Error& error) {
      return error.parts().cause.text();
    }
    return "accepted";
  };
  // A hole from side to side, and a closed chain of holes, cut the interior in two.
  EXPECT_NE(error_of({square, {{0, 4}, {4, 3}, {8, 4}, {4, 5}}}).find("disconnected at 8, 4"),
            std::string::npos);
  EXPECT_NE(error_of({square, left, {{4, 4}, {8, 4}, {6, 5}}}).find("disconnected"),
            std::string::npos);
  // A hole that crosses the shell.
  EXPECT_NE(error_of({square, {{4, 4}, {10, 3}, {8, 5}}}).find("Self-intersection"),
            std::string::npos);
  // A hole inside another hole.
  EXPECT_NE(error_of({square, left, {{1, 4}, {2, 3.75}, {3, 4}}}).find("Nested holes at 1, 4"),
            std::string::npos);
  // Two rings that share a side, and a hole that repeats the shell.
  EXPECT_NE(error_of({square, {{0, 2}, {2, 3}, {0, 4}}}).find("Self-intersection"),
            std::string::npos);
  EXPECT_NE(error_of({square, square}).find("Self-intersection"), std::string::npos);
  // A ring that touches itself.
  EXPECT_NE(error_of({{{0, 0}, {4, 2}, {8, 0}, {8, 4}, {4, 2}, {0, 4}}})
                .find("Ring Self-intersection at 4, 2"),
            std::string::npos);
}

// Bounding boxes alone would exclude almost no pair of edges of these shapes.
TEST(Region, ChecksStarsAndSpiralsInNearlyLinearTime) {
  constexpr int kCorners = 200'000 / kTestShare;
  constexpr double kFullCircle = 6.283185307179586;
  std::vector<Point2> star, spiral;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = kFullCircle * i / kCorners, radius = i % 2 == 0 ? 1.0 : 1e-6;
    star.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  constexpr int kWindings = 200;
  for (int i = 0; i < kCorners; ++i) {
    const bool is_outer = 2 * i < kCorners;
    const double share = (is_outer ? i : kCorners - 1 - i) * 2.0 / kCorners;
    const double angle = kFullCircle * kWindings * share;
    const double radius = 1 + kWindings * share + (is_outer ? 0.5 : 0.0);
    spiral.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  for (const std::vector<Point2>& ring : {star, spiral}) {
    const Region region = Region::of_polygons({{ring}}, 0, 1);
    EXPECT_FALSE(region.covers({1e5, 0}));
  }
  // One edge crosses another.
  std::vector<Point2> crossed = star;
  crossed[static_cast<std::size_t>(kCorners / 2)] = {0.5, -1.0};
  EXPECT_THROW(Region::of_polygons({{crossed}}, 0, 1), stream::Error);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(Region::of_polygons({{star}}, 0, 1, {}, stop.get_token()), stream::Stopped);
}

// Spikes across the whole box, all of them crossed by each row or by each column.
TEST(Region, AnswersSpikesAlongBothAxes) {
  constexpr std::size_t kSpikes = 20000;
  constexpr double kWidth = 1000.0 / kSpikes;
  std::vector<Point2> comb;
  for (std::size_t i = 0; i < kSpikes; ++i) {
    comb.push_back({static_cast<double>(i) * kWidth, 0});
    comb.push_back({(static_cast<double>(i) + 0.5) * kWidth, 1000});
  }
  comb.push_back({1000, 0});
  comb.push_back({1000, -1});
  comb.push_back({0, -1});
  std::vector<Point2> transposed = comb;
  for (Point2& p : transposed) std::swap(p[0], p[1]);
  const Region vertical = Region::of_polygons({Polygon{comb}}, 0, 1),
               horizontal = Region::of_polygons({Polygon{transposed}}, 0, 1);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> coordinate(0, 1000);
  for (int i = 0; i < 5000; ++i) {
    const double x = coordinate(random), y = coordinate(random);
    const double phase = x / kWidth - std::floor(x / kWidth);
    const double top = 1000 * (1 - std::abs(2 * phase - 1));
    if (std::abs(y - top) < 1e-3) continue;
    EXPECT_EQ(vertical.covers({x, y}), y < top) << x << ' ' << y;
    EXPECT_EQ(horizontal.covers({y, x}), y < top) << x << ' ' << y;
  }
}

}  // namespace
}  // namespace terrace::terrain
