// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "delaunay3/elliptical_kernel.hpp"
#include "delaunay3/predicates.hpp"
#include "metrics3.hpp"
#include "points3.hpp"
#include "terrace/tri/metric.hpp"

namespace terrace::tri::test {
namespace {

using spatial::EllipticalKernel;

/// Three boxes with different ellipsoids within the bounding box of the points, two of them
/// overlapping.
template <class Coord>
MetricField3 three_spatial_regions(const std::vector<std::array<Coord, 3>>& points) {
  Space low{}, high{};
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = high[k] = static_cast<double>(points[0][k]);
    for (const auto& p : points) {
      low[k] = std::min(low[k], static_cast<double>(p[k]));
      high[k] = std::max(high[k], static_cast<double>(p[k]));
    }
  }
  const auto box = [&](const Space& from, const Space& to) {
    Box3 result;
    for (std::size_t k = 0; k < 3; ++k) {
      result.min[k] = low[k] + (high[k] - low[k]) * from[k];
      result.max[k] = low[k] + (high[k] - low[k]) * to[k];
    }
    return result;
  };
  return MetricField3({{box({0, 0, 0}, {0.5, 0.7, 1}), ellipsoid_map({5, 1, 2}, rotations()[3])},
                       {box({0.4, 0, 0}, {1, 0.7, 0.6}), ellipsoid_map({1, 1, 3})},
                       {box({0.1, 0.7, 0}, {1, 1, 1}), ellipsoid_map({1, 2, 1}, rotations()[4])}});
}

/// Tetrahedra by their points, in order, with the corners in any rotation.
template <class Triangulation>
std::vector<Corners3> corners_of_all(const Triangulation& triangulation,
                                     const std::vector<std::array<VertexId, 4>>& tetrahedra) {
  std::vector<Corners3> result;
  for (const auto& vertices : tetrahedra) {
    Corners3 t;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto p = triangulation.point(vertices[i]);
      for (std::size_t k = 0; k < 3; ++k) t[i][k] = static_cast<double>(p[k]);
    }
    result.push_back(t);
  }
  return result;
}

std::vector<Corners3> sorted(std::vector<Corners3> tetrahedra) {
  for (Corners3& t : tetrahedra) std::sort(t.begin(), t.end());
  std::sort(tetrahedra.begin(), tetrahedra.end());
  return tetrahedra;
}

template <class Triangulation>
std::vector<Corners3> own_tetrahedra(const Triangulation& triangulation) {
  std::vector<std::array<VertexId, 4>> all;
  for (const TetrahedronId t : triangulation.all_tetrahedra())
    all.push_back(triangulation.vertices(t));
  return corners_of_all(triangulation, all);
}

Rational volume(const std::vector<Corners3>& tetrahedra) {
  Rational sum = 0;
  for (const Corners3& t : tetrahedra)
    sum += determinant(exact_difference(t[1], t[0]), exact_difference(t[2], t[0]),
                       exact_difference(t[3], t[0]));
  return sum;
}

using Facet = std::array<Space, 3>;
using SpaceEdge = std::array<Space, 2>;
/// The corners in ascending order, and whether sorting them took an odd number of swaps.
std::pair<Facet, bool> directed(Facet facet) {
  bool odd = false;
  for (const auto& [i, k] : {std::pair(0u, 1u), std::pair(1u, 2u), std::pair(0u, 1u)}) {
    if (facet[k] < facet[i]) {
      std::swap(facet[i], facet[k]);
      odd = !odd;
    }
  }
  return {facet, odd};
}

class Check {
 public:
  Check(const std::vector<Corners3>& before, const std::vector<Corners3>& after,
        const MetricField3& field)
      : before_(before), after_(after), field_(field) {}

  /// Checks all guarantees. Returns the number of tetrahedra that did not exist before.
  std::size_t run(std::size_t stuck, const LinearMap3& given) {
    is_a_tetrahedralisation();
    const auto old_corners = sorted(before_), new_corners = sorted(after_);
    const auto mixed = [&](const std::vector<Corners3>& all) {
      std::vector<Corners3> result;
      for (const Corners3& t : all)
        if (field_(t[0]) != field_(t[1]) || field_(t[0]) != field_(t[2]) ||
            field_(t[0]) != field_(t[3]))
          result.push_back(t);
      return result;
    };
    EXPECT_TRUE(mixed(old_corners) == mixed(new_corners)) << "something changed where regions meet";
    EXPECT_EQ(facets_not_delaunay(), stuck);
    std::size_t changed = 0;
    for (const Corners3& t : new_corners) {
      if (std::binary_search(old_corners.begin(), old_corners.end(), t)) continue;
      ++changed;
      EXPECT_NE(field_(t[0]), given);
    }
    return changed;
  }

