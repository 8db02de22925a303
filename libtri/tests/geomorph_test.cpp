// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/geomorph.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "ball_world.hpp"
#include "view/patches.hpp"

namespace terrace::tri::test {
namespace {

template <class Coord>
using Model = MultiresolutionModel<Delaunay2<Coord>>;

// A copy of the whole surface. Finds heights by testing all triangles.
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
    // Chooses the triangle whose least barycentric coordinate is the greatest.
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
class Geomorphs : public testing::Test {};
using Coords = testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(Geomorphs, Coords);

// For any step, new vertices must start on the old surface, and removed ones must end on the new
// one.
TYPED_TEST(Geomorphs, StartsOnTheOldSurfaceAndEndsOnTheNew) {
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

TYPED_TEST(Geomorphs, CollapseMirrorsExpand) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    World world(seed, seed % 3 ? Shape::random : Shape::duplicates, 200);
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Model<TypeParam> model(world.source, {}, {.deltas = true, .old_heights = true});
    std::vector<ClusterId> children;
    model.children(cluster_id(world.source.top(), 0), children);
    if (children.empty()) continue;
    const ClusterId id = children[below(world.random, children.size())];
    Geomorph2<TypeParam> expanded, collapsed;
    expanded.make(model, model.expand(id));
    collapsed.make(model, model.collapse(id));
    const auto by_place = [](const Slides& slides) {
      std::map<std::pair<double, double>, std::pair<double, double>> result;
      for (std::size_t i = 0; i < slides.size(); ++i) {
        result[{slides.start[i][0], slides.start[i][1]}] = {slides.start[i][2], slides.end[i][2]};
      }
      return result;
    };
    const auto forth = by_place(expanded.added), again = by_place(reversed(collapsed.removed));
    ASSERT_EQ(forth.size(), again.size());
    for (const auto& [place, heights] : forth) {
      ASSERT_EQ(again.at(place).second, heights.second);
      // The same triangle with its corners in another order.
      ASSERT_NEAR(again.at(place).first, heights.first, 1e-9 * (1.0 + std::abs(heights.first)));
    }
    ASSERT_EQ(by_place(expanded.reassigned), by_place(reversed(collapsed.reassigned)));
    ASSERT_EQ(expanded.removed.size() + collapsed.added.size(), 0u);
  }
}

// Reports the former height of a vertex even if its slot was reused in the same step.
TYPED_TEST(Geomorphs, CombinesStepsOfManyOperations) {
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

// ---- In space ---------------------------------------------------------------------------------

using Facet = std::array<Point3, 3>;

long double squared(const Point3& a, const Point3& b) {
  long double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const long double d = static_cast<long double>(a[k]) - b[k];
    sum += d * d;
  }
  return sum;
}

/// The squared distance to a triangle, which may be flat: to its plane if the foot is inside, else
/// to its nearest edge.
long double squared(const Facet& facet, const Point3& p) {
  using Vector = std::array<long double, 3>;
  const auto from = [&](const Point3& a, const Point3& b) {
    return Vector{static_cast<long double>(b[0]) - a[0], static_cast<long double>(b[1]) - a[1],
                  static_cast<long double>(b[2]) - a[2]};
  };
  const auto dot = [](const Vector& u, const Vector& v) {
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  };
  const auto cross = [](const Vector& u, const Vector& v) {
    return Vector{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  };
  long double least = std::numeric_limits<long double>::infinity();
  const Vector normal = cross(from(facet[0], facet[1]), from(facet[0], facet[2]));
  bool inside = dot(normal, normal) > 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Point3 &a = facet[i], &b = facet[(i + 1) % 3];
    const Vector edge = from(a, b), to = from(a, p);
    inside = inside && dot(normal, cross(edge, to)) >= 0;
    const long double length = dot(edge, edge);
    const long double t = length > 0 ? std::clamp(dot(edge, to) / length, 0.0L, 1.0L) : 0.0L;
    const Vector offset{to[0] - t * edge[0], to[1] - t * edge[1], to[2] - t * edge[2]};
    least = std::min(least, dot(offset, offset));
  }
  if (inside) {
    const long double height = dot(normal, from(facet[0], p));
    least = std::min(least, height * height / dot(normal, normal));
  }
  return least;
}
long double squared(const std::vector<Facet>& facets, const Point3& p) {
  long double least = std::numeric_limits<long double>::infinity();
  for (const Facet& facet : facets) least = std::min(least, squared(facet, p));
  return least;
}

// Compares with all triangles of the part, which may be flat, coincide, or touch each other.
TEST(Patches, NearestPlaceAgreesWithBruteForce) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t parts = 1 + below(random, 4), range = seed % 3 ? 1 << 20 : 4;
    const auto place = [&] {
      Point3 p;
      for (double& c : p) c = static_cast<double>(below(random, range));
      return p;
    };
    std::vector<std::vector<Facet>> all(parts);
    Patches<3> patches, turned;
    for (std::size_t i = below(random, 80); i > 0; --i) {
      Facet f{place(), place(), place()};
      if (below(random, 6) == 0) f[2] = f[below(random, 2)];
      const std::size_t part = below(random, parts);
      all[part].push_back(f);
      patches.add(static_cast<std::uint32_t>(part), f[0], f[1], f[2]);
    }
    for (std::size_t part = 0; part < parts; ++part) {
      for (auto f = all[part].rbegin(); f != all[part].rend(); ++f)
        turned.add(static_cast<std::uint32_t>(part), (*f)[0], (*f)[1], (*f)[2]);
    }
    patches.build(parts);
    turned.build(parts);
    for (int i = 0; i < 200; ++i) {
      const auto part = static_cast<std::uint32_t>(below(random, parts));
      Point3 p = place();
      if (!all[part].empty() && below(random, 4) == 0) p = all[part][0][below(random, 3)];
      const auto found = patches.find(part, p);
      ASSERT_EQ(found.has_value(), !all[part].empty());
      if (!found) continue;
      const long double best = squared(all[part], p), scale = static_cast<double>(range * range);
      ASSERT_NEAR(static_cast<double>(squared(found->place, p) - best), 0.0,
                  static_cast<double>(1e-12L * scale));
      ASSERT_LE(squared(all[part], found->place), 1e-18L * scale) << "not on a triangle";
      if (range == 4) continue;  // equally near ones may differ in rounding
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_NEAR(turned.find(part, p)->place[k], found->place[k], 1e-6)
            << "it depends on the order";
    }
  }
}

