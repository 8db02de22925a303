// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/point_tin.hpp>
#include <terrace/tri/predicates.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "base/streaming_hull.hpp"
#include "random.hpp"
#include "terrace/stream/mesh_reader.hpp"
#include "terrace/terrain/bounded_mesh.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/region.hpp"
#include "terrace/terrain/triangle_mesh.hpp"

/// Clouds, and the checks that any mesh of them must pass.

namespace terrace::tests {

using terrain::Point2;
using Cloud = std::vector<stream::Point3>;

inline double relief(double x, double y) { return 40 * std::sin(x / 9) * std::cos(y / 7) + x / 3; }

inline Cloud uniform(std::size_t count, std::uint64_t seed, double size = 100) {
  Random random(seed);
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = random(0, size), y = random(0, size);
    cloud.push_back({x, y, relief(x, y) + random(-1, 1)});
  }
  return cloud;
}

/// Points in clumps; most of the plane is empty.
inline Cloud clumps(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  Cloud cloud;
  std::vector<Point2> centres;
  for (int i = 0; i < 6; ++i) centres.push_back({random(0, 1000), random(0, 1000)});
  for (std::size_t i = 0; i < count; ++i) {
    const Point2& centre = centres[i % centres.size()];
    const double wide = i % 50 == 0 ? 300 : 4;
    const double x = centre[0] + random(-wide, wide) * random(0, 1);
    const double y = centre[1] + random(-wide, wide) * random(0, 1);
    cloud.push_back({x, y, relief(x / 5, y / 5)});
  }
  return cloud;
}

/// The positions of a lattice that `keep` accepts.
template <class Keep>
Cloud lattice(int columns, int rows, double x0, double y0, double step, const Keep& keep) {
  Cloud cloud;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      if (keep(c, r)) cloud.push_back({x0 + step * c, y0 + step * r, relief(c, r)});
    }
  }
  return cloud;
}
inline bool everywhere(int, int) { return true; }

/// Checks that a mesh is one piece over the hull of samples at distinct positions, and returns
/// their errors.
inline tri::TinErrors check_surface(const Cloud& cloud, const terrain::TriangleMesh& mesh) {
  // Every sample, checked by separate code.
  std::vector<double> x, y, z;
  std::vector<Point2> places;
  for (const stream::Point3& p : cloud) {
    x.push_back(p[0]);
    y.push_back(p[1]);
    z.push_back(p[2]);
    places.push_back({p[0], p[1]});
  }
  const tri::TinErrors errors = tri::measure_surface(x, y, z, mesh.positions, mesh.triangles);
  EXPECT_EQ(errors.uncovered, 0U);

  // No vertex is repeated or unused, edges match, and the area equals that of the hull.
  const std::set<stream::Point3> different(mesh.positions.begin(), mesh.positions.end());
  EXPECT_EQ(different.size(), mesh.positions.size());
  std::set<std::uint32_t> used;
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  const auto place = [&](std::uint32_t v) {
    return Point2{mesh.positions[v][0], mesh.positions[v][1]};
  };
  const Point2 origin = places.front();
  double area = 0;
  for (const auto& t : mesh.triangles) {
    EXPECT_GT(tri::orientation(place(t[0]), place(t[1]), place(t[2])), 0);
    for (std::size_t k = 0; k < 3; ++k) {
      used.insert(t[k]);
      const auto [edge, fresh] = edges.emplace(t[k], t[(k + 1) % 3]);
      EXPECT_TRUE(fresh) << "triangles overlap";
      const Point2 a = place(t[k]), b = place(t[(k + 1) % 3]);
      area += (a[0] - origin[0]) * (b[1] - origin[1]) - (b[0] - origin[0]) * (a[1] - origin[1]);
    }
  }
  EXPECT_EQ(used.size(), mesh.positions.size());
  const std::vector<Point2> hull = terrain::convex_hull(places);
  double hull_area = 0;
  std::set<Point2> corners;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point2 a = hull[i], b = hull[(i + 1) % hull.size()];
    hull_area += (a[0] - origin[0]) * (b[1] - origin[1]) - (b[0] - origin[0]) * (a[1] - origin[1]);
  }
  EXPECT_NEAR(area, hull_area, 1e-9 * hull_area);
  // The border goes around once, along the hull.
  std::size_t border = 0;
  const double size = std::sqrt(hull_area);
  for (const auto& [from, to] : edges) {
    if (edges.contains({to, from})) continue;
    ++border;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < hull.size(); ++i) {
      const Point2 a = hull[i], b = hull[(i + 1) % hull.size()], p = place(from);
      const double dx = b[0] - a[0], dy = b[1] - a[1];
      nearest =
          std::min(nearest, std::abs(dx * (p[1] - a[1]) - dy * (p[0] - a[0])) / std::hypot(dx, dy));
    }
    EXPECT_LE(nearest, 1e-9 * size);
  }
  EXPECT_GE(border, hull.size());
  return errors;
}

class PointMesh : public testing::Test {
 protected:
  stream::Store build(const Cloud& cloud) {
    const std::string name = (folder_.path() / ("cloud" + std::to_string(++clouds_))).string();
    const auto writer = stream::open_point_writer(name + ".ply", {});
    stream::PointBlock block;
    block.positions = cloud;
    writer->append(block);
    writer->finish();
    terrain::BuildRequest request;
    request.inputs = {name + ".ply"};
    request.store = name + ".store";
    request.block_points = 500;  // gives more levels
    request.facility_cost = 1.0;
    terrain::build_store(request);
    return stream::Store::open(request.store);
  }

  terrain::BoundedMeshOptions options(double max_error, std::size_t window_points) {
    terrain::BoundedMeshOptions out;
    out.max_error = max_error;
    out.window_points = window_points;
    out.path = (folder_.path() / "mesh.ply").string();
    out.writer.replace = true;
    return out;
  }

  static terrain::Context common(unsigned threads = 1, std::uint64_t memory = 1U << 30) {
    terrain::Context out;
    out.threads = threads;
    out.memory_bytes = memory;
    return out;
  }

  std::string bytes() const {
    std::ifstream stream(folder_.path() / "mesh.ply", std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  /// Meshes the points, all at distinct positions, and checks everything that must hold for any
  /// cloud.
  terrain::BoundedMeshResult mesh_and_check(const Cloud& cloud,
                                            const terrain::BoundedMeshOptions& options) {
    return mesh_and_check(build(cloud), cloud, options);
  }
  terrain::BoundedMeshResult mesh_and_check(const stream::Store& store, const Cloud& cloud,
                                            const terrain::BoundedMeshOptions& options);

  TemporaryFolder folder_;
  int clouds_ = 0;
};

inline terrain::BoundedMeshResult PointMesh::mesh_and_check(
    const stream::Store& store, const Cloud& cloud, const terrain::BoundedMeshOptions& options) {
  const terrain::BoundedMeshResult result = write_bounded_mesh(store, options, common());
  const terrain::TriangleMesh mesh = terrain::triangle_mesh_of(*stream::read_mesh(options.path));
  EXPECT_EQ(result.vertices, mesh.positions.size());
  EXPECT_EQ(result.triangles, mesh.triangles.size());
  EXPECT_EQ(result.samples, cloud.size());
  const tri::TinErrors errors = check_surface(cloud, mesh);
  EXPECT_LE(errors.largest, options.max_error * (1 + 1e-9) + 1e-9);
  EXPECT_NEAR(errors.largest, result.max_error, 1e-9 * (1 + result.max_error));
  EXPECT_NEAR(errors.rms, result.rms_error, 1e-9 * (1 + result.rms_error));
  return result;
}

}  // namespace terrace::tests
