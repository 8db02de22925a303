// SPDX-License-Identifier: Apache-2.0
// The model in space, and the shape that follows it through its deltas.
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "delaunay3/access.hpp"
#include "multiresolution_hierarchy.hpp"
#include "terrace/tri/multiresolution.hpp"
#include "terrace/tri/shape.hpp"

namespace terrace::tri::test {
namespace {

template <class T>
class Multiresolution3D : public testing::Test {};
using Coords = testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(Multiresolution3D, Coords);

enum class Place { volume, sphere, lattice, plane };

std::vector<Point3> points_at(Place place, std::size_t count, std::mt19937_64& random) {
  std::vector<Point3> points(count);
  for (Point3& p : points) {
    for (double& c : p)
      c = static_cast<double>(below(random, place == Place::lattice ? 5 : 1 << 20));
    if (place == Place::plane) p[2] = 7.0;
    if (place != Place::sphere) continue;
    double length = 0.0;
    for (const double c : p) length += (c - 0x1p19) * (c - 0x1p19);
    for (double& c : p) c = std::round(0x1p19 + (c - 0x1p19) * 0x1p18 / std::sqrt(length + 1.0));
  }
  return points;
}

/// All points present, derived from the expanded clusters alone.
template <class Coord>
std::vector<std::array<Coord, 3>> present(MemorySource& source,
                                          const MultiresolutionModel<Delaunay3<Coord>>& model) {
  std::vector<std::array<Coord, 3>> points;
  const auto add = [&](const MemorySource::Cluster& cluster) {
    for (const Point3& p : cluster.positions) {
      points.push_back(
          {static_cast<Coord>(p[0]), static_cast<Coord>(p[1]), static_cast<Coord>(p[2])});
    }
  };
  add(source.root());
  for (const ClusterId id : model.expanded()) add(source.at(id));
  return points;
}

/// A cluster that is expanded or can be, or the root if there is none.
template <class Coord>
ClusterId any_cluster(const MultiresolutionModel<Delaunay3<Coord>>& model, ClusterId root,
                      std::mt19937_64& random) {
  std::vector<ClusterId> parents = model.expanded(), children, all;
  parents.push_back(root);
  for (const ClusterId parent : parents) {
    model.children(parent, children);
    all.insert(all.end(), children.begin(), children.end());
  }
  return all.empty() ? root : all[below(random, all.size())];
}

TYPED_TEST(Multiresolution3D, DependsOnExpandedClustersAloneAndTheShapeFollows) {
  using Coord = TypeParam;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    for (const Place place : {Place::volume, Place::sphere, Place::lattice, Place::plane}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " place " << static_cast<int>(place));
      std::mt19937_64 random(seed);
      MemorySource source =
          make_hierarchy(points_at(place, 150 + below(random, 250), random), 2, 8.0, random);
      Multiresolution3<Coord> model(source);
      Shape3<Coord> shape;
      shape.restore(model.triangulation());
      const ClusterId root = cluster_id(source.top(), 0);
      for (int step = 0; step < 25; ++step) {
        const Box3 box{{0, 0, 0},
                       {static_cast<double>(below(random, 1 << 20)), 0x1p20,
                        static_cast<double>(below(random, 1 << 20))}};
        const typename Multiresolution3<Coord>::Delta* delta = nullptr;
        const ClusterId cluster = any_cluster(model, root, random);
        switch (below(random, 5)) {
          case 0:
          case 1:
            delta = cluster == root              ? &model.set_level(0)
                    : model.is_expanded(cluster) ? &model.collapse(cluster)
                                                 : &model.expand(cluster);
            break;
          case 2:
            delta = &model.refine(box, static_cast<unsigned>(below(random, 2)));
            break;
          case 3:
            delta = &model.coarsen(box, 1 + static_cast<unsigned>(below(random, 2)));
            break;
          default:
            delta = &model.set_detail({2, {{box, 0}}});
        }
        ASSERT_EQ(find_fault(model.triangulation()), "");
        Delaunay3<Coord> scratch;
        const auto points = present(source, model);
        ASSERT_EQ(model.point_count(), points.size());
        scratch.build(points);
        ASSERT_EQ(model.triangulation().hash(), scratch.hash());
        shape.update(model.triangulation(), delta->changes);
        Shape3<Coord> repeated;
        repeated.restore(model.triangulation());
        ASSERT_EQ(shape.kept_tetrahedra(), repeated.kept_tetrahedra());
      }
      model.set_level(Detail::kTop);
      Delaunay3<Coord> coarse;
      coarse.build(present(source, model));
      EXPECT_EQ(model.triangulation().hash(), coarse.hash());
      EXPECT_EQ(model.expanded_count(), 0u);
    }
  }
}

}  // namespace
}  // namespace terrace::tri::test