/// All triangles of a surface by the positions of their corners, starting at the smallest.
template <class Coord>
std::multiset<Facet> facets_of(const DynamicSurface<Coord>& surface) {
  std::multiset<Facet> all;
  for (const TriangleId t : surface.all_triangles()) {
    Facet f;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto p = surface.point(surface.vertices(t)[i]);
      f[i] = {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
    }
    std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
    all.insert(f);
  }
  return all;
}
std::set<Point3> places_of_corners(const std::multiset<Facet>& facets) {
  std::set<Point3> corners;
  for (const Facet& f : facets) corners.insert(f.begin(), f.end());
  return corners;
}
std::vector<Facet> difference(const std::multiset<Facet>& facets,
                              const std::multiset<Facet>& others) {
  std::vector<Facet> remaining;
  std::set_difference(facets.begin(), facets.end(), others.begin(), others.end(),
                      std::back_inserter(remaining));
  return remaining;
}

/// Checks which vertices joined `to` and where they started on `from`, by definition: tests all
/// triangles against all.
void check_came(const Slides& slides, const std::multiset<Facet>& from,
                const std::multiset<Facet>& to) {
  const std::set<Point3> before = places_of_corners(from), after = places_of_corners(to);
  std::set<Point3> came;
  std::set_difference(after.begin(), after.end(), before.begin(), before.end(),
                      std::inserter(came, came.end()));
  ASSERT_EQ(std::set<Point3>(slides.end.begin(), slides.end.end()), came);
  ASSERT_EQ(slides.size(), came.size());
  const std::vector<Facet> removed_facets = difference(from, to), fresh = difference(to, from);
  std::vector<Facet> changed = removed_facets;
  changed.insert(changed.end(), fresh.begin(), fresh.end());
  for (std::size_t i = 0; i < slides.size(); ++i) {
    // The connected part, found by moving from corner to corner.
    std::set<Point3> part{slides.end[i]};
    for (std::size_t size = 0; size != part.size();) {
      size = part.size();
      for (const Facet& f : changed) {
        if (part.count(f[0]) || part.count(f[1]) || part.count(f[2]))
          part.insert(f.begin(), f.end());
      }
    }
    std::vector<Facet> replaced;
    for (const Facet& f : removed_facets)
      if (part.count(f[0])) replaced.push_back(f);
    const Point3 &start = slides.start[i], &end = slides.end[i];
    if (replaced.empty()) {
      ASSERT_EQ(start, end);
      continue;
    }
    const long double best = squared(replaced, end);
    ASSERT_NEAR(static_cast<double>(squared(start, end)), static_cast<double>(best),
                1e-9 * (1.0 + static_cast<double>(best)));
    ASSERT_LE(squared(replaced, start), 1e-3L) << "not on a removed triangle";
  }
}

