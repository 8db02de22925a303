// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/geomorph.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <gtest/gtest.h>

#include "view_world.hpp"

namespace terrace::tri::test {
namespace {

template <class Coord>
using Model = MultiresolutionModel<Delaunay2<Coord>>;

// A copy of the whole surface, with heights found by testing all triangles.
template <class Coord>
struct Surface {
  std::vector<std::array<Point3, 3>> triangles;
  std::map<std::pair<double, double>, double> vertices;

  explicit Surface(const Model<Coord>& model) {
    const auto position = [&](VertexId v) -> Point3 {
      const auto p = model.triangulation().point(v);
      return {static_cast<double>(p[0]), static_cast<double>(p[1]), model.height(v)};
    };
    for (const TriangleId t : model.triangulation().all_triangles()) {
      const auto c = model.triangulation().vertices(t);
      triangles.push_back({position(c[0]), position(c[1]), position(c[2])});
    }
    for (const VertexId v : model.triangulation().all_vertices()) {
      const Point3 p = position(v);
      vertices[{p[0], p[1]}] = p[2];
    }
  }
  [[nodiscard]] std::optional<double> at(const Point3& p) const {
    // The triangle whose least barycentric coordinate is the greatest.
    double best = -1e-9;
    std::optional<double> result;
    for (const auto& [a, b, c] : triangles) {
      const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
      const double v = ((p[0] - a[0]) * (c[1] - a[1]) - (p[1] - a[1]) * (c[0] - a[0])) / area;
      const double w = ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / area;
      const double least = std::min({1.0 - v - w, v, w});
      if (least < best) continue;
      best = least;
      result = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2]);
    }
    return result;
  }
};

template <class Coord>
void check_slides(const Slides& slides, const Surface<Coord>& from, const Surface<Coord>& to) {
  ASSERT_EQ(slides.start.size(), slides.size());
  ASSERT_EQ(slides.end.size(), slides.size());
  for (std::size_t i = 0; i < slides.size(); ++i) {
    const Point3 &start = slides.start[i], &end = slides.end[i];
    ASSERT_EQ(start[0], end[0]);
    ASSERT_EQ(start[1], end[1]);
    const auto own = to.vertices.find({end[0], end[1]});
    ASSERT_NE(own, to.vertices.end());
    ASSERT_EQ(end[2], own->second);
    const auto on = from.at(start);
    ASSERT_NEAR(start[2], on ? *on : end[2], 1e-5 * (1.0 + std::abs(start[2])));
  }
}

Slides reversed(Slides slides) {
  std::swap(slides.start, slides.end);
  return slides;
}

template <class T>
class Geomorph : public testing::Test {};
using Coords = testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(Geomorph, Coords);

// Whatever a step does: new vertices start on the old surface, removed ones end on the new one.
TYPED_TEST(Geomorph, StartsOnTheOldSurfaceAndEndsOnTheNew) {
  std::size_t inside = 0, changed = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const Shape shape : kWorldShapes) {
      World world(seed, shape, 200);
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", shape " << static_cast<int>(shape));
      ViewOptions options;
      options.model.old_heights = true;
      options.max_points = world.source.root().positions.size() + 40 + below(world.random, 150);
      ViewControl<Delaunay2<TypeParam>> control(counts(world.source), load_root(world.source),
                                                options);
      Geomorph2<TypeParam> morph;
      for (int steps = 0; steps < 12; ++steps) {
        const View view = world.view();
        const Surface<TypeParam> before(control.model());
        const auto& step = control.step(view);
        const Surface<TypeParam> after(control.model());
        morph.make(control.model(), *step.delta);
        ASSERT_EQ(morph.added.vertices, step.delta->changes.added_vertices);
        ASSERT_EQ(morph.removed.vertices, step.delta->changes.removed_vertices);
        ASSERT_EQ(morph.reassigned.vertices, step.delta->reassigned);
        ASSERT_NO_FATAL_FAILURE(check_slides(morph.added, before, after));
        ASSERT_NO_FATAL_FAILURE(check_slides(reversed(morph.removed), after, before));
        for (std::size_t i = 0; i < morph.reassigned.size(); ++i) {
          const Point3 &start = morph.reassigned.start[i], &end = morph.reassigned.end[i];
          ASSERT_EQ(before.vertices.at({start[0], start[1]}), start[2]);
          ASSERT_EQ(after.vertices.at({end[0], end[1]}), end[2]);
          ++changed;
        }
        for (std::size_t i = 0; i < morph.added.size(); ++i) {
          inside += morph.added.start[i] != morph.added.end[i];
        }
        for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted)) {
          control.give(load(world.source, r));
        }
      }
    }
  }
  EXPECT_GT(inside, 1000u);
  EXPECT_GT(changed, 20u);
}

