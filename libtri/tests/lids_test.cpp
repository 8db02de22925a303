// SPDX-License-Identifier: Apache-2.0
// Lids of open scans, compared with their definition, and while points are added and removed.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ball_world.hpp"
#include "drawn_surface.hpp"
#include "points3.hpp"
#include "scan_file.hpp"
#include "terrace/tri/dynamic_surface.hpp"
#include "terrace/tri/multiresolution.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri::test {
namespace {

template <class T>
class Lids : public testing::Test {};
using LidCoords = testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(Lids, LidCoords);

/// A surface, and whether its scan is open.
template <class Coord>
struct Seen {
  std::multiset<typename Drawn<Coord>::Points> triangles;
  bool open = false;
  bool operator==(const Seen&) const = default;
};

template <class Coord>
Seen<Coord> seen(const ShapeSurface& surface, const Delaunay3<Coord>& triangulation) {
  return {faces_of(surface, triangulation), surface.open};
}

/// Computes the visible part of the closed surface by the definition. `share` is the share of the
/// lids.
template <class Coord>
Seen<Coord> by_definition(const ShapeSurface& closed, const Delaunay3<Coord>& triangulation,
                          double& share, std::size_t& lids) {
  using Wide = long double;  // neither the largest nor the smallest doubles leave its range
  const auto length = [&](VertexId a, VertexId b) {
    const auto p = triangulation.point(a), q = triangulation.point(b);
    Wide square = 0;
    for (std::size_t k = 0; k < 3; ++k) square += (Wide{1} * p[k] - q[k]) * (Wide{1} * p[k] - q[k]);
    return std::sqrt(square);
  };
  std::map<VertexId, Wide> spacing;
  for (const VertexId v : closed.vertices) {
    std::vector<VertexId> neighbours;
    triangulation.adjacent(v, neighbours);
    std::vector<Wide> lengths;
    for (const VertexId other : neighbours) lengths.push_back(length(v, other));
    std::sort(lengths.begin(), lengths.end());
    spacing[v] = lengths.at(2);
  }
  Seen<Coord> all, others;
  Wide lid_area = 0, total_area = 0;
  for (const auto& face : closed.surface.faces) {
    std::array<VertexId, 3> v;
    typename Drawn<Coord>::Points p;
    for (std::size_t i = 0; i < 3; ++i) {
      v[i] = closed.vertices[face[i]];
      p[i] = triangulation.point(v[i]);
    }
    const Wide longest = std::max({length(v[0], v[1]), length(v[1], v[2]), length(v[2], v[0])});
    const bool lid = std::all_of(v.begin(), v.end(),
                                 [&](VertexId corner) { return longest > 10 * spacing[corner]; });
    std::array<Wide, 3> s, t;
    for (std::size_t k = 0; k < 3; ++k) {
      s[k] = Wide{1} * p[1][k] - p[0][k];
      t[k] = Wide{1} * p[2][k] - p[0][k];
    }
    Wide square = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      square += (s[i] * t[j] - s[j] * t[i]) * (s[i] * t[j] - s[j] * t[i]);
    }
    total_area += std::sqrt(square);
    lid_area += lid ? std::sqrt(square) : 0;
    lids += lid;
    all.triangles.insert(Drawn<Coord>::from_least(p));
    if (!lid) others.triangles.insert(Drawn<Coord>::from_least(p));
  }
  share = total_area > 0 ? static_cast<double>(lid_area / total_area) : 0.0;
  others.open = share > 0.1;
  return others.open ? others : all;
}

/// One to four dense patches of a curved sheet, far apart compared with their size, so that lids
/// span the gaps between them. Other point sets have lids only by chance.
template <class Coord>
std::vector<std::array<Coord, 3>> dense_patches(std::mt19937_64& random) {
  std::vector<std::array<Coord, 3>> points;
  const std::size_t patches = 1 + below(random, 4);
  for (std::size_t patch = 0; patch < patches; ++patch) {
    const std::array<double, 3> at{0x1p20 * (1.0 + unit(random)), 0x1p20 * (1.0 + unit(random)),
                                   0x1p20 * (1.0 + unit(random))};
    const double size = std::exp2(12.0 + 6.0 * unit(random));
    for (std::size_t i = 0; i < 150; ++i) {
      const double u = unit(random) - 0.5, v = unit(random) - 0.5;
      points.push_back({static_cast<Coord>(std::round(at[0] + size * u)),
                        static_cast<Coord>(std::round(at[1] + size * v)),
                        static_cast<Coord>(std::round(at[2] + size * (u * u - v)))});
    }
  }
  return points;
}