// Checks any step of a surface in space for the points that join it and leave it.
TYPED_TEST(Geomorphs, InSpaceStartsAtTheNearestRemovedTriangle) {
  using T = DynamicSurface<TypeParam>;
  std::size_t came = 0, left = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    World world = ball_world(seed, 500);
    ViewControl<T> control(counts(world.source), load_root(world.source));
    Geomorph<T> morph;
    for (int views = 0; views < 5; ++views) {
      const View view = world.view();
      for (int steps = 0; steps < 6; ++steps) {
        StepBudget budget;
        if (seed % 2 == 0) budget.operations = 1 + below(world.random, 4);
        const auto before = facets_of(control.model().triangulation());
        const auto& step = control.step(view, budget);
        const auto after = facets_of(control.model().triangulation());
        morph.make(control.model(), *step.delta);
        ASSERT_EQ(morph.reassigned.size(), 0u);
        ASSERT_NO_FATAL_FAILURE(check_came(morph.added, before, after));
        ASSERT_NO_FATAL_FAILURE(check_came(reversed(morph.removed), after, before));
        came += morph.added.size();
        left += morph.removed.size();
        morph.make(control.model(), *step.delta, false);
        ASSERT_EQ(morph.removed.size(), 0u);
        for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted))
          control.give(load(world.source, r));
      }
    }
  }
  EXPECT_GT(came, 500u);
  EXPECT_GT(left, 300u);
}

// If the surface returns to the same triangles, the slides must be reversed.
TYPED_TEST(Geomorphs, InSpaceCollapseMirrorsExpand) {
  using T = DynamicSurface<TypeParam>;
  std::size_t compared = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    World world = ball_world(seed, 400);
    MultiresolutionModel<T> model(world.source);
    std::vector<ClusterId> children;
    model.children(cluster_id(world.source.top(), 0), children);
    if (children.empty()) continue;
    const ClusterId id = children[below(world.random, children.size())];
    const auto start = facets_of(model.triangulation());
    Geomorph<T> expanded, collapsed;
    expanded.make(model, model.expand(id));
    collapsed.make(model, model.collapse(id));
    if (facets_of(model.triangulation()) != start) continue;
    const auto by_place = [](const Slides& slides) {
      std::map<Point3, Point3> moves;
      for (std::size_t i = 0; i < slides.size(); ++i) moves[slides.end[i]] = slides.start[i];
      return moves;
    };
    for (const auto& [one, other] :
         {std::pair{expanded.added, collapsed.removed},
          std::pair{reversed(expanded.removed), reversed(collapsed.added)}}) {
      const auto forth = by_place(one), again = by_place(reversed(other));
      ASSERT_EQ(forth.size(), again.size());
      for (const auto& [end, from] : forth) {
        ASSERT_TRUE(again.count(end));
        // The same triangle with its corners in another order.
        for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(again.at(end)[k], from[k], 1e-3);
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 100u);
}

/// The end of each anchor must be on its triangle, which must exist. Over the plane it is also on
/// `after`, at its x and y.
template <class T>
void check_anchors(const T& surface, const std::vector<Anchor>& anchors, const auto& height) {
  for (const Anchor& anchor : anchors) {
    if (anchor.on == kNoTriangle) {
      ASSERT_EQ(anchor.place, anchor.end);
      continue;
    }
    ASSERT_TRUE(surface.alive(anchor.on));
    Facet f;
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexId v = surface.vertices(anchor.on)[i];
      const auto p = surface.point(v);
      f[i] = {static_cast<double>(p[0]), static_cast<double>(p[1]), height(v)};
    }
    ASSERT_LE(squared(f, anchor.end), 1e-6L * (1 + squared(f[0], anchor.end)));
  }
}
void add_anchors(const auto& morph, std::vector<Anchor>& anchors) {
  ASSERT_EQ(morph.removed_on.size(), morph.removed.size());
  for (std::size_t i = 0; i < morph.removed.size(); ++i)
    anchors.push_back({morph.removed.start[i], morph.removed.end[i], morph.removed_on[i], false});
}

