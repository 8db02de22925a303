// SPDX-License-Identifier: Apache-2.0
// Properties that hold for any points: the definition of the rules, independence of order and
// history, and the update.
#include <random>

#include <gtest/gtest.h>

#include "points3.hpp"
#include "shape_oracle.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri {
namespace {

std::vector<ShapeOptions> peeling_options() {
  std::vector<ShapeOptions> result;
  for (const auto criterion : {ShapeCriterion::gabriel, ShapeCriterion::edge_length})
    for (const auto rule : {ShapeRule::flood, ShapeRule::published})
      for (const bool keep_vertices : {false, true})
        result.push_back({rule, criterion, 0.55, keep_vertices});
  return result;
}

std::vector<ShapeOptions> all_options() {
  std::vector<ShapeOptions> result = peeling_options();
  result.push_back({});  // the poles rule, whose definition is tested in poles_test.cpp
  return result;
}

std::string name(const ShapeOptions& options) {
  if (options.rule == ShapeRule::poles) return "poles";
  return std::string(options.criterion == ShapeCriterion::gabriel ? "Gabriel" : "edge length") +
         (options.rule == ShapeRule::flood ? ", flood" : ", published") +
         (options.keep_vertices ? ", no vertex lost" : "");
}

/// The edge lengths of huge and tiny points differ from the oracle's in the last bit, and their
/// ties are frequent.
bool comparable(PointSet3 kind, const ShapeOptions& options) {
  return options.criterion == ShapeCriterion::gabriel || kind == PointSet3::uniform ||
         kind == PointSet3::full_range;
}

template <class Coord>
class ShapeLawTest : public ::testing::Test {};
using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(ShapeLawTest, Coords);

TYPED_TEST(ShapeLawTest, EqualsTheDefinition) {
  for (const PointSet3 kind : kPointSets3) {
    for (const std::size_t count : {0u, 3u, 4u, 5u, 8u, 20u, 60u}) {
      if (kind == PointSet3::curves && count > 20) continue;
      Delaunay3<TypeParam> triangulation;
      triangulation.build(make_points3<TypeParam>(kind, count, 5 + count));
      for (const ShapeOptions& options : peeling_options()) {
        if (!comparable(kind, options)) continue;
        SCOPED_TRACE(terrace::tri::name(kind) + " " + std::to_string(count) + ", " + name(options));
        const ShapeOracle oracle(triangulation, options);
        Shape3<TypeParam> shape(options);
        shape.restore(triangulation);
        ASSERT_EQ(kept_set(triangulation, shape), oracle.kept);
        ASSERT_EQ(shape.kept_count(), oracle.kept.size());
        ASSERT_EQ(shape.kept_tetrahedra().size(), oracle.kept.size());
        ASSERT_EQ(shape.lost_vertices().size(), oracle.lost.size());
      }
    }
  }
}

TYPED_TEST(ShapeLawTest, NoVertexIsLost) {
  for (const PointSet3 kind : kPointSets3) {
    Delaunay3<TypeParam> triangulation;
    triangulation.build(make_points3<TypeParam>(kind, kind == PointSet3::curves ? 60 : 1000, 8));
    if (triangulation.tetrahedron_count() == 0) continue;
    for (ShapeOptions options : peeling_options()) {
      // With such a small factor only the guard keeps anything.
      options.edge_factor = 1e-12;
      SCOPED_TRACE(terrace::tri::name(kind) + ", " + name(options));
      Shape3<TypeParam> shape(options);
      shape.restore(triangulation);
      std::set<VertexId> used;
      for (const TetrahedronId t : shape.kept_tetrahedra())
        for (const VertexId v : triangulation.vertices(t)) used.insert(v);
      if (options.keep_vertices) {
        EXPECT_EQ(used.size(), triangulation.vertex_count());
      } else {
        EXPECT_EQ(used.size() + shape.lost_vertices().size(), triangulation.vertex_count());
        if (options.criterion == ShapeCriterion::edge_length) {
          EXPECT_EQ(used.size(), 0u);
        }
      }
    }
  }
}

TYPED_TEST(ShapeLawTest, DependsOnThePointsAlone) {
  for (const PointSet3 kind : kPointSets3) {
    std::mt19937_64 random(3);
    auto points = make_points3<TypeParam>(kind, kind == PointSet3::curves ? 60 : 300, 9);
    Delaunay3<TypeParam> built;
    built.build(points);
    for (int round = 0; round < 2; ++round) {
      // Another order, and a history with temporary points.
      std::shuffle(points.begin(), points.end(), random);
      Delaunay3<TypeParam> grown;
      for (const auto& p : make_points3<TypeParam>(PointSet3::five_bits, 40, 77)) grown.insert(p);
      std::vector<VertexId> temporary;
      for (const VertexId v : grown.all_vertices()) temporary.push_back(v);
      const std::size_t half = points.size() / 2;
      grown.insert(std::span(points).first(half), {});
      std::set<std::array<TypeParam, 3>> final_points(points.begin(), points.end());
      std::erase_if(temporary, [&](VertexId v) { return final_points.contains(grown.point(v)); });
      grown.remove(temporary);
      grown.insert(std::span(points).subspan(half), {});
      ASSERT_EQ(grown.hash(), built.hash());
      for (const ShapeOptions& options : all_options()) {
        SCOPED_TRACE(terrace::tri::name(kind) + ", " + name(options));
        Shape3<TypeParam> one(options), other(options);
        one.restore(built);
        other.restore(grown);
        ASSERT_EQ(kept_set(built, one), kept_set(grown, other));
      }
    }
  }
}

TEST(ShapeTest, IntegersAndDoublesGiveTheSame) {
  for (const PointSet3 kind : kPointSets3) {
    const auto points = make_points3<std::int32_t>(kind, kind == PointSet3::curves ? 60 : 500, 4);
    std::vector<std::array<double, 3>> doubles;
    for (const auto& p : points)
      doubles.push_back(
          {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
    Delaunay3<std::int32_t> integer_mesh;
    integer_mesh.build(points);
    Delaunay3<double> double_mesh;
    double_mesh.build(doubles);
    for (const ShapeOptions& options : all_options()) {
      SCOPED_TRACE(terrace::tri::name(kind) + ", " + name(options));
      Shape3<std::int32_t> one(options);
      one.restore(integer_mesh);
      Shape3<double> other(options);
      other.restore(double_mesh);
      ASSERT_EQ(kept_set(integer_mesh, one), kept_set(double_mesh, other));
    }
  }
}

TYPED_TEST(ShapeLawTest, UpdateEqualsRestore) {
  using Triangulation = Delaunay3<TypeParam>;
  for (const PointSet3 kind : kPointSets3) {
    for (std::uint64_t seed = 0; seed < 2; ++seed) {
      SCOPED_TRACE(terrace::tri::name(kind) + " seed " + std::to_string(seed));
      std::mt19937_64 random(seed);
      const auto points =
          make_points3<TypeParam>(kind, kind == PointSet3::curves ? 30 : 200, seed + 40);
      Triangulation triangulation;
      std::vector<Shape3<TypeParam>> shapes;
      for (const ShapeOptions& options : all_options()) {
        // Always computed from scratch, so one run is enough.
        if (options.rule == ShapeRule::published && shapes.size() != 2) continue;
        shapes.emplace_back(options);
      }
      triangulation.start_journal();
      typename Triangulation::Changes changes;
      for (int step = 0; step < 30; ++step) {
        // Sometimes combines several operations into one set of changes.
        do {
          std::vector<VertexId> alive;
          for (const VertexId v : triangulation.all_vertices()) alive.push_back(v);
          const std::uint64_t operation = random() % 20;
          if (operation == 0) {
            triangulation.clear();
          } else if (operation < 10 || alive.empty()) {
            const std::size_t begin = random() % points.size();
            const std::size_t count =
                std::min<std::size_t>(1 + random() % 50, points.size() - begin);
            triangulation.insert(std::span(points).subspan(begin, count), {});
          } else {
            std::shuffle(alive.begin(), alive.end(), random);
            const bool nearly_all = random() % 10 == 0;
            const std::size_t count =
                nearly_all ? alive.size() - random() % std::min<std::size_t>(alive.size(), 6)
                           : 1 + random() % std::min<std::size_t>(alive.size(), 20);
            triangulation.remove(std::span(alive).first(count));
          }
        } while (random() % 3 == 0);
        triangulation.take_changes(changes);
        for (auto& shape : shapes) {
          SCOPED_TRACE("step " + std::to_string(step) + ", " + name(shape.options()));
          shape.update(triangulation, changes);
          Shape3<TypeParam> restored(shape.options());
          restored.restore(triangulation);
          ASSERT_EQ(shape.kept_tetrahedra(), restored.kept_tetrahedra());
          ASSERT_EQ(shape.kept_count(), restored.kept_count());
          ASSERT_EQ(shape.lost_vertices(), restored.lost_vertices());
        }
      }
    }
  }
}

}  // namespace
}  // namespace terrace::tri
