// SPDX-License-Identifier: Apache-2.0
// Compares a surface that follows a cut with the one extracted at once, after random changes.
#include "terrace/tri/surface_front.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "vertex_tree_world.hpp"

namespace terrace::tri {
namespace vertex_trees {
namespace {

using Triangle = std::array<Point3, 3>;
using Triangles = std::multiset<Triangle>;

Triangle in_order(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

Triangles triangles_of(const SurfaceFront& front) {
  Triangles out;
  for (const TriangleId t : front.all_triangles()) {
    const auto v = front.vertices(t);
    for (const VertexId one : v) EXPECT_TRUE(front.alive(one));
    out.insert(in_order({front.point(v[0]), front.point(v[1]), front.point(v[2])}));
  }
  EXPECT_EQ(out.size(), front.triangle_count());
  return out;
}

Triangles extracted(const Surface& surface, const VertexTree& tree, const SurfaceFront& front) {
  std::vector<bool> active(surface.points.size());
  for (std::uint32_t v = 0; v < active.size(); ++v) {
    active[front.input()[v]] = front.alive(VertexId{v});
  }
  const SurfaceOfCut cut = surface_of_cut(surface, tree.parents, active);
  Triangles out;
  for (const Face& f : cut.surface.faces) {
    out.insert(
        in_order({cut.surface.points[f[0]], cut.surface.points[f[1]], cut.surface.points[f[2]]}));
  }
  return out;
}

/// A copy of a front that knows only its changes.
class Mirror {
 public:
  explicit Mirror(const SurfaceFront& front) {
    for (const VertexId v : front.all_vertices()) vertices_.insert(slot(v));
    for (const TriangleId t : front.all_triangles()) triangles_[slot(t)] = front.vertices(t);
  }
  void apply(const SurfaceFront& front, const SurfaceFront::Changes& changes) {
    for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i) {
      EXPECT_EQ(vertices_.erase(slot(changes.removed_vertices[i])), 1U);
      EXPECT_EQ(changes.removed_points[i], front.point(changes.removed_vertices[i]));
    }
    for (std::size_t i = 0; i < changes.removed_triangles.size(); ++i) {
      const auto at = triangles_.find(slot(changes.removed_triangles[i]));
      ASSERT_NE(at, triangles_.end());
      EXPECT_EQ(at->second, changes.removed_corners[i]);
      triangles_.erase(at);
    }
    for (const VertexId v : changes.added_vertices) EXPECT_TRUE(vertices_.insert(slot(v)).second);
    for (const TriangleId t : changes.added_triangles) {
      EXPECT_TRUE(triangles_.emplace(slot(t), front.vertices(t)).second);
    }
  }
  void expect_equal(const SurfaceFront& front) const {
    EXPECT_EQ(vertices_.size(), front.vertex_count());
    EXPECT_EQ(triangles_.size(), front.triangle_count());
    for (const auto& [t, corners] : triangles_) {
      ASSERT_TRUE(front.alive(TriangleId{t}));
      EXPECT_EQ(front.vertices(TriangleId{t}), corners);
      for (const VertexId v : corners) EXPECT_TRUE(vertices_.count(slot(v)));
    }
  }

 private:
  std::set<std::uint32_t> vertices_;
  std::map<std::uint32_t, std::array<VertexId, 3>> triangles_;
};

/// Activates and deactivates random vertices, and checks what is shown now and then.
void check_random_changes(const Surface& surface, const VertexTree& tree, unsigned seed) {
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  SurfaceFront front(surface, tree);
  front.start_journal();
  Mirror mirror(front);
  SurfaceFront::Changes changes;
  const auto n = static_cast<std::uint32_t>(front.size());
  std::vector<std::uint32_t> active_children(n);
  const auto parent = [&](std::uint32_t v) { return slot(front.parent(VertexId{v})); };
  for (unsigned round = 0; round < 30; ++round) {
    SCOPED_TRACE(testing::Message() << "round " << round);
    const bool mostly_up = random() % 2 == 0;
    for (std::size_t i = 0; i < n; ++i) {
      const auto v = static_cast<std::uint32_t>(random() % n);
      if (front.parent(VertexId{v}) == kNoVertex) continue;
      const bool up = (random() % 4 != 0) == mostly_up;
      if (up && !front.alive(VertexId{v}) && front.alive(VertexId{parent(v)})) {
        front.activate(VertexId{v});
        ++active_children[parent(v)];
      } else if (!up && front.alive(VertexId{v}) && active_children[v] == 0) {
        front.deactivate(VertexId{v});
        --active_children[parent(v)];
      }
    }
    EXPECT_EQ(triangles_of(front), extracted(surface, tree, front));
    front.take_changes(changes);
    mirror.apply(front, changes);
    mirror.expect_equal(front);
    std::size_t corners = 0;
    for (const VertexId v : front.all_vertices()) corners += front.triangles_at(v);
    EXPECT_EQ(corners, 3 * front.triangle_count());
  }
  // Back to the start, where it is the surface of a new object.
  for (std::uint32_t v = n; v-- > 0;) {
    if (front.alive(VertexId{v}) && front.parent(VertexId{v}) != kNoVertex) {
      front.deactivate(VertexId{v});
    }
  }
  EXPECT_EQ(front.hash(), SurfaceFront(surface, tree).hash());
}

class SurfaceFrontTest : public testing::TestWithParam<bool> {};

TEST_P(SurfaceFrontTest, EqualsTheSurfaceOfTheCut) {
  Surface surface;
  add_torus(24, 14, 0.0, GetParam(), surface);
  add_torus(14, 10, 12.0, false, surface);
  std::mt19937_64 random(3);
  const VertexTree tree = vertex_tree(surface, random_clusters(surface, 12, true, random));
  check_random_changes(surface, tree, 5);
}
INSTANTIATE_TEST_SUITE_P(Surfaces, SurfaceFrontTest, testing::Bool(),
                         [](const auto& one) { return one.param ? "Open" : "Closed"; });

TEST(SurfaceFrontTreeTest, FollowsAnyTree) {
  // Trees that have nothing to do with the surface, so that corners part in all ways; and surfaces
  // that are not manifolds.
  for (unsigned seed = 1; seed <= 12; ++seed) {
    std::mt19937_64 random(seed);
    Surface surface;
    const std::size_t n = 3 + random() % 60;
    for (std::size_t v = 0; v < n; ++v) {
      surface.points.push_back({static_cast<double>(random() % 1000),
                                static_cast<double>(random() % 1000), static_cast<double>(v)});
    }
    for (std::size_t f = 0; f < 2 * n; ++f) {
      const Face face{static_cast<std::uint32_t>(random() % n),
                      static_cast<std::uint32_t>(random() % n),
                      static_cast<std::uint32_t>(random() % n)};
      if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) {
        surface.faces.push_back(face);
      }
    }
    VertexTree tree;
    std::vector<std::uint32_t> order(n);
    for (std::uint32_t v = 0; v < n; ++v) order[v] = v;
    std::shuffle(order.begin(), order.end(), random);
    tree.parents.assign(n, kNone);
    const std::size_t roots = 1 + random() % 4, reach = 1 + random() % n;
    for (std::size_t i = std::min(roots, n); i < n; ++i) {
      tree.parents[order[i]] = order[i - 1 - random() % std::min(i, reach)];
    }
    check_random_changes(surface, tree, seed);
  }
}

TEST(SurfaceFrontTreeTest, NumbersVerticesBeforeTheirDescendants) {
  Surface surface;
  add_torus(20, 12, 0.0, false, surface);
  std::mt19937_64 random(9);
  const VertexTree tree = vertex_tree(surface, random_clusters(surface, 10, true, random));
  const SurfaceFront front(surface, tree);
  std::vector<std::uint32_t> number(front.size());
  for (std::uint32_t v = 0; v < front.size(); ++v) number[front.input()[v]] = v;
  for (std::uint32_t v = 0; v < front.size(); ++v) {
    const std::uint32_t parent = tree.parents[front.input()[v]];
    EXPECT_EQ(front.parent(VertexId{v}), parent == kNone ? kNoVertex : VertexId{number[parent]});
    EXPECT_EQ(front.alive(VertexId{v}), parent == kNone);
    if (parent == kNone) continue;
    EXPECT_LT(number[parent], v);
    EXPECT_LE(front.end_of_descendants(VertexId{v}),
              front.end_of_descendants(VertexId{number[parent]}));
  }
}

TEST(SurfaceFrontTreeTest, RefusesBadTrees) {
  const Surface surface{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  VertexTree tree;
  tree.parents = {kNone, 0};
  EXPECT_THROW(SurfaceFront(surface, tree), std::invalid_argument);
  tree.parents = {kNone, 0, 3};
  EXPECT_THROW(SurfaceFront(surface, tree), std::invalid_argument);
  tree.parents = {kNone, 2, 1};
  EXPECT_THROW(SurfaceFront(surface, tree), std::invalid_argument);
  tree.parents = {kNone, kNone, kNone};
  EXPECT_EQ(SurfaceFront(surface, tree).triangle_count(), 1U);
  EXPECT_THROW(SurfaceFront({surface.points, {{0, 1, 1}}}, tree), std::invalid_argument);
  EXPECT_THROW(SurfaceFront({surface.points, {{0, 1, 3}}}, tree), std::invalid_argument);
  EXPECT_EQ(SurfaceFront({}, {}).vertex_count(), 0U);
}

}  // namespace
}  // namespace vertex_trees
}  // namespace terrace::tri
