// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/store_metric.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/tri/multiresolution.hpp>
#include <terrace/tri/regional_delaunay2.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/store_source.hpp"
#include "terrace/terrain/store_view.hpp"
#include "test_raster.hpp"

namespace terrace::terrain {
namespace {

using Corners = std::array<stream::Point3, 3>;

/// Starts with the least corner and keeps the orientation.
Corners from_least(Corners corners) {
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

std::vector<Corners> sorted_triangles(const TriangleMesh& mesh) {
  std::vector<Corners> all;
  for (const auto& t : mesh.triangles)
    all.push_back(from_least({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]}));
  std::sort(all.begin(), all.end());
  return all;
}

/// The triangles of a model, counter-clockwise in the CRS.
template <class Model, class List>
std::vector<Corners> sorted_triangles(const Model& model, const stream::Store& store,
                                      const List& triangles) {
  const stream::Placement& placement = store.schema();
  const std::array<double, 6>& m = placement.world.xy;
  const bool mirrored = m[0] * m[4] - m[1] * m[3] < 0;
  std::vector<Corners> all;
  for (const auto& vertices : triangles) {
    Corners corners;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto p = model.triangulation().point(vertices[i]);
      corners[i] = world_point(placement, {static_cast<double>(p[0]), static_cast<double>(p[1]),
                                           model.height(vertices[i])});
    }
    if (mirrored) std::swap(corners[1], corners[2]);
    all.push_back(from_least(corners));
  }
  std::sort(all.begin(), all.end());
  return all;
}
template <class Model>
std::vector<Corners> sorted_triangles(const Model& model, const stream::Store& store) {
  std::vector<std::array<tri::VertexId, 3>> list;
  for (const tri::TriangleId t : model.triangulation().all_triangles())
    list.push_back(model.triangulation().vertices(t));
  return sorted_triangles(model, store, list);
}

class StoreMetrics : public testing::Test {
 protected:
  /// Points in a box of 1000 by 800 m, or on a lattice with repeated places if `step` is positive.
  /// degrees: longitudes and latitudes instead, about as far apart.
  stream::Store points(const std::string& name, std::uint64_t seed, int step,
                       bool degrees = false) {
    std::mt19937_64 random(seed);
    const auto number = [&](double size) {
      const double x = size * (static_cast<double>(random() >> 11) * 0x1p-53);
      return step > 0 ? step * std::floor(x / step) : x;
    };
    const std::filesystem::path text = folder_.path() / (name + ".xyz");
    std::ofstream file(text);
    for (int i = 0; i < 1500; ++i) {
      std::array<char, 100> line{};
      double x = number(1000), y = number(800), z = number(50);
      if (degrees) x = 14 + 1e-5 * x, y = 50 + 1e-5 * y;
      std::snprintf(line.data(), line.size(), "%.9f %.9f %.9f\n", x, y, z);
      file << line.data();
    }
    file.close();
    return build(text, name, degrees ? 4326 : 0);
  }
  /// Cells of 30 m, with voids where `voids` is not 0.
  stream::Store raster(const std::string& name, std::array<double, 6> world, unsigned voids) {
    stream::GeoTiffOptions options;
    options.nodata = -9999;
    options.columns = 45;
    options.rows = 38;
    options.world.xy = world;
    options.crs.epsg = 32632;
    const std::filesystem::path file = folder_.path() / (name + ".tif");
    tests::write_test_raster(file, options, [&](std::uint32_t column, std::uint32_t row) {
      if (voids > 0 && (column * 7 + row * 13) % 31 < voids) return -9999.0;
      return 300.0 + 50.0 * std::sin(column / 5.0) + row;
    });
    return build(file, name);
  }
  stream::Store build(const std::filesystem::path& input, const std::string& name, int epsg = 0) {
    BuildRequest request{.inputs = {input.string()}, .store = folder_.path() / name};
    request.block_points = 100;
    request.facility_cost = 0.05;
    if (epsg > 0) {
      request.crs.emplace().epsg = epsg;
      request.crs->geographic = true;
    }
    build_store(request);
    return stream::Store::open(request.store);
  }
  /// Two boxes that overlap, or one metric everywhere.
  MetricChoice metric(const stream::Store& store, bool boxes) {
    const stream::Box3 all = world_box(store.schema(), store.bounds());
    const double x = all.min[0], y = all.min[1];
    const double width = all.max[0] - x, height = all.max[1] - y;
    const std::filesystem::path file = folder_.path() / "metric.json";
    std::ofstream out(file);
    out.precision(17);
    const auto box = [&](double left, double low, double right, double high) {
      if (!boxes) return;
      out << "\"box\": [" << x + left * width << ',' << y + low * height << ',' << x + right * width
          << ',' << y + high * height << "], ";
    };
    out << "{\"regions\": [{";
    box(0.1, 0.1, 0.6, 0.7);
    out << "\"semi_axes\": [30, 5], \"angle\": 30}, {";
    box(0.4, 0.2, 0.9, 0.9);
    out << "\"semi_axes\": [1, 9], \"angle\": 75}]}";
    out.close();
    return MetricChoice::parse("elliptical:" + file.string());
  }