TYPED_TEST(Lids, MatchTheDefinition) {
  using Coord = TypeParam;
  std::size_t open = 0, kept = 0;
  const auto check = [&](const std::vector<std::array<Coord, 3>>& points) {
    Delaunay3<Coord> triangulation;
    triangulation.build(points);
    Shape3<Coord> shape;
    shape.restore(triangulation);
    double share = 0.0;
    std::size_t lids = 0;
    const auto expected = by_definition(shape.surface(triangulation), triangulation, share, lids);
    const ShapeSurface without_lids = shape.surface_without_lids(triangulation);
    const auto found = seen(without_lids, triangulation);
    EXPECT_EQ(without_lids.lids, lids);
    if (std::abs(share - 0.1) < 1e-4) return;  // areas are cut to 18 bits
    ASSERT_EQ(found, expected) << share;
    open += found.open;
    kept += !found.open && share > 0.0;
  };
  for (std::uint64_t seed = 1; seed <= 30 / TERRACE_TEST_SHARE; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    ASSERT_NO_FATAL_FAILURE(check(dense_patches<Coord>(random)));
    for (const PointSet3 kind : kPointSets3) {
      SCOPED_TRACE(name(kind));
      if (std::is_same_v<Coord, double> && kind == PointSet3::tiny) continue;  // areas lose bits
      ASSERT_NO_FATAL_FAILURE(check(make_points3<Coord>(kind, 120, seed)));
    }
  }
  EXPECT_GT(open, 10u);
  EXPECT_GT(kept, 3u);
}

// Scaling the coordinates by a power of two does not change the scan, within the range of doubles.
TEST(LidsTest, DoNotDependOnScale) {
  std::mt19937_64 random(3);
  std::vector<Point3> points = bumpy_ball(1500, random);
  std::erase_if(points, [](const Point3& p) { return p[2] > 0x1.1p20; });
  std::array<std::size_t, 2> wanted{};
  for (const int exponent : {0, -1074, -600, 500, 1002}) {
    SCOPED_TRACE(exponent);
    std::vector<Point3> scaled = points;
    for (Point3& p : scaled)
      for (double& c : p) c = std::ldexp(c, exponent);
    const RestoredSurface found = restore_surface(scaled);
    const std::array<std::size_t, 2> current{found.surface.faces.size(), found.open ? 1U : 0U};
    if (exponent == 0) wanted = current;
    EXPECT_EQ(current, wanted);
    DynamicSurface<double> live;
    live.build(scaled);
    EXPECT_EQ(live.triangle_count(), wanted[0]);
    EXPECT_EQ(live.open(), found.open);
  }
  EXPECT_EQ(wanted[1], 1u);
}

/// The tetrahedra and their shape, which follows the same changes as a dynamic surface.
template <class Coord>
struct Followed {
  DynamicSurface<Coord> surface;
  Delaunay3<Coord> triangulation;
  Shape3<Coord> shape;
  typename DynamicSurface<Coord>::Changes changes;
  typename Delaunay3<Coord>::Changes tetrahedra;
  Drawn<Coord> drawn{surface};
  std::array<std::size_t, 2> answers{};  ///< number of closed scans, of open ones
  std::size_t turns = 0;