// Removed vertices must stay on the surface through all later steps.
TYPED_TEST(Geomorphs, AnchorsFollowTheSurface) {
  std::size_t moved = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    World world(seed, seed % 4 ? Shape::random : Shape::grid, 250);
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    ViewOptions options;
    options.model.old_heights = true;
    ViewControl<Delaunay2<TypeParam>> control(counts(world.source), load_root(world.source),
                                              options);
    const auto& surface = control.model().triangulation();
    Geomorph2<TypeParam> morph;
    std::vector<Anchor> anchors;
    for (int steps = 0; steps < 20; ++steps) {
      const auto& step = control.step(world.view());
      const std::vector<Anchor> before = anchors;
      morph.make(control.model(), *step.delta, true, anchors);
      const Surface<TypeParam> after(control.model());
      for (std::size_t i = 0; i < anchors.size(); ++i) {
        if (!anchors[i].moved) {
          ASSERT_EQ(anchors[i].end, before[i].end);
        }
        moved += anchors[i].moved;
        if (anchors[i].on == kNoTriangle) continue;
        const auto height = after.at(anchors[i].place);
        ASSERT_TRUE(height);
        ASSERT_NEAR(anchors[i].end[2], *height, 1e-5 * (1.0 + std::abs(*height)));
      }
      ASSERT_NO_FATAL_FAILURE(add_anchors(morph, anchors));
      ASSERT_NO_FATAL_FAILURE(
          check_anchors(surface, anchors, [&](VertexId v) { return control.model().height(v); }));
      for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted))
        control.give(load(world.source, r));
    }
  }
  EXPECT_GT(moved, 200u);
}
TYPED_TEST(Geomorphs, InSpaceAnchorsFollowTheSurface) {
  using T = DynamicSurface<TypeParam>;
  std::size_t moved = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    World world = ball_world(seed, 400);
    ViewControl<T> control(counts(world.source), load_root(world.source));
    const T& surface = control.model().triangulation();
    Geomorph<T> morph;
    std::vector<Anchor> anchors;
    for (int steps = 0; steps < 20; ++steps) {
      const auto& step = control.step(world.view());
      morph.make(control.model(), *step.delta, true, anchors);
      for (const Anchor& anchor : anchors) moved += anchor.moved;
      ASSERT_NO_FATAL_FAILURE(add_anchors(morph, anchors));
      ASSERT_NO_FATAL_FAILURE(check_anchors(
          surface, anchors, [&](VertexId v) { return static_cast<double>(surface.point(v)[2]); }));
      for (const ViewRequest& r : std::vector<ViewRequest>(step.wanted))
        control.give(load(world.source, r));
    }
  }
  EXPECT_GT(moved, 100u);
}

// The connected parts, found by moving from corner to corner of all triangles that the step
// exchanged.
TYPED_TEST(Geomorphs, PartsConsistOfTouchingTriangles) {
  using T = DynamicSurface<TypeParam>;
  std::size_t several = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    World world = ball_world(seed, 500);
    MultiresolutionModel<T> model(world.source);
    model.set_level(0);
    Geomorph<T> morph;
    for (int steps = 0; steps < 6; ++steps) {
      const std::vector<ClusterId> open = model.expanded();
      model.open_step();
      for (int i = 0; i < 3 && !open.empty(); ++i) {
        const ClusterId id = open[below(world.random, open.size())];
        if (model.is_expanded(id)) model.collapse(id);
      }
      const auto& delta = model.close_step();
      morph.make(model, delta);
      // Corners by their position: those of removed triangles from the lists, others from the
      // surface.
      std::map<VertexId, Point3> removed_points;
      for (std::size_t i = 0; i < delta.changes.removed_vertices.size(); ++i) {
        const auto& p = delta.changes.removed_points[i];
        removed_points[delta.changes.removed_vertices[i]] = {
            static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
      }
      const auto place = [&](VertexId v, bool before) -> Point3 {
        if (before && removed_points.count(v)) return removed_points.at(v);
        const auto p = model.triangulation().point(v);
        return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
      };
      std::vector<std::pair<Facet, std::uint32_t>> facets;
      const auto add = [&](const std::array<VertexId, 3>& c, bool before, std::uint32_t part) {
        facets.push_back({{place(c[0], before), place(c[1], before), place(c[2], before)}, part});
      };
      for (std::size_t i = 0; i < delta.changes.removed_corners.size(); ++i)
        add(delta.changes.removed_corners[i], true, morph.parts.removed_triangles[i]);
      for (std::size_t i = 0; i < delta.changes.added_triangles.size(); ++i) {
        add(model.triangulation().vertices(delta.changes.added_triangles[i]), false,
            morph.parts.added_triangles[i]);
      }
      std::map<Point3, std::uint32_t> part_of;
      for (const auto& [f, part] : facets) {
        ASSERT_LT(part, morph.parts.count);
        for (const Point3& corner : f) {
          const auto [at, first] = part_of.emplace(corner, part);
          ASSERT_TRUE(first || at->second == part) << "two parts touch";
        }
      }
      // All triangles of a part must be reachable from one of them.
      std::map<std::uint32_t, std::set<Point3>> reached;
      for (std::size_t change = 1; change > 0;) {
        change = 0;
        for (const auto& [f, part] : facets) {
          std::set<Point3>& corners = reached[part];
          if (!corners.empty() && !corners.count(f[0]) && !corners.count(f[1]) &&
              !corners.count(f[2])) {
            continue;
          }
          for (const Point3& corner : f) change += corners.insert(corner).second;
        }
      }
      for (const auto& [corner, part] : part_of) ASSERT_TRUE(reached.at(part).count(corner));
      several += reached.size() > 1;
    }
  }
  EXPECT_GT(several, 0u);
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