  tests::TemporaryFolder folder_;
};

/// Changes the detail of a model at random and compares it with meshes of the same detail.
template <class Coord>
void follow(const stream::Store& store, const MetricChoice& metric, std::uint64_t seed,
            bool has_voids) {
  using Triangulation = tri::RegionalDelaunay2<Coord>;
  std::mt19937_64 random(seed);
  const tri::MetricField2 field = metric_field(metric, store);
  StoreSource source(store);
  tri::MultiresolutionModel<Triangulation> model(source, {}, {}, field);
  const stream::Box3 all = store.bounds();
  for (int step = 0; step < 24; ++step) {
    const auto within = [&](std::size_t axis) {
      return all.min[axis] +
             (all.max[axis] - all.min[axis]) * static_cast<double>(random() % 100) / 99;
    };
    double x0 = within(0), x1 = within(0), y0 = within(1), y1 = within(1);
    const tri::Box3 box =
        tri::box2(std::min(x0, x1), std::min(y0, y1), std::max(x0, x1), std::max(y0, y1));
    std::vector<tri::ClusterId> parents = model.expanded(), children;
    parents.push_back(tri::cluster_id(store.top(), 0));
    model.children(parents[random() % parents.size()], children);
    switch (random() % 4) {
      case 0:
      case 1:
        if (children.empty()) break;
        if (const tri::ClusterId any = children[random() % children.size()];
            model.is_expanded(any)) {
          model.collapse(any);
        } else {
          model.expand(any);
        }
        break;
      case 2:
        model.refine(box, 0);
        break;
      default:
        model.coarsen(box, 1 + static_cast<unsigned>(random() % 2));
    }
    // Of the points present, the triangles that flips of all triangles make.
    const auto flipped = tri::metric_triangles(model.triangulation().plain(), field);
    ASSERT_EQ(sorted_triangles(model, store), sorted_triangles(model, store, flipped));
    if (step % 4 > 0) continue;
    const auto level = static_cast<unsigned>(random() % (store.top() + 1));
    model.set_level(level);
    const tri::MultiresolutionModel<Triangulation> built(source, {level, {}}, {}, field);
    ASSERT_EQ(sorted_triangles(model, store), sorted_triangles(built, store));
    // A mesh leaves out triangles over voids before it flips the others.
    if (has_voids) continue;
    const TriangleMesh mesh = detail_mesh(store, {.level = level}, {.metric = metric});
    ASSERT_EQ(sorted_triangles(model, store), sorted_triangles(mesh));
  }
}

TEST_F(StoreMetrics, ModelsEqualMeshesOfTheSameDetail) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    for (const int step : {0, 40}) {
      for (const bool boxes : {false, true}) {
        SCOPED_TRACE(testing::Message()
                     << "seed " << seed << " step " << step << " boxes " << boxes);
        const stream::Store store =
            points(std::to_string(seed) + std::to_string(step) + std::to_string(boxes), seed, step);
        ASSERT_NO_FATAL_FAILURE(follow<double>(store, metric(store, boxes), seed, false));
      }
    }
    for (const unsigned voids : {0u, 4u}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " voids " << voids);
      const stream::Store store = raster("raster" + std::to_string(seed) + std::to_string(voids),
                                         {30, 0, 500000, 0, -20, 5200000}, voids);
      ASSERT_NO_FATAL_FAILURE(follow<std::int32_t>(store, metric(store, true), seed, voids > 0));
    }
  }
}

