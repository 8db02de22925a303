// SPDX-License-Identifier: Apache-2.0
// Checks the laws of vertex trees on surfaces with random clusters; distances by brute force.
#include "terrace/tri/vertex_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "shape/triangle_distance.hpp"
#include "vertex_tree_world.hpp"

namespace terrace::tri {
namespace vertex_trees {
namespace {

double distance_from(const Surface& surface, const Point3& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const Face& f : surface.faces) {
    least = std::min(least, shape::TriangleDistance(surface.points[f[0]], surface.points[f[1]],
                                                    surface.points[f[2]])
                                .square(p));
  }
  return std::sqrt(least);
}

/// The directed edges of a surface whose two directions do not cancel modulo 2, by the full
/// surface's vertices.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> open_edges(const SurfaceOfCut& cut) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Face& f : cut.surface.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = cut.input[f[k]], b = cut.input[f[(k + 1) % 3]];
      edges[{std::min(a, b), std::max(a, b)}] ^= 1;
    }
  }
  std::erase_if(edges, [](const auto& entry) { return entry.second == 0; });
  return edges;
}

/// The cluster from which a vertex is removed.
std::uint32_t cluster_of(const VertexClusters& clusters, const VertexTree& tree, std::uint32_t v) {
  std::uint32_t c = clusters.leaf[v];
  while (clusters.clusters[c].level < tree.levels[v]) c = clusters.clusters[c].parent;
  return c;
}

struct Case {
  const char* name = "";
  bool open = false, two = false, local = true;
};

class VertexTreeTest : public testing::TestWithParam<Case> {
 protected:
  static constexpr unsigned kSeed = 7;

  /// A tree takes longer to build than a test to run, so the tests share one for each case.
  struct Built {
    Surface full;
    VertexClusters clusters;
    VertexTree tree;
  };
  static const Built& built(const Case& of) {
    static std::map<std::string, Built> all;
    const auto [at, added] = all.try_emplace(of.name);
    Built& b = at->second;
    if (!added) return b;
    add_torus(30, 20, 0.0, of.open, b.full);
    if (of.two) add_torus(24, 16, 12.0, false, b.full);
    // Without loose points.
    SurfaceOfCut used = surface_of_cut(b.full, std::vector<std::uint32_t>(b.full.points.size()),
                                       std::vector<bool>(b.full.points.size(), true));
    b.full = std::move(used.surface);
    std::mt19937_64 random(kSeed);
    b.clusters = random_clusters(b.full, 12, of.local, random);
    b.tree = vertex_tree(b.full, b.clusters);
    return b;
  }

  std::mt19937_64 random_{kSeed};
  const Surface& full_ = built(GetParam()).full;
  const VertexClusters& clusters_ = built(GetParam()).clusters;
  const VertexTree& tree_ = built(GetParam()).tree;
};

TEST_P(VertexTreeTest, ParentsAreInTheClusterOrAbove) {
  for (std::uint32_t v = 0; v < full_.points.size(); ++v) {
    const std::uint32_t parent = tree_.parents[v];
    if (parent == kNone) {
      EXPECT_EQ(tree_.errors[v], std::numeric_limits<double>::infinity());
      continue;
    }
    EXPECT_LE(tree_.errors[v], tree_.errors[parent]);
    EXPECT_LE(tree_.levels[v], tree_.levels[parent]);
    // The cluster of the parent is that of the vertex or above it.
    std::uint32_t c = cluster_of(clusters_, tree_, v);
    const std::uint32_t of_parent = cluster_of(clusters_, tree_, parent);
    while (c != of_parent && clusters_.clusters[c].parent != kNone) {
      // The parent is the only way out of the clusters between.
      c = clusters_.clusters[c].parent;
    }
    EXPECT_EQ(c, of_parent);
  }
}

TEST_P(VertexTreeTest, AClusterIsStoodForByVerticesOfTheClustersAbove) {
  // Whatever is below a cluster, its ancestors outside are among the vertices that remained of it.
  for (std::uint32_t v = 0; v < full_.points.size(); ++v) {
    const std::uint32_t c = cluster_of(clusters_, tree_, v);
    if (tree_.parents[v] == kNone) continue;
    std::uint32_t up = tree_.parents[v];
    while (up != kNone && tree_.levels[up] == tree_.levels[v]) up = tree_.parents[up];
    if (up == kNone) continue;
    std::uint32_t from = clusters_.leaf[up];
    while (clusters_.clusters[from].level < clusters_.clusters[c].level) {
      from = clusters_.clusters[from].parent;
    }
    EXPECT_EQ(from, c) << "vertex " << v << ", ancestor " << up;
  }
}

TEST_P(VertexTreeTest, NoErrorGivesTheFullSurface) {
  const SurfaceOfCut cut =
      surface_of_cut(full_, tree_.parents, std::vector<bool>(full_.points.size(), true));
  EXPECT_EQ(cut.surface.faces, full_.faces);
  EXPECT_EQ(cut.surface.points, full_.points);
}