TYPED_TEST(Geomorph, CollapseMirrorsExpand) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    World world(seed, seed % 3 ? Shape::random : Shape::duplicates, 200);
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Model<TypeParam> model(world.source, {}, {.deltas = true, .old_heights = true});
    std::vector<ClusterId> children;
    model.children(cluster_id(world.source.top(), 0), children);
    if (children.empty()) continue;
    const ClusterId id = children[below(world.random, children.size())];
    Geomorph2<TypeParam> there, back;
    there.make(model, model.expand(id));
    back.make(model, model.collapse(id));
    const auto by_place = [](const Slides& slides) {
      std::map<std::pair<double, double>, std::pair<double, double>> result;
      for (std::size_t i = 0; i < slides.size(); ++i) {
        result[{slides.start[i][0], slides.start[i][1]}] = {slides.start[i][2], slides.end[i][2]};
      }
      return result;
    };
    const auto forth = by_place(there.added), again = by_place(reversed(back.removed));
    ASSERT_EQ(forth.size(), again.size());
    for (const auto& [place, heights] : forth) {
      ASSERT_EQ(again.at(place).second, heights.second);
      // The same triangle with its corners in another order.
      ASSERT_NEAR(again.at(place).first, heights.first, 1e-9 * (1.0 + std::abs(heights.first)));
    }
    ASSERT_EQ(by_place(there.reassigned), by_place(reversed(back.reassigned)));
    ASSERT_EQ(there.removed.size() + back.added.size(), 0u);
  }
}

// The former height of a vertex, even where its slot was reused in the same step.
TYPED_TEST(Geomorph, StepsOfManyOperations) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    World world(seed, Shape::duplicates, 250);
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Model<TypeParam> model(world.source, {}, {.deltas = true, .old_heights = true});
    Geomorph2<TypeParam> morph;
    for (int steps = 0; steps < 10; ++steps) {
      const Surface<TypeParam> before(model);
      model.open_step();
      for (int operations = 0; operations < 6; ++operations) {
        const std::vector<ClusterId> open = model.expanded();
        std::vector<ClusterId> parents = open, children, closed;
        parents.push_back(cluster_id(world.source.top(), 0));
        for (const ClusterId parent : parents) {
          model.children(parent, children);
          for (const ClusterId child : children) {
            if (model.can_expand(child)) closed.push_back(child);
          }
        }
        if (!closed.empty() && (open.empty() || below(world.random, 2))) {
          model.expand(closed[below(world.random, closed.size())]);
        } else if (!open.empty()) {
          model.collapse(open[below(world.random, open.size())]);
        }
      }
      const auto& delta = model.close_step();
      const Surface<TypeParam> after(model);
      morph.make(model, delta);
      ASSERT_NO_FATAL_FAILURE(check_slides(morph.added, before, after));
      ASSERT_NO_FATAL_FAILURE(check_slides(reversed(morph.removed), after, before));
    }
  }
}

TEST(GeomorphMisuse, NeedsOldHeights) {
  World world(1, Shape::random, 200);
  Model<std::int32_t> model(world.source);
  Geomorph2<std::int32_t> morph;
  model.set_level(0);
  const auto& delta = model.set_level(Detail::kTop);
  ASSERT_FALSE(delta.changes.removed_vertices.empty());
  EXPECT_THROW(morph.make(model, delta), std::invalid_argument);
}

}  // namespace
}  // namespace terrace::tri::test
