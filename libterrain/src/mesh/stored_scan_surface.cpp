// SPDX-License-Identifier: Apache-2.0
// The surface of a scan that is stored with its points: makes it, and cuts it.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/stored_surface.hpp>
#include <terrace/tri/vertex_tree.hpp>

#include "base/numbered_points.hpp"
#include "base/store_checks.hpp"
#include "mesh/scan_surface_steps.hpp"
#include "terrace/terrain/detail_mesh.hpp"

namespace terrace::terrain {
namespace {

/// Points, their places on the ground, the stored tree and triangles, and a cut of them.
constexpr std::uint64_t kStoredBytesPerPoint = 2 * 24 + 2 * 40 + 2 * 60;

/// Reads all points of a store by their numbers, in its CRS.
TriangleMesh numbered_points(const stream::Store& store, const stream::ClusterOrder& order) {
  TriangleMesh mesh;
  mesh.positions.resize(order.points());
  mesh.levels.resize(order.points());
  for (const auto& cluster : order.clusters) {
    // A representative has the highest level of the clusters that it is in, without heading them.
    if (cluster.representative == stream::kNoNumber) continue;
    std::uint8_t& highest = mesh.levels[cluster.representative];
    highest = std::max(highest, static_cast<std::uint8_t>(stream::level_of(cluster.id) + 1));
  }
  for_each_numbered_point(
      store, order, [&](std::uint32_t number, const stream::Point3& p, std::span<const std::byte>) {
        mesh.positions[number] = world_point(store.schema(), p);
      });
  return mesh;
}

/// Returns whether each cluster of the order is wanted.
std::vector<bool> wanted_clusters(const stream::Store& store, const stream::ClusterOrder& order,
                                  const Detail& detail) {
  std::vector<std::vector<bool>> by_level;
  for (const stream::LevelInfo& level : store.levels()) by_level.emplace_back(level.clusters);
  for_each_wanted_record(store, detail, [&](stream::ClusterId id, const stream::ClusterRecord&) {
    by_level[stream::level_of(id)][stream::ordinal_of(id)] = true;
  });
  std::vector<bool> wanted;
  for (const auto& cluster : order.clusters) {
    wanted.push_back(by_level[stream::level_of(cluster.id)][stream::ordinal_of(cluster.id)]);
  }
  return wanted;
}

/// Returns the vertices whose cluster is wanted, and those without a parent.
std::vector<bool> cut_by_detail(const stream::Store& store, const stream::ClusterOrder& order,
                                const tri::VertexTree& tree, const Detail& detail) {
  if (detail.focuses.empty()) return tri::cut_by_level(tree, detail.level);
  const std::vector<bool> wanted = wanted_clusters(store, order, detail);
  std::vector<bool> active(tree.parents.size());
  for (const auto& leaf : order.clusters) {
    if (stream::level_of(leaf.id) > 0) continue;
    for (std::uint32_t v = leaf.begin; v < leaf.end; ++v) {
      auto c = static_cast<std::uint32_t>(&leaf - order.clusters.data());
      while (stream::level_of(order.clusters[c].id) < tree.levels[v]) {
        c = order.clusters[c].parent;
      }
      active[v] = wanted[c] || tree.parents[v] == stream::kNoNumber;
    }
  }
  return active;
}

/// Sorts the vertices of a surface into the clusters of a store. numbers: of each vertex.
tri::VertexClusters clusters_of(const stream::ClusterOrder& order,
                                const std::vector<std::size_t>& numbers) {
  constexpr std::uint32_t kNone = tri::VertexClusters::kNone;
  std::vector<std::uint32_t> vertex(order.points(), kNone);
  for (std::size_t v = 0; v < numbers.size(); ++v) {
    vertex[numbers[v]] = static_cast<std::uint32_t>(v);
  }
  tri::VertexClusters out;
  out.leaf.resize(numbers.size());
  for (const auto& cluster : order.clusters) {
    const unsigned level = stream::level_of(cluster.id);
    const bool has_head = cluster.representative != stream::kNoNumber;
    for (std::uint32_t n = cluster.begin; level == 0 && n < cluster.end; ++n) {
      if (vertex[n] != kNone) {
        out.leaf[vertex[n]] = static_cast<std::uint32_t>(out.clusters.size());
      }
    }
    out.clusters.push_back({.parent = cluster.parent,
                            .representative = has_head ? vertex[cluster.representative] : kNone,
                            .level = static_cast<std::uint8_t>(level)});
  }
  return out;
}

}  // namespace

bool uses_stored_surface(const stream::Store& store, const Detail& detail,
                         const ScanSurfaceOptions& options) {
  return options.stored && store.surface() && store.condition() == nullptr && !detail.region &&
         !detail.cluster && !options.method && !options.tetrahedra && !options.restore.metric &&
         options.restore.quantise_bits == 0 &&
         options.restore.shape.rule == tri::ShapeOptions{}.rule;
}

ScanSurface stored_scan_surface(const stream::Store& source, const Detail& detail,
                                const ScanSurfaceOptions& options, const Context& context) {
  need_memory_for_surface(
      source, source.points(),
      std::max({kStoredBytesPerPoint, options.smoothing ? kSmoothingBytesPerPoint : 0,
                options.smoothing && simplifies(options) ? kSimplificationBytesPerPoint : 0}),
      context.memory_or(0));
  const stream::ClusterOrder order = stream::cluster_order(source);
  stream::StoredSurface stored = source.read_surface(order);
  const TriangleMesh points = numbered_points(source, order);
  tri::Surface full{on_ground(points.positions, source.schema()), std::move(stored.triangles)};
  const tri::VertexTree tree{std::move(stored.parents), std::move(stored.errors),
                             std::move(stored.levels)};
  context.check_stop();
  ScanSurface out;
  out.stored = true;
  std::vector<bool> active;
  const bool by_error = simplifies(options) && !options.smoothing;
  if (by_error) {
    const double error =
        options.max_error ? *options.max_error : tri::error_of_points(tree, *options.max_points);
    active = tri::cut_by_error(tree, error);
    const tri::SurfaceMeasures measures = tri::measure(full);
    out.simplified = SimplifiedFrom{
        .vertices = measures.vertices, .triangles = measures.faces, .volume = measures.volume};
    for (std::size_t v = 0; v < active.size(); ++v) {
      if (active[v]) continue;
      out.simplified->max_distance = std::max(out.simplified->max_distance, tree.errors[v]);
    }
  } else {
    active = cut_by_detail(source, order, tree, detail);
  }
  const bool whole = detail.level == 0 && detail.focuses.empty();
  tri::SurfaceOfCut cut = tri::surface_of_cut(full, tree.parents, active);
  tri::RestoredSurface surface;
  surface.surface = std::move(cut.surface);
  surface.input.assign(cut.input.begin(), cut.input.end());
  if (whole) {
    const std::size_t vertices =
        out.simplified ? out.simplified->vertices : surface.surface.points.size();
    out.samples_off = distinct_places(full.points) - vertices;
  }
  std::vector<tri::Point3> samples;
  if (options.smoothing) {
    samples = smooth_scan(options, context, surface, out);
    if (simplifies(options)) {
      simplify_scan(
          options, [&] { context.check_stop(); }, surface, samples, out);
    }
  }
  out.measures = tri::measure(surface.surface);
  out.open = out.measures.border_edges > 0;
  out.mesh.triangles = std::move(surface.surface.faces);
  set_vertices(surface, samples, points, source.schema(), out.mesh);
  return out;
}

stream::StoredSurface surface_to_store(const stream::Store& store,
                                       const stream::ClusterOrder& order, const Context& context,
                                       const InputTriangles& triangles) {
  need_points(store, "a surface");
  const stream::Store source = store.with_stop(context.stop);
  const auto need_memory = [&](std::uint64_t bytes_per_point) {
    need_memory_for_surface(source, source.points(), bytes_per_point, context.memory_or(0),
                            stream::message("raise {memory_bytes}, or leave the surface out"));
  };
  need_memory(kInputSurfaceBytesPerPoint);
  const TriangleMesh points = numbered_points(source, order);
  const base::StopCheck check_stop = [&] { context.check_stop(); };
  tri::RestoredSurface surface;
  if (triangles.next) surface = input_surface(source, points, triangles, context);
  if (surface.surface.faces.empty()) {
    if (triangles.required) {
      throw stream::Error(store.path().string(), "the input has no triangles for a surface")
          .remedy(stream::message(
              "to restore a surface from the points, pass {surface_from} restored"));
    }
    need_memory(restoring_bytes_per_point({}));
    tri::RestoreOptions options;
    options.threads = context.threads;
    options.check_stop = check_stop;
    surface = tri::restore_surface(on_ground(points.positions, source.schema()), options);
  }
  if (surface.surface.faces.empty()) {
    throw stream::Error(store.path().string(),
                        "the points enclose no volume, so they have no surface")
        .remedy("leave out the surface");
  }
  context.check_stop();
  tri::VertexTree tree =
      tri::vertex_tree(surface.surface, clusters_of(order, surface.input), check_stop);
  stream::StoredSurface out(order.points());
  const auto number = [&](std::uint32_t v) { return static_cast<std::uint32_t>(surface.input[v]); };
  for (std::uint32_t v = 0; v < tree.parents.size(); ++v) {
    const std::uint32_t parent = tree.parents[v];
    if (parent != tri::VertexClusters::kNone) out.parents[number(v)] = number(parent);
    out.errors[number(v)] = tree.errors[v];
    out.levels[number(v)] = tree.levels[v];
  }
  for (const auto& face : surface.surface.faces) {
    out.triangles.push_back({number(face[0]), number(face[1]), number(face[2])});
  }
  return out;
}

}  // namespace terrace::terrain