template <class Coord>
void look(const stream::Store& store, const MetricChoice& metric) {
  using Triangulation = tri::RegionalDelaunay2<Coord>;
  using Looking = StoreView<Triangulation>;
  const tri::MetricField2 field = metric_field(metric, store);
  Looking view(store, {}, Looking::Reader::in_frame, {field});
  // Without a field, triangles are Euclidean.
  Looking plain(store, {}, Looking::Reader::in_frame);
  for (const double error : {200.0, 20.0, 0.0, 60.0}) {
    tri::View wish;
    wish.ground_error = error;
    for (int frame = 0; frame < 1000 && !view.settled(); ++frame) view.frame(wish, 0.1);
    for (int frame = 0; frame < 1000 && !plain.settled(); ++frame) plain.frame(wish, 0.1);
    view.frame(wish, 0.1);
    const auto flipped = tri::metric_triangles(view.model().triangulation().plain(), field);
    ASSERT_EQ(sorted_triangles(view.model(), store),
              sorted_triangles(view.model(), store, flipped));
    if (error > 0.0) continue;
    for (Looking* any : {&view, &plain}) {
      while (any->points() < store.points()) any->frame(wish, 0.1);
    }
    const TriangleMesh mesh = detail_mesh(store, {.level = 0}, {.metric = metric});
    ASSERT_EQ(sorted_triangles(view.model(), store), sorted_triangles(mesh));
    ASSERT_EQ(sorted_triangles(plain.model(), store),
              sorted_triangles(detail_mesh(store, {.level = 0})));
    ASSERT_NE(sorted_triangles(plain.model(), store), sorted_triangles(mesh));
  }
}

TEST_F(StoreMetrics, ViewsEqualMeshesOfTheSameDetail) {
  const stream::Store cloud = points("cloud", 5, 0);
  ASSERT_NO_FATAL_FAILURE(look<double>(cloud, metric(cloud, true)));
  const stream::Store cells = raster("cells", {30, 0, 500000, 0, -20, 5200000}, 0);
  ASSERT_NO_FATAL_FAILURE(look<std::int32_t>(cells, metric(cells, true)));
}

TEST_F(StoreMetrics, RefusesWhatTrianglesCannotFollow) {
  const stream::Store turned = raster("turned", {20, 20, 500000, 20, -20, 5200000}, 0);
  EXPECT_THROW(static_cast<void>(metric_field(metric(turned, true), turned)), UsageError);
  static_cast<void>(metric_field(metric(turned, false), turned));
  EXPECT_THROW(static_cast<void>(metric_field(MetricChoice::parse("squared"), turned)), UsageError);
}

// In degrees, tetrahedra are those of the points in metres, which are in general position.
TEST_F(StoreMetrics, TetrahedraAreThoseOnTheGround) {
  using Tetrahedra = tri::Delaunay3<double, tri::EllipticalMetric3>;
  const stream::Store store = points("degrees", 7, 0, true);
  const tri::LinearMap3 map = ground_map(store);
  EXPECT_NEAR(map[0], 71700, 300);
  EXPECT_NEAR(map[4], 111200, 300);
  EXPECT_EQ(map[8], 1);
  StoreSource source(store);
  tri::MultiresolutionModel<Tetrahedra> model(source, {}, {}, Tetrahedra(map));
  for (const unsigned level : {0u, store.top(), 1u}) {
    model.set_level(level);
    const Tetrahedra& cells = model.triangulation();
    std::vector<stream::Point3> metres;
    std::vector<tri::VertexId> vertices;
    for (const tri::VertexId v : cells.all_vertices()) {
      const stream::Point3 p = cells.point(v);
      metres.push_back({map[0] * (p[0] - 14), map[4] * (p[1] - 50), map[8] * p[2]});
      vertices.push_back(v);
    }
    tri::Delaunay3<double> on_ground;
    const std::vector<tri::VertexId> ids = on_ground.build(metres);
    std::vector<tri::VertexId> number(on_ground.vertex_slots());
    for (std::size_t i = 0; i < ids.size(); ++i) number[tri::slot(ids[i])] = vertices[i];
    std::vector<std::array<tri::VertexId, 4>> ours, theirs;
    for (const tri::TetrahedronId t : cells.all_tetrahedra()) ours.push_back(cells.vertices(t));
    for (const tri::TetrahedronId t : on_ground.all_tetrahedra()) {
      theirs.push_back(on_ground.vertices(t));
      for (tri::VertexId& v : theirs.back()) v = number[tri::slot(v)];
    }
    for (auto* list : {&ours, &theirs}) {
      for (auto& corners : *list) std::sort(corners.begin(), corners.end());
      std::sort(list->begin(), list->end());
    }
    ASSERT_EQ(ours, theirs);
  }
}

}  // namespace
}  // namespace terrace::terrain
