// SPDX-License-Identifier: Apache-2.0
#include "mesh/vertex_heights.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace terrace::terrain {
namespace {

/// A vertex with the id of its point.
struct Named {
  tri::PointId point;
  tri::VertexId vertex = tri::kNoVertex;
};

/// Returns all vertices in the order of overlays.
template <class Model>
std::vector<Named> by_point(const Model& model) {
  std::vector<Named> named;
  named.reserve(model.triangulation().vertex_count());
  for (const tri::VertexId v : model.triangulation().all_vertices()) {
    named.push_back({model.point_id(v), v});
  }
  std::sort(named.begin(), named.end(),
            [](const Named& a, const Named& b) { return a.point < b.point; });
  return named;
}

/// Calls change(vertex, value) for the vertices in the overlay.
template <class Change>
void apply_changes(stream::Overlay& overlay, const std::vector<Named>& vertices, Change&& change) {
  std::span<const stream::OverlayValue> values;
  std::size_t next = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const tri::PointId& point = vertices[i].point;
    if (i == 0 || point.cluster != vertices[i - 1].point.cluster) {
      values = overlay.find(point.cluster);
      next = 0;
    }
    while (next < values.size() && values[next].index < point.index) ++next;
    if (next < values.size() && values[next].index == point.index) {
      change(vertices[i].vertex, values[next].value);
    }
  }
}

/// Returns the root mean square of the height differences along all edges.
template <class Coord>
double rms_step(const tri::Delaunay2<Coord>& triangulation, const std::vector<double>& heights) {
  double sum = 0.0, edges = 0.0;
  for (const tri::TriangleId t : triangulation.all_triangles()) {
    const auto corners = triangulation.vertices(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const double step = heights[tri::slot(corners[k])] - heights[tri::slot(corners[(k + 1) % 3])];
      sum += step * step;
      edges += 1.0;
    }
  }
  return edges > 0.0 ? std::sqrt(sum / edges) : 0.0;
}

/// Returns the smoothed heights, in stored units like the given ones.
template <class Model>
std::vector<tri::HeightChange> smoothed(const Model& model, const stream::Placement& placement,
                                        const std::optional<Region>& region,
                                        const std::vector<double>& heights,
                                        tri::SmoothingOptions options) {
  const auto& triangulation = model.triangulation();
  std::vector<tri::VertexId> inside;
  constexpr std::size_t kBetweenChecks = 4096;
  std::size_t looked_at = 0;
  for (const tri::VertexId v : triangulation.all_vertices()) {
    if (++looked_at % kBetweenChecks == 0 && options.check_stop) options.check_stop();
    const auto p = triangulation.point(v);
    if (!region ||
        region->contains(world_point(
            placement, {static_cast<double>(p[0]), static_cast<double>(p[1]), model.height(v)}))) {
      inside.push_back(v);
    }
  }
  if (options.edge_height == 0.0) options.edge_height = 4.0 * rms_step(triangulation, heights);
  // Without height differences there is nothing to smooth.
  if (options.edge_height == 0.0) return {};
  return tri::smooth(triangulation, heights, inside, options);
}

}  // namespace

std::uint64_t height_bytes_per_vertex(const HeightOptions& options) {
  std::uint64_t bytes = options.any() ? 8 : 0;
  // Counts the heights of two steps, the changes, the vertices, and 16 bytes per edge end.
  if (options.smoothing) bytes += 3 * 8 + 16 + 4 + 6 * 16;
  if (options.overlay != nullptr || options.save != nullptr) bytes += sizeof(Named);
  return bytes;
}

template <class Model>
std::vector<double> changed_heights(const Model& model, const stream::Placement& placement,
                                    const std::optional<Region>& region,
                                    const HeightOptions& options) {
  const auto& triangulation = model.triangulation();
  const stream::Channel& z = placement.coordinates[2];
  // As in world_point(), so that heights that an overlay does not change stay the same to the last
  // bit.
  const auto real = [&](double height) { return height * z.scale + z.offset; };
  std::vector<double> heights(triangulation.vertex_slots(), 0.0);
  for (const tri::VertexId v : triangulation.all_vertices()) {
    heights[tri::slot(v)] = real(model.height(v));
  }
  std::vector<Named> vertices;
  if (options.overlay != nullptr || options.save != nullptr) vertices = by_point(model);

  std::vector<double> before;
  if (options.smoothing) {
    before.resize(heights.size());
    for (const tri::VertexId v : triangulation.all_vertices()) {
      before[tri::slot(v)] = model.height(v);
    }
  }
  if (options.overlay != nullptr) {
    apply_changes(*options.overlay, vertices, [&](tri::VertexId vertex, double value) {
      heights[tri::slot(vertex)] = value;
      if (options.smoothing) before[tri::slot(vertex)] = (value - z.offset) / z.scale;
    });
  }
  if (options.smoothing) {
    for (const auto& [vertex, height] :
         smoothed(model, placement, region, before, *options.smoothing)) {
      heights[tri::slot(vertex)] = real(height);
    }
  }
  if (options.save != nullptr) {
    for (const auto& [point, vertex] : vertices) {
      const double height = heights[tri::slot(vertex)];
      if (height == real(model.height(vertex))) continue;
      options.save->add(point.cluster, point.index, height);
    }
  }
  return heights;
}

template std::vector<double> changed_heights(const tri::Multiresolution2<std::int32_t>&,
                                             const stream::Placement&, const std::optional<Region>&,
                                             const HeightOptions&);
template std::vector<double> changed_heights(const tri::Multiresolution2<double>&,
                                             const stream::Placement&, const std::optional<Region>&,
                                             const HeightOptions&);
template std::vector<double> changed_heights(const MatchingPoints<std::int32_t>&,
                                             const stream::Placement&, const std::optional<Region>&,
                                             const HeightOptions&);
template std::vector<double> changed_heights(const MatchingPoints<double>&,
                                             const stream::Placement&, const std::optional<Region>&,
                                             const HeightOptions&);

}  // namespace terrace::terrain