  Followed() {
    shape.restore(triangulation);
    surface.start_journal();
    triangulation.start_journal();
  }
  void insert(std::span<const std::array<Coord, 3>> points) {
    surface.insert(points, {});
    triangulation.insert(points, {});
  }
  void remove(std::span<const VertexId> vertices) {
    surface.remove(vertices);
    triangulation.remove(vertices);
  }
  /// Compares with the lids found from scratch; `scratch`: also with those of the shape found from
  /// scratch.
  void check(bool scratch) {
    const bool before = surface.open();
    triangulation.take_changes(tetrahedra);
    if (scratch) {
      surface.restore(2);
      shape.restore(triangulation);
    } else {
      shape.update_nearby(triangulation, tetrahedra);
    }
    surface.take_changes(changes);
    ASSERT_NO_FATAL_FAILURE(drawn.apply(changes));
    ASSERT_NO_FATAL_FAILURE(drawn.check());
    const auto expected = seen(shape.surface_without_lids(triangulation), triangulation);
    ASSERT_EQ((Seen<Coord>{drawn.triangles(), surface.open()}), expected);
    ++answers[expected.open];
    turns += before != expected.open;
    if (!scratch) return;
    std::vector<std::array<Coord, 3>> live_points;
    for (const VertexId v : surface.all_vertices()) live_points.push_back(surface.point(v));
    DynamicSurface<Coord> rebuilt;
    rebuilt.build(live_points);
    ASSERT_EQ(surface.hash(), rebuilt.hash());
    ASSERT_EQ(surface.open(), rebuilt.open());
  }
};

// Patches of a scan are added and removed in any order.
TYPED_TEST(Lids, OfDynamicSurfacesEqualThoseFromScratch) {
  using Coord = TypeParam;
  std::array<std::size_t, 2> answers{};
  std::size_t turns = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    Followed<Coord> live;
    for (int step = 0; step < 40; ++step) {
      if (random() % 3 != 0) {
        live.insert(dense_patches<Coord>(random));
      } else {
        std::vector<VertexId> some;
        const bool region = random() % 2 == 0;
        const auto at = static_cast<Coord>((1 << 20) + below(random, 1 << 20));
        for (const VertexId v : live.surface.all_vertices())
          if (region ? live.surface.point(v)[0] < at : random() % 3 == 0) some.push_back(v);
        live.remove(some);
      }
      if (random() % 4 == 0) continue;  // several operations at once
      ASSERT_NO_FATAL_FAILURE(live.check(random() % 5 == 0));
    }
    for (std::size_t i = 0; i < 2; ++i) answers[i] += live.answers[i];
    turns += live.turns;
  }
  EXPECT_GT(answers[0], 10u);
  EXPECT_GT(answers[1], 20u);
  EXPECT_GT(turns, 5u);
}

// A ball without its cap is open. The cap is added and removed, piece by piece and at once.
TYPED_TEST(Lids, FollowScansThatCloseAndOpenAgain) {
  using Coord = TypeParam;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    std::vector<std::array<Coord, 3>> bowl, cap;
    for (const Point3& p : bumpy_ball(2500, random)) {
      auto& part = p[2] > 0x1.3p20 ? cap : bowl;
      part.push_back(
          {static_cast<Coord>(p[0]), static_cast<Coord>(p[1]), static_cast<Coord>(p[2])});
    }
    Followed<Coord> live;
    live.insert(bowl);
    ASSERT_NO_FATAL_FAILURE(live.check(true));
    const std::uint64_t bowl_hash = live.surface.hash();
    ASSERT_TRUE(live.surface.open());
    for (const std::size_t step_count : {std::size_t{1}, std::size_t{13}}) {
      for (std::size_t begin = 0; begin < cap.size(); begin += (cap.size() - 1) / step_count + 1) {
        live.insert(std::span(cap).subspan(
            begin, std::min((cap.size() - 1) / step_count + 1, cap.size() - begin)));
        ASSERT_NO_FATAL_FAILURE(live.check(false));
      }
      EXPECT_FALSE(live.surface.open());
      std::vector<VertexId> removed;
      for (const VertexId v : live.surface.all_vertices()) {
        if (!(static_cast<double>(live.surface.point(v)[2]) > 0x1.3p20)) continue;
        removed.push_back(v);
        if (removed.size() < 400 / step_count) continue;
        live.remove(removed);
        removed.clear();
        ASSERT_NO_FATAL_FAILURE(live.check(false));
      }
      live.remove(removed);
      ASSERT_NO_FATAL_FAILURE(live.check(true));
      EXPECT_TRUE(live.surface.open());
      EXPECT_EQ(live.surface.hash(), bowl_hash);
    }
    EXPECT_GE(live.turns, 5u);
  }
}

