// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/smoothing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

#include <gtest/gtest.h>

#include "points.hpp"

namespace terrace::tri {
namespace {

constexpr Smoothing kSmoothings[] = {Smoothing::laplacian, Smoothing::taubin, Smoothing::bilateral};

SmoothingOptions options_of(Smoothing method, unsigned iterations = 10) {
  SmoothingOptions options;
  options.method = method;
  options.iterations = iterations;
  options.edge_height = 1;
  return options;
}

template <class Coord>
std::vector<VertexId> all(const Delaunay2<Coord>& triangulation) {
  std::vector<VertexId> result;
  for (const VertexId v : triangulation.all_vertices()) result.push_back(v);
  return result;
}

/// Heights by slot from a function of x and y.
template <class Coord, class Function>
std::vector<double> heights_from(const Delaunay2<Coord>& triangulation, Function function) {
  std::vector<double> heights(triangulation.vertex_slots());
  for (const VertexId v : triangulation.all_vertices()) {
    const auto p = triangulation.point(v);
    heights[slot(v)] = function(static_cast<double>(p[0]), static_cast<double>(p[1]));
  }
  return heights;
}

template <class Coord>
std::vector<double> noise(const Delaunay2<Coord>& triangulation) {
  std::mt19937_64 random(9);
  return heights_from(triangulation, [&](double, double) { return to_unit(random()); });
}

std::vector<double> applied(std::vector<double> heights, const std::vector<HeightChange>& overlay) {
  for (const auto& [vertex, height] : overlay) heights[slot(vertex)] = height;
  return heights;
}

template <class Coord>
class SmoothingTest : public ::testing::Test {};
using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(SmoothingTest, Coords);

TYPED_TEST(SmoothingTest, ConstantsAndPlanesStay) {
  for (const PointSet kind : {PointSet::uniform, PointSet::few_bits, PointSet::grid}) {
    Delaunay2<TypeParam> triangulation;
    triangulation.build(make_points<TypeParam>(kind, 400, 1));
    double extent = 0;
    heights_from(triangulation, [&](double x, double) { return extent = std::max(extent, x); });
    for (const Smoothing method : kSmoothings) {
      SCOPED_TRACE(name(kind) + " method " + std::to_string(static_cast<int>(method)));
      const auto constant = heights_from(triangulation, [](double, double) { return 0.3; });
      const auto same = smooth(triangulation, constant, all(triangulation), options_of(method));
      EXPECT_GT(same.size(), kind == PointSet::few_bits ? 150u : 300u);
      for (const auto& change : same) ASSERT_EQ(change.height, 0.3);
      if (method == Smoothing::bilateral && kind != PointSet::grid) continue;
      const auto plane = heights_from(
          triangulation, [&](double x, double y) { return 3 * x / extent - 5 * y / extent; });
      for (const auto& change :
           smooth(triangulation, plane, all(triangulation), options_of(method)))
        ASSERT_NEAR(change.height, plane[slot(change.vertex)], 1e-12);
    }
  }
}

TYPED_TEST(SmoothingTest, MovesOnlyInnerVerticesOfTheRegion) {
  Delaunay2<TypeParam> triangulation;
  triangulation.build_grid(0, 0, 5, 20, 20);
  const auto heights = noise(triangulation);
  for (const Box3& box : {box2(20, 30, 60, 70), box2(-10, -10, 50, 1000), box2(7, 7, 8, 8)}) {
    const std::vector<VertexId> region = vertices_in(triangulation, box);
    const auto in_region = [&](VertexId v) {
      return std::find(region.begin(), region.end(), v) != region.end();
    };
    for (const VertexId v : all(triangulation)) {
      const auto p = triangulation.point(v);
      ASSERT_EQ(in_region(v), box.min[0] <= p[0] && p[0] <= box.max[0] && box.min[1] <= p[1] &&
                                  p[1] <= box.max[1]);
    }
    std::vector<VertexId> expected;
    std::vector<VertexId> neighbours;
    for (const VertexId v : region) {
      const auto p = triangulation.point(v);
      triangulation.adjacent(v, neighbours);
      if (p[0] > 0 && p[1] > 0 && p[0] < 95 && p[1] < 95 &&
          std::all_of(neighbours.begin(), neighbours.end(), in_region))
        expected.push_back(v);
    }
    for (const Smoothing method : kSmoothings) {
      std::vector<VertexId> moved;
      for (const auto& change : smooth(triangulation, heights, region, options_of(method)))
        moved.push_back(change.vertex);
      EXPECT_EQ(moved, expected);
    }
  }
}

TYPED_TEST(SmoothingTest, LaplacianAndBilateralObeyTheMaximumPrinciple) {
  for (const PointSet kind : kPointSets) {
    SCOPED_TRACE(name(kind));
    Delaunay2<TypeParam> triangulation;
    triangulation.build(make_points<TypeParam>(kind, 300, 2));
    const auto heights = noise(triangulation);
    for (const Smoothing method : {Smoothing::laplacian, Smoothing::bilateral}) {
      for (const double strength : {0.5, 1.0}) {
        SmoothingOptions options = options_of(method, 30);
        options.strength = strength;
        for (const auto& change : smooth(triangulation, heights, all(triangulation), options)) {
          ASSERT_GE(change.height, 0);
          ASSERT_LE(change.height, 1);
        }
      }
    }
  }
}

TYPED_TEST(SmoothingTest, LaplacianStepIsTheWeightedMean) {
  // On a grid the neighbours along the axes have a weight of a quarter each, the diagonal ones
  // none.
  Delaunay2<TypeParam> triangulation;
  triangulation.build_grid(0, 0, 3, 9, 9);
  const auto heights = noise(triangulation);
  SmoothingOptions options = options_of(Smoothing::laplacian, 1);
  options.strength = 0.75;
  const auto changes = smooth(triangulation, heights, all(triangulation), options);
  ASSERT_EQ(changes.size(), 49u);
  std::map<std::array<TypeParam, 2>, double> at;
  for (const VertexId v : all(triangulation)) at[triangulation.point(v)] = heights[slot(v)];
  for (const auto& [vertex, height] : changes) {
    const auto [x, y] = triangulation.point(vertex);
    const TypeParam s = 3;
    const double mean = (at[{x - s, y}] + at[{x + s, y}] + at[{x, y - s}] + at[{x, y + s}]) / 4;
    ASSERT_NEAR(height, 0.25 * heights[slot(vertex)] + 0.75 * mean, 1e-14);
  }
}

TYPED_TEST(SmoothingTest, TaubinKeepsWideFeaturesAndRemovesRoughness) {
  Delaunay2<TypeParam> triangulation;
  triangulation.build_grid(0, 0, 1, 65, 65);
  const auto wave = [&](double length) {
    return heights_from(triangulation, [=](double x, double) {
      return std::sin(x * 2 * 3.14159265358979323846 / length);
    });
  };
  // The amplitude on the middle row, away from the border, which stays.
  const auto amplitude = [&](double length, Smoothing method) {
    const auto heights = wave(length);
    const auto result = applied(
        heights, smooth(triangulation, heights, all(triangulation), options_of(method, 40)));
    double largest = 0;
    for (TypeParam x = 24; x <= 40; ++x)
      largest = std::max(largest, std::abs(result[slot(triangulation.nearest({x, 32}))]));
    return largest;
  };
  EXPECT_GT(amplitude(32, Smoothing::taubin), 0.97);
  EXPECT_LT(amplitude(32, Smoothing::taubin), 1.1);
  EXPECT_LT(amplitude(32, Smoothing::laplacian), 0.85);
  EXPECT_LT(amplitude(3, Smoothing::taubin), 0.01);
  EXPECT_LT(amplitude(3, Smoothing::laplacian), 0.01);
}

TYPED_TEST(SmoothingTest, BilateralKeepsAStepThatTheLaplacianLoses) {
  Delaunay2<TypeParam> triangulation;
  triangulation.build_grid(0, 0, 1, 40, 40);
  std::mt19937_64 random(3);
  const auto heights = heights_from(triangulation, [&](double x, double) {
    return (x < 20 ? 0.0 : 10.0) + 0.2 * (to_unit(random()) - 0.5);
  });
  const auto result = [&](Smoothing method) {
    return applied(heights,
                   smooth(triangulation, heights, all(triangulation), options_of(method, 20)));
  };
  const auto bilateral = result(Smoothing::bilateral);
  const auto laplacian = result(Smoothing::laplacian);
  for (TypeParam y = 10; y < 30; ++y) {
    const std::uint32_t low = slot(triangulation.nearest({19, y}));
    const std::uint32_t high = slot(triangulation.nearest({20, y}));
    EXPECT_GT(bilateral[high] - bilateral[low], 9.9);
    EXPECT_LT(laplacian[high] - laplacian[low], 4);
  }
  // The noise must be gone.
  for (TypeParam x = 5; x < 15; ++x)
    EXPECT_LT(std::abs(bilateral[slot(triangulation.nearest({x, 20}))]), 0.05);
}

TYPED_TEST(SmoothingTest, OrderAndRepetitionInTheRegionDoNotMatter) {
  Delaunay2<TypeParam> triangulation;
  triangulation.build(make_points<TypeParam>(PointSet::uniform, 500, 4));
  const auto heights = noise(triangulation);
  std::vector<VertexId> region = all(triangulation);
  const auto expected = smooth(triangulation, heights, region, options_of(Smoothing::taubin));
  std::mt19937_64 random(1);
  std::shuffle(region.begin(), region.end(), random);
  region.push_back(region[7]);
  const auto other = smooth(triangulation, heights, region, options_of(Smoothing::taubin));
  ASSERT_EQ(other.size(), expected.size());
  for (std::size_t i = 0; i < other.size(); ++i) {
    ASSERT_EQ(other[i].vertex, expected[i].vertex);
    ASSERT_EQ(other[i].height, expected[i].height);
  }
}

TEST(Smoothing, HandlesEmptyInput) {
  Delaunay2<double> triangulation;
  const std::vector<double> one(triangulation.vertex_slots());
  EXPECT_TRUE(smooth(triangulation, one, {}, {}).empty());
  triangulation.build(make_points<double>(PointSet::slanted, 50, 1));
  const auto heights = noise(triangulation);
  EXPECT_TRUE(smooth(triangulation, heights, all(triangulation), {}).empty());
}

TEST(Smoothing, RefusesBadData) {
  Delaunay2<std::int32_t> triangulation;
  triangulation.build_grid(0, 0, 1, 5, 5);
  std::vector<double> heights(triangulation.vertex_slots(), 1.0);
  const auto refused = [&](auto change) {
    SmoothingOptions options = options_of(Smoothing::taubin);
    change(options);
    EXPECT_THROW(smooth(triangulation, heights, all(triangulation), options),
                 std::invalid_argument);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double strength : {0.0, -0.5, 1.5, nan, 0.9})
    refused([&](SmoothingOptions& o) { o.strength = strength; });
  for (const double pass_band : {0.0, -0.5, 1.0, nan})
    refused([&](SmoothingOptions& o) { o.pass_band = pass_band; });
  for (const double edge_height : {0.0, -1.0, nan}) {
    refused([&](SmoothingOptions& o) {
      o.method = Smoothing::bilateral;
      o.edge_height = edge_height;
    });
  }
  heights[slot(triangulation.nearest({2, 2}))] = nan;
  refused([](SmoothingOptions&) {});
  heights.resize(3);
  refused([](SmoothingOptions&) {});
}

}  // namespace
}  // namespace terrace::tri
