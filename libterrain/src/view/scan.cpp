// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <terrace/tri/delaunay2.hpp>

#include "base/steepness.hpp"
#include "base/vector.hpp"
#include "terrace/terrain/store_source.hpp"
#include "terrace/terrain/store_view.hpp"
#include "view/frame.hpp"

namespace terrace::terrain {
namespace {

/// Differs from the Delaunay triangulation only next to nearly cocircular points, because a window
/// is tiny compared to the distances of the points. The viewer needs this metric anyway.
using TopTriangulation = tri::Delaunay2<std::int32_t, tri::Windowed>;

}  // namespace

bool is_scan(const stream::Store& store, const stream::LinearMap& ground) {
  const stream::StoreSchema& schema = store.schema();
  if (schema.grid || schema.crs.epsg != 0 || !schema.crs.wkt.empty()) return false;
  // Points that represent triangles or lines are not on a surface.
  for (const auto& [name, value] : schema.parameters) {
    if (name == "entities") return false;
  }
  for (const auto& attribute : schema.attributes) {
    if (attribute.name == "classification") return false;
  }
  if (store.bounds().empty()) return false;
  const ViewFrame frame(store, ground);
  const ViewLattice lattice(store, frame);
  StoreSource source(store);
  const std::span<const stream::Point3> points =
      source.read(tri::cluster_id(source.top(), 0)).positions;
  std::vector<TopTriangulation::Point> places;
  places.reserve(points.size());
  std::vector<stream::Point3> nodes;
  for (const stream::Point3& p : points) {
    nodes.push_back(lattice.node(frame(p)));
    places.push_back(
        {static_cast<std::int32_t>(nodes.back()[0]), static_cast<std::int32_t>(nodes.back()[1])});
  }
  TopTriangulation triangulation;
  std::vector<TopTriangulation::Insertion> vertices(places.size());
  triangulation.insert(places, vertices);
  std::vector<double> heights(triangulation.vertex_slots());
  for (std::size_t i = 0; i < nodes.size(); ++i) heights[slot(vertices[i].vertex)] = nodes[i][2];
  Steepness steepness;
  for (const tri::TriangleId triangle : triangulation.all_triangles()) {
    std::array<stream::Point3, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      const tri::VertexId vertex = triangulation.vertices(triangle)[i];
      const auto place = triangulation.point(vertex);
      p[i] = {static_cast<double>(place[0]), static_cast<double>(place[1]), heights[slot(vertex)]};
    }
    steepness.add(cross(difference(p[1], p[0]), difference(p[2], p[0])));
  }
  return steepness.mostly();
}

}  // namespace terrace::terrain