/// Expands and collapses random clusters in a model of a scan. After restore() the surface and its
/// lids must be those computed from the points alone.
void expect_lids_to_follow(MemorySource& source, int steps, std::mt19937_64& random,
                           std::array<std::size_t, 2>& answers) {
  using Surface3 = DynamicSurface<std::int32_t>;
  MultiresolutionModel<Surface3> model(source);
  const Surface3& surface = model.triangulation();
  Drawn<std::int32_t> drawn(surface);
  for (int step = 0; step < steps; ++step) {
    std::vector<ClusterId> open = model.expanded(), parents = open, closed, children;
    parents.push_back(cluster_id(source.top(), 0));
    for (const ClusterId parent : parents) {
      model.children(parent, children);
      for (const ClusterId id : children)
        if (!model.is_expanded(id)) closed.push_back(id);
    }
    const auto& from = below(random, 2) == 0 ? open : closed;
    const MultiresolutionModel<Surface3>::Delta* delta = nullptr;
    if (from.empty() || step % 20 == 0) {
      delta = &model.set_level(step % 40 == 0 ? 0 : Detail::kTop);
    } else {
      const ClusterId id = from[below(random, from.size())];
      delta = model.is_expanded(id) ? &model.collapse(id) : &model.expand(id);
    }
    ASSERT_NO_FATAL_FAILURE(drawn.apply(delta->changes));
    if (step % 4 != 3) continue;
    ASSERT_NO_FATAL_FAILURE(drawn.apply(model.restore(2).changes));
    ASSERT_NO_FATAL_FAILURE(drawn.check());
    std::vector<Surface3::Point> live_points;
    for (const VertexId v : surface.all_vertices()) live_points.push_back(surface.point(v));
    Delaunay3<std::int32_t> new_mesh;
    new_mesh.build(live_points);
    Shape3<std::int32_t> shape;
    shape.restore(new_mesh);
    ASSERT_EQ((Seen<std::int32_t>{drawn.triangles(), surface.open()}),
              seen(shape.surface_without_lids(new_mesh), new_mesh));
    ++answers[surface.open()];
  }
}

TEST(LidsTest, FollowExpandedClusters) {
  std::array<std::size_t, 2> answers{};
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    std::vector<Point3> points = bumpy_ball(5000, random);
    std::erase_if(points, [](const Point3& p) { return p[2] > 0x1.2p20; });
    MemorySource source = make_hierarchy(points, 2, 8.0, random);
    fill_errors(source);
    ASSERT_NO_FATAL_FAILURE(expect_lids_to_follow(source, 80, random, answers));
  }
  EXPECT_GT(answers[0], 5u);
  EXPECT_GT(answers[1], 5u);
}

TEST(LidsDataTest, FollowExpandedClustersOfRealScans) {
  const char* const folder = std::getenv("TERRACE_DATA");
  if (folder == nullptr) GTEST_SKIP() << "TERRACE_DATA is not set";
  struct Scan {
    const char* file;
    double cut;  ///< share of the height that is left. 1 means all
  };
  std::array<std::size_t, 2> answers{};
  for (const Scan& scan : {Scan{"bunny_range/bun000.ply.gz", 1.0}, Scan{"armadillo_tm.ply", 1.0},
                           Scan{"bun_zipper.ply", 0.5}, Scan{"horse.ply", 0.6}}) {
    SCOPED_TRACE(scan.file);
    std::mt19937_64 random(1);
    const tri::Surface original = read_scan(std::filesystem::path(folder) / "scan" / scan.file);
    Point3 low = original.points[0], high = low;
    for (const Point3& p : original.points) {
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    }
    std::vector<Point3> points;
    for (std::size_t i = 0; i < original.points.size(); i += 3) {
      Point3 p = original.points[i];
      if (p[1] > low[1] + scan.cut * (high[1] - low[1])) continue;
      for (std::size_t k = 0; k < 3; ++k)
        p[k] = std::round((p[k] - low[k]) / (high[1] - low[1]) * 0x1p24);
      points.push_back(p);
    }
    MemorySource source = make_hierarchy(points, 2, 30.0, random);
    fill_errors(source);
    ASSERT_NO_FATAL_FAILURE(expect_lids_to_follow(source, 40, random, answers));
  }
  EXPECT_GT(answers[1], 5u);
}

}  // namespace
}  // namespace terrace::tri::test