 private:
  /// Volumes must be positive, every facet must be in two tetrahedra from opposite sides or in one,
  /// and the sum of volumes and the corners must be the same. The hull is then covered once.
  void is_a_tetrahedralisation() {
    std::set<Space> corners_before, corners_after;
    for (const Corners3& t : before_) corners_before.insert(t.begin(), t.end());
    for (std::size_t n = 0; n < after_.size(); ++n) {
      const Corners3& t = after_[n];
      corners_after.insert(t.begin(), t.end());
      EXPECT_GT(EllipticalKernel::orientation(t[0], t[1], t[2], t[3]), 0);
      for (std::size_t i = 0; i < 4; ++i) {
        const auto& f = spatial::kFacet[i];
        const auto [facet, odd] = directed({t[f[0]], t[f[1]], t[f[2]]});
        EXPECT_TRUE(facets_[facet].try_emplace(odd, n, i).second)
            << "a facet has two tetrahedra on one side";
        for (std::size_t k = i + 1; k < 4; ++k)
          edges_[{std::min(t[i], t[k]), std::max(t[i], t[k])}].push_back(n);
      }
    }
    EXPECT_TRUE(corners_before == corners_after);
    EXPECT_TRUE(volume(before_) == volume(after_));
  }

  [[nodiscard]] bool in_region(std::size_t n, const LinearMap3& map) const {
    for (const Space& p : after_[n])
      if (field_(p) != map) return false;
    return true;
  }

  std::size_t facets_not_delaunay() {
    std::size_t count = 0;
    for (const auto& [facet, sides] : facets_) {
      if (sides.size() < 2) continue;
      const auto [one, i] = sides.at(false);
      const auto [other, k] = sides.at(true);
      const LinearMap3 map = field_(facet[0]);
      if (!in_region(one, map) || !in_region(other, map)) continue;
      const auto& form = forms_.try_emplace(map, map).first->second;
      const EllipticalKernel::Scope scope(form);
      const Corners3& t = after_[one];
      const Space &d = t[i], &e = after_[other][k];
      const int side = in_ellipsoid(map, t, e);
      const bool inside =
          side > 0 || (side == 0 && spatial::inside_perturbed_sphere<EllipticalKernel>(
                                        t[0], t[1], t[2], t[3], e));
      if (!inside) continue;
      ++count;
      EXPECT_FALSE(can_be_flipped(facet, d, e, map));
    }
    return count;
  }

  /// Depends on the number of tetrahedra around the edge that is in the way.
  [[nodiscard]] bool can_be_flipped(const Facet& facet, const Space& d, const Space& e,
                                    const LinearMap3& map) const {
    std::size_t in_the_way = 0;
    bool can = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const Space &a = facet[(k + 1) % 3], &b = facet[(k + 2) % 3], &c = facet[k];
      const int orientation_e = EllipticalKernel::orientation(d, a, b, e);
      const int orientation_c = EllipticalKernel::orientation(d, a, b, c);
      if (orientation_e == orientation_c) continue;
      ++in_the_way;
      const auto& ring = edges_.at({std::min(a, b), std::max(a, b)});
      for (const std::size_t n : ring) can = can && in_region(n, map);
      if (orientation_e != 0) {
        can = can && ring.size() == 3;
      } else {
        // Closed around the edge, or both outer facets are on the hull and coplanar.
        can = can && (ring.size() == 4 ||
                      (ring.size() == 2 && facets_.at(directed({a, b, d}).first).size() == 1 &&
                       facets_.at(directed({a, b, e}).first).size() == 1));
      }
    }
    return in_the_way == 0 || (in_the_way == 1 && can);
  }

  const std::vector<Corners3>& before_;
  const std::vector<Corners3>& after_;
  const MetricField3& field_;
  std::map<Facet, std::map<bool, std::pair<std::size_t, std::size_t>>> facets_;
  std::map<SpaceEdge, std::vector<std::size_t>> edges_;
  std::map<LinearMap3, spatial::QuadraticForm> forms_;
};

template <class Coord>
class MetricTetrahedraTest : public ::testing::Test {};
using CoordTypes = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(MetricTetrahedraTest, CoordTypes);

TYPED_TEST(MetricTetrahedraTest, KeepTheGuarantees) {
  for (const PointSet3 kind : kPointSets3) {
    for (const std::size_t count : {1u, 4u, 20u, 200u}) {
      if (kind == PointSet3::curves && count > 20) continue;
      SCOPED_TRACE(name(kind) + " " + std::to_string(count));
      const auto points = make_points3<TypeParam>(kind, count, 41);
      Delaunay3<TypeParam> triangulation;
      triangulation.build(points);
      const MetricField3 field = three_spatial_regions(points);
      const MetricTetrahedra result = metric_tetrahedra(triangulation, field);
      const auto before = own_tetrahedra(triangulation);
      const auto after = corners_of_all(triangulation, result.tetrahedra);
      const std::size_t changed = Check(before, after, field).run(result.stuck, kIdentityMap<3>);
      if (kind == PointSet3::uniform && count == 200) {
        EXPECT_GT(changed, 100u);
      }
      if (this->HasFailure()) return;
    }
  }
}