TEST_P(VertexTreeTest, ErrorsAreBoundsAndKeepTheTopology) {
  const SurfaceMeasures before = measure(full_);
  std::size_t vertices = full_.points.size();
  for (const double bound : {0.0, 0.03, 0.1, 0.3, 1.0, std::numeric_limits<double>::infinity()}) {
    SCOPED_TRACE(bound);
    const std::vector<bool> active = cut_by_error(tree_, bound);
    const SurfaceOfCut cut = surface_of_cut(full_, tree_.parents, active);
    EXPECT_EQ(static_cast<std::size_t>(std::count(active.begin(), active.end(), true)),
              cut.input.size());
    EXPECT_LE(cut.input.size(), vertices);
    vertices = cut.input.size();
    const SurfaceMeasures after = measure(cut.surface);
    EXPECT_EQ(after.components, before.components);
    EXPECT_EQ(after.euler_characteristic, before.euler_characteristic);
    EXPECT_EQ(after.closed, before.closed);
    EXPECT_EQ(after.non_manifold_edges, 0U);
    EXPECT_EQ(after.border_edges == 0, before.border_edges == 0);
    for (const Point3& p : full_.points) EXPECT_LE(distance_from(cut.surface, p), bound + 1e-9);
    for (const Face& f : cut.surface.faces) {
      Point3 middle{};
      for (std::size_t k = 0; k < 3; ++k) {
        for (const std::uint32_t v : f) middle[k] += cut.surface.points[v][k] / 3;
      }
      EXPECT_LE(distance_from(full_, middle), bound + 1e-9);
    }
  }
  EXPECT_LT(vertices, GetParam().local ? full_.points.size() / 4 : full_.points.size());
}

TEST_P(VertexTreeTest, FindsTheErrorOfANumberOfPoints) {
  for (const std::size_t points :
       {full_.points.size(), full_.points.size() / 2, full_.points.size() / 3}) {
    const double error = error_of_points(tree_, points);
    const std::vector<bool> active = cut_by_error(tree_, error);
    const auto count = static_cast<std::size_t>(std::count(active.begin(), active.end(), true));
    const auto roots =
        static_cast<std::size_t>(std::count(tree_.parents.begin(), tree_.parents.end(), kNone));
    EXPECT_LE(count, std::max(points, roots));
    if (error > 0.0) {
      const std::vector<bool> finer = cut_by_error(tree_, std::nextafter(error, 0.0));
      EXPECT_GT(static_cast<std::size_t>(std::count(finer.begin(), finer.end(), true)), points);
    }
  }
}

TEST_P(VertexTreeTest, MixedCutsDoNotTear) {
  const bool border = measure(full_).border_edges > 0;
  for (unsigned round = 0; round < 20; ++round) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", round " << round);
    // A cluster is expanded only if its parent is. Parents follow their children.
    std::vector<bool> expanded(clusters_.clusters.size());
    for (std::size_t c = expanded.size(); c-- > 0;) {
      const std::uint32_t parent = clusters_.clusters[c].parent;
      expanded[c] = parent == kNone || (expanded[parent] && random_() % 4 != 0);
    }
    std::vector<bool> active(full_.points.size());
    for (std::uint32_t v = 0; v < active.size(); ++v) {
      active[v] = expanded[cluster_of(clusters_, tree_, v)];
    }
    for (std::uint32_t v = 0; v < active.size(); ++v) {
      EXPECT_TRUE(!active[v] || tree_.parents[v] == kNone || active[tree_.parents[v]]);
    }
    const SurfaceOfCut cut = surface_of_cut(full_, tree_.parents, active);
    EXPECT_TRUE(border || open_edges(cut).empty());
    EXPECT_TRUE(measure(cut.surface).closed || border);
  }
  for (unsigned level = 0; level <= clusters_.clusters.back().level; ++level) {
    const SurfaceOfCut cut = surface_of_cut(full_, tree_.parents, cut_by_level(tree_, level));
    EXPECT_TRUE(border || open_edges(cut).empty());
  }
}

TEST_P(VertexTreeTest, OneClusterIsTheFreeSimplification) {
  VertexClusters one;
  one.clusters.push_back({});
  one.leaf.assign(full_.points.size(), 0);
  const VertexTree tree = vertex_tree(full_, one);
  const SurfaceOfCut cut =
      surface_of_cut(full_, tree.parents, cut_by_error(tree, error_of_points(tree, 60)));
  EXPECT_LE(cut.input.size(), 60U);
  EXPECT_EQ(measure(cut.surface).euler_characteristic, measure(full_).euler_characteristic);
}

INSTANTIATE_TEST_SUITE_P(Surfaces, VertexTreeTest,
                         testing::Values(Case{"Closed"}, Case{"Open", true},
                                         Case{"TwoParts", false, true},
                                         Case{"ScatteredClusters", false, false, false}),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(VertexTreeInputTest, RefusesBadInput) {
  const Surface surface{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  VertexClusters clusters;
  EXPECT_THROW(static_cast<void>(vertex_tree(surface, clusters)), std::invalid_argument);
  clusters.leaf = {0, 0, 0};
  EXPECT_THROW(static_cast<void>(vertex_tree(surface, clusters)), std::invalid_argument);
  clusters.clusters = {{kNone, 3, 0}};
  EXPECT_THROW(static_cast<void>(vertex_tree(surface, clusters)), std::invalid_argument);
  clusters.clusters = {{0, kNone, 0}};
  EXPECT_THROW(static_cast<void>(vertex_tree(surface, clusters)), std::invalid_argument);
  clusters.clusters = {{kNone, kNone, 0}};
  EXPECT_EQ(vertex_tree(surface, clusters).parents, std::vector<std::uint32_t>(3, kNone));
  // Without an active ancestor: one that is missing, and a cycle.
  EXPECT_THROW(static_cast<void>(surface_of_cut(surface, {kNone, 0, 0}, {false, true, true})),
               std::invalid_argument);
  EXPECT_THROW(static_cast<void>(surface_of_cut(surface, {1, 0, 0}, {false, false, true})),
               std::invalid_argument);
  EXPECT_THROW(static_cast<void>(surface_of_cut(surface, {kNone, 0}, {true, true, true})),
               std::invalid_argument);
  EXPECT_TRUE(vertex_tree({}, {}).parents.empty());
}

}  // namespace
}  // namespace vertex_trees
}  // namespace terrace::tri