TYPED_TEST(MetricTetrahedraTest, DependOnThePointsAlone) {
  for (const PointSet3 kind : kPointSets3) {
    if (kind == PointSet3::curves) continue;
    SCOPED_TRACE(name(kind));
    auto points = make_points3<TypeParam>(kind, 200, 42);
    const MetricField3 field = three_spatial_regions(points);
    Delaunay3<TypeParam> one;
    one.build(points);
    const MetricTetrahedra expected = metric_tetrahedra(one, field);
    // Another order, and temporary points.
    std::mt19937_64 random(7);
    std::shuffle(points.begin(), points.end(), random);
    Delaunay3<TypeParam> other;
    std::vector<VertexId> guests;
    const auto other_points = make_points3<TypeParam>(kind, 100, 43);
    for (std::size_t i = 0; i < other_points.size(); ++i) {
      other.insert(points[2 * i]);
      if (const auto [v, created] = other.insert(other_points[i]); created) guests.push_back(v);
    }
    other.remove(std::span<const VertexId>(guests));
    for (const auto& p : points) other.insert(p);
    const MetricTetrahedra result = metric_tetrahedra(other, field);
    ASSERT_TRUE(sorted(corners_of_all(other, result.tetrahedra)) ==
                sorted(corners_of_all(one, expected.tetrahedra)));
    ASSERT_EQ(result.stuck, expected.stuck);
    ASSERT_EQ(result.flips, expected.flips);
  }
}

TYPED_TEST(MetricTetrahedraTest, OfOneMetricEqualTheEllipticalTriangulation) {
  std::vector<LinearMap3> maps = lower_maps3();
  maps.push_back(ellipsoid_map({7, 1, 2}, rotations()[3]));
  for (const PointSet3 kind : kPointSets3) {
    for (std::size_t m = 0; m < maps.size(); ++m) {
      SCOPED_TRACE(name(kind) + " map " + std::to_string(m));
      const auto points = make_points3<TypeParam>(kind, 150, 44);
      Delaunay3<TypeParam> triangulation;
      triangulation.build(points);
      std::vector<Space> doubles;
      for (const auto& p : points)
        doubles.push_back(
            {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
      Elliptical3 elliptical(maps[m]);
      elliptical.build(doubles);
      const MetricField3 everywhere([&](const Space&) { return maps[m]; });
      const MetricTetrahedra result = metric_tetrahedra(triangulation, everywhere);
      ASSERT_EQ(result.stuck, 0u);
      ASSERT_TRUE(sorted(corners_of_all(triangulation, result.tetrahedra)) ==
                  tetrahedra_of(elliptical));
      // And back again.
      const MetricField3 none(std::vector<MetricField3::Region>{});
      ASSERT_TRUE(
          sorted(corners_of_all(elliptical, metric_tetrahedra(elliptical, none).tetrahedra)) ==
          tetrahedra_of(triangulation));
    }
  }
}

TEST(MetricTetrahedra3, AlsoStartFromAnEllipticalTriangulation) {
  const auto points = make_points3<double>(PointSet3::five_bits, 300, 45);
  Elliptical3 triangulation(ellipsoid_map({3, 1, 1}, rotations()[3]));
  triangulation.build(points);
  const MetricField3 field([&](const Space& p) {
    return p[0] < 16 ? triangulation.metric().map() : ellipsoid_map({1, 4, 2}, rotations()[4]);
  });
  const MetricTetrahedra result = metric_tetrahedra(triangulation, field);
  const auto before = own_tetrahedra(triangulation);
  const auto after = corners_of_all(triangulation, result.tetrahedra);
  EXPECT_GT(Check(before, after, field).run(result.stuck, triangulation.metric().map()), 100u);
}

TEST(MetricTetrahedra3, RejectInvalidFields) {
  Delaunay3<double> triangulation;
  triangulation.build(std::vector<Space>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}});
  const MetricField3 bad([&](const Space& p) {
    return p[0] > 0 ? LinearMap3{1, 0, 0, 0, 1, 0, 0, 0, 0} : kIdentityMap<3>;
  });
  try {
    static_cast<void>(metric_tetrahedra(triangulation, bad));
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("the map at 1.0"), std::string::npos) << error.what();
  }
  EXPECT_TRUE(metric_tetrahedra(Delaunay3<double>(), bad).tetrahedra.empty());
}

}  // namespace
}  // namespace terrace::tri::test
