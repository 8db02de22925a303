// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/detail_mesh.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/store_query.hpp>
#include <terrace/tri/metric.hpp>
#include <terrace/tri/multiresolution.hpp>

#include "base/store_checks.hpp"
#include "base/stored_entities.hpp"
#include "base/units.hpp"
#include "earth/ground.hpp"
#include "mesh/matching_points.hpp"
#include "mesh/vertex_heights.hpp"
#include "mesh/wanted_entities.hpp"
#include "surface/box_tree.hpp"
#include "surface/stored_box.hpp"
#include "terrace/terrain/detail_lines.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/store_metric.hpp"
#include "terrace/terrain/store_source.hpp"
#include "view/raster_gap.hpp"

namespace terrace::terrain {
namespace {

/// A part of a store with a cluster in place of the root; the representative of the cluster is its
/// last member.
class ClusterTop final : public tri::ClusterSource {
 public:
  ClusterTop(const stream::Store& store, stream::ClusterId cluster)
      : store_(store), inner_(store), cluster_(cluster) {}

  [[nodiscard]] unsigned top() const override { return stream::level_of(cluster_); }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override {
    return inner_.cluster_count(level);
  }
  tri::ClusterRecord record(tri::ClusterId id) override { return inner_.record(id); }
  tri::ClusterMembers read(tri::ClusterId id) override {
    if (tri::level_of(id) < top()) return inner_.read(id);
    store_.read(cluster_, points_);
    if (points_.has_representative) {
      points_.positions.push_back(points_.representative);
      points_.children.insert(points_.children.end(), points_.representative_children.begin(),
                              points_.representative_children.end());
    }
    return {.positions = points_.positions, .children = points_.children};
  }

 private:
  const stream::Store& store_;
  StoreSource inner_;
  stream::ClusterId cluster_;
  stream::ClusterPoints points_;
};

/// Peak memory in bytes per vertex: the triangulation and its bulk construction, the model's
/// bookkeeping, and the resulting mesh (vertex, level, two triangles).
constexpr std::uint64_t kBytesPerVertex = 66 + 20 + 32 + 24 + 4 + 1 + 2 * 12;

tri::Detail in_stored_coordinates(const Detail& detail, const stream::Placement& placement) {
  tri::Detail stored;
  std::vector<Region> regions;
  const auto add = [&](const Region& region, unsigned level) {
    stored.focuses.push_back({stored_box(placement, region.box()), level});
    regions.push_back(region);
  };
  if (detail.region) {
    add(*detail.region, detail.level);
  } else {
    stored.level = detail.level;
  }
  for (const FinerRegion& focus : detail.focuses) add(focus.region, focus.level);
  stored.needs = [&detail, placement, regions](std::size_t focus, const tri::Box3& box) {
    return detail.reaches_into(regions[focus], world_box(placement, box));
  };
  return stored;
}

/// Memory in bytes for the triangles of a field of metrics.
constexpr std::uint64_t kBytesToFlip = 120;

/// Throws: stream::Error if the mesh cannot fit in memory.
void check_memory(const stream::Store& store, const Detail& detail, std::uint64_t memory_bytes,
                  std::uint64_t more_per_vertex) {
  const std::uint64_t points = wanted_points(store, detail);
  constexpr std::uint64_t kMaxVertices = (std::uint64_t{1} << 29) - 2;
  const std::uint64_t needed =
      points * (kBytesPerVertex + more_per_vertex) + (std::uint64_t{32} << 20);
  if (needed <= memory_bytes && points <= kMaxVertices) return;
  throw stream::Error(
      store.path().string(),
      stream::message("a mesh of {} needs {}M of memory, {memory_bytes} allows {}M",
                      counted(points, "point"), (needed >> 20) + 1, memory_bytes >> 20))
      .remedy(stream::message("choose a coarser {level} or a smaller {region}"));
}

/// The clusters of a raster that stay collapsed in a mesh of this detail.
class CollapsedClusters {
 public:
  CollapsedClusters(const stream::Store& store, const Detail& detail) {
    std::vector<BoxTree::Item>& items = boxes_.start();
    const bool all_open = detail.level == 0 && !detail.region && !detail.cluster;
    if (all_open) return;
    for_each_wanted(
        store, detail,
        [&](stream::ClusterId id, const stream::ClusterRecord&,
            const stream::ClusterPoints& points) {
          const unsigned level = stream::level_of(id);
          for (std::size_t i = 0; i < points.children.size(); i += level) {
            for (unsigned below = level; below-- > 0;) {
              const stream::Box3 box =
                  store.record(stream::cluster_id(below, points.children[i + below])).summary.box;
              if (detail.wants(below, world_box(store.schema(), box))) continue;
              items.push_back({.box = {{box.min[0], box.min[1]}, {box.max[0], box.max[1]}}});
              break;
            }
          }
        });
    boxes_.build();
  }
  /// Memory for an item and its share of the tree for each vertex that heads a cluster: all but
  /// those of level 0, which are at least nine in ten.
  [[nodiscard]] static std::uint64_t bytes_per_vertex(const Detail& detail) {
    constexpr std::uint64_t kBytes = 2 * sizeof(BoxTree::Item);
    return detail.finest() == 0 ? kBytes / 10 : kBytes;
  }
  [[nodiscard]] bool leave_gap(const std::array<std::array<std::int32_t, 2>, 3>& corners) const {
    return spans_gap(corners, [&](const stream::Box3& cells) {
      bool far = true;
      boxes_.visit([&](const StoredBox& box) { return far && box.intersects(flat(cells)); },
                   [&](std::uint32_t) { far = false; });
      return far;
    });
  }

 private:
  BoxTree boxes_;
};

/// `heights`: by vertex slot in real units; empty: the model's. collapsed: null if there are no
/// gaps.
template <class Model>
TriangleMesh mesh_of_model(const Model& model, const stream::Placement& placement,
                           const std::optional<Region>& region, const std::vector<double>& heights,
                           const std::optional<tri::MetricField2>& field,
                           const CollapsedClusters* collapsed, const stream::Store& store) {
  const auto& triangulation = model.triangulation();
  const auto position = [&](tri::VertexId v) {
    const auto p = triangulation.point(v);
    stream::Point3 place = world_point(
        placement, {static_cast<double>(p[0]), static_cast<double>(p[1]), model.height(v)});
    if (!heights.empty()) place[2] = heights[tri::slot(v)];
    return place;
  };
  const std::array<double, 6>& m = placement.world.xy;
  const bool mirrored = m[0] * m[4] - m[1] * m[3] < 0;

  TriangleMesh mesh;
  constexpr auto kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(triangulation.vertex_slots(), kUnused);
  const auto number_of = [&](tri::VertexId v) {
    std::uint32_t& n = number[tri::slot(v)];
    if (n == kUnused) {
      n = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back(position(v));
      mesh.levels.push_back(static_cast<std::uint8_t>(model.level(v)));
    }
    return n;
  };
  if (!region) {
    mesh.positions.reserve(triangulation.vertex_count());
    mesh.levels.reserve(triangulation.vertex_count());
    mesh.triangles.reserve(triangulation.triangle_count());
    // Points without a triangle (fewer than three, or all collinear) are written nevertheless.
    for (const tri::VertexId v : triangulation.all_vertices()) number_of(v);
  }
  // The rule for gaps holds for Delaunay triangles, so apply it before the metric.
  const auto has_data = [&](tri::TriangleId t) {
    const auto corners = triangulation.vertices(t);
    const auto place = [&](std::size_t i) { return triangulation.point(corners[i]); };
    if constexpr (std::is_same_v<decltype(place(0)), std::array<std::int32_t, 2>>) {
      return !(collapsed && collapsed->leave_gap({place(0), place(1), place(2)}));
    } else {
      return true;
    }
  };
  constexpr std::size_t kBetweenChecks = 4096;
  std::size_t added = 0;
  const auto add = [&](std::array<tri::VertexId, 3> corners) {
    if (++added % kBetweenChecks == 0) store.check_stop();
    if (mirrored) std::swap(corners[1], corners[2]);
    if (region &&
        !region->touches({position(corners[0]), position(corners[1]), position(corners[2])})) {
      return;
    }
    mesh.triangles.push_back({number_of(corners[0]), number_of(corners[1]), number_of(corners[2])});
  };
  if (field) {
    for (const auto& corners :
         tri::metric_triangles(triangulation, *field, has_data, [&] { store.check_stop(); })) {
      add(corners);
    }
  } else {
    for (const tri::TriangleId t : triangulation.all_triangles()) {
      if (has_data(t)) add(triangulation.vertices(t));
    }
  }
  return mesh;
}

template <class Coord>
TriangleMesh mesh_of(const stream::Store& store, const Detail& detail,
                     const DetailMeshOptions& options,
                     const std::optional<tri::MetricField2>& field) {
  const stream::Placement& placement = store.schema();
  std::optional<CollapsedClusters> collapsed;
  if (has_gaps(store)) collapsed.emplace(store, detail);
  const auto finish = [&](const auto& model) {
    std::vector<double> heights;
    if (options.heights.any()) {
      HeightOptions changes = options.heights;
      if (changes.smoothing) changes.smoothing->check_stop = [&] { store.check_stop(); };
      heights = changed_heights(model, placement, detail.region, changes);
    }
    return mesh_of_model(model, placement, detail.region, heights, field,
                         collapsed ? &*collapsed : nullptr, store);
  };
  if (store.condition() != nullptr) return finish(MatchingPoints<Coord>(store, detail));
  StoreSource full_source(store);
  std::optional<ClusterTop> part;
  if (detail.cluster) part.emplace(store, *detail.cluster);
  tri::ClusterSource& source = part ? static_cast<tri::ClusterSource&>(*part) : full_source;
  tri::Delaunay2<Coord> empty;
  empty.set_check_stop([&] { store.check_stop(); });
  return finish(tri::Multiresolution2<Coord>(source, in_stored_coordinates(detail, placement),
                                             {.deltas = false}, std::move(empty)));
}

/// Three corners, their places in order, and the mesh.
constexpr std::size_t kBytesPerTriangle = 3 * (24 + 4 + 4 + 24) + 12;

/// Merges corners that are equal to the last bit into one vertex, numbered by first appearance.
TriangleMesh welded(std::vector<stream::Point3> corners) {
  const auto bits = [&](std::uint32_t i) {
    return std::bit_cast<std::array<std::uint64_t, 3>>(corners[i]);
  };
  std::vector<std::uint32_t> order(corners.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto x = bits(a), y = bits(b);
    return x < y || (x == y && a < b);
  });
  std::vector<std::uint32_t> first(corners.size());  // the first corner equal to each corner
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && bits(order[i]) == bits(order[i - 1]);
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  order = {};

  TriangleMesh mesh;
  std::vector<std::uint32_t>& number = first;  // in place: each refers to itself or an earlier one
  for (std::uint32_t i = 0; i < corners.size(); ++i) {
    if (first[i] == i) {
      number[i] = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back(corners[i]);
    } else {
      number[i] = number[first[i]];
    }
  }
  mesh.triangles.reserve(corners.size() / 3);
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    mesh.triangles.push_back({number[i], number[i + 1], number[i + 2]});
  }
  return mesh;
}

/// Implements detail_mesh() for a store of triangles. Throws: stream::Error on a damaged store, or
/// if the triangles do not fit in memory_bytes (the message says how much they need).
TriangleMesh detail_triangles(const stream::Store& store, const Detail& detail,
                              std::uint64_t memory_bytes) {
  std::vector<stream::Point3> corners;
  for_each_wanted_entity(store, detail, memory_bytes, kBytesPerTriangle,
                         [&](std::span<const std::byte>, std::span<const stream::Point3> triangle) {
                           corners.insert(corners.end(), triangle.begin(), triangle.end());
                         });
  return welded(std::move(corners));
}

}  // namespace

TriangleMesh detail_mesh(const stream::Store& input, const Detail& detail,
                         const DetailMeshOptions& options, const Context& context) {
  const stream::Store store = input.with_stop(context.stop);
  const MetricChoice::Kind kind = options.metric.kind;
  if (holds_lines(store.schema())) need_points(store, "a mesh");
  if (is_geocentric(store.schema().crs)) need_terrain(store, "a mesh over x and y");
  say_unknown_height_unit(Ground(store.schema()), context);
  if (entities_of(store.schema()) == stream::Entities::triangles) {
    if (kind != MetricChoice::Kind::euclidean || options.heights.any()) {
      throw UsageError(
          stream::message("triangles of a store are written as they were read: leave out {metric}, "
                          "smoothing and overlays"));
    }
    return detail_triangles(store, detail, context.memory_or(0));
  }
  std::optional<tri::MetricField2> field;
  if (kind != MetricChoice::Kind::euclidean) field = metric_field(options.metric, store);
  if (detail.cluster && options.heights.any()) {
    throw UsageError(stream::message("{cluster} excludes smoothing and overlays"));
  }
  const Detail wide = with_margin(store, detail);
  check_memory(store, wide, context.memory_or(0),
               height_bytes_per_vertex(options.heights) + (field ? kBytesToFlip : 0) +
                   (has_gaps(store) ? CollapsedClusters::bytes_per_vertex(detail) : 0));
  return store.schema().grid ? mesh_of<std::int32_t>(store, wide, options, field)
                             : mesh_of<double>(store, wide, options, field);
}

TriangleMesh detail_points(const stream::Store& store, const Detail& detail) {
  constexpr std::size_t kBlock = 65536;
  const stream::Placement& placement = store.schema();
  const bool coarse = detail.level > 0;
  TriangleMesh cloud;
  stream::PointBlock block;
  stream::Schema columns = store.schema();
  // Levels come from the store here, and numbers of points refer to the original file.
  for (stream::Channel& attribute : columns.attributes) {
    if (attribute.name == "level" || attribute.name == "representative") attribute.name.clear();
  }
  const std::size_t record_bytes = columns.payload_size();
  const auto flush = [&] {
    append_points(cloud, columns, block);
    block.clear();
  };
  for_each_wanted_point(
      store, detail,
      [&](stream::ClusterId id, const stream::ClusterPoints& points, std::size_t i,
          const stream::Point3& place) {
        const unsigned level = stream::level_of(id);
        block.positions.push_back(place);
        const auto record = points.payload.begin() + static_cast<std::ptrdiff_t>(i * record_bytes);
        block.payload.insert(block.payload.end(), record,
                             record + static_cast<std::ptrdiff_t>(record_bytes));
        if (block.size() == kBlock) flush();
        cloud.levels.push_back(static_cast<std::uint8_t>(level));
        if (!coarse) return;
        unsigned left_out = level;
        for (; left_out > 0; --left_out) {
          const unsigned below = left_out - 1;
          const stream::ClusterId headed =
              stream::cluster_id(below, points.children[i * level + below]);
          if (!detail.wants(below, world_box(placement, store.record(headed).summary.box))) break;
        }
        cloud.left_out.push_back(static_cast<std::uint8_t>(left_out));
      });
  flush();
  return cloud;
}

unsigned level_within(const stream::Store& store, std::uint64_t max_points) {
  if (store.condition() != nullptr) {
    stream::StoreQuery query(store);
    const stream::Box3 all = store.whole().bounds();
    unsigned level = store.top();
    while (level > 0 && query.count(all, level - 1) <= max_points) --level;
    return level;
  }
  for (const stream::LevelInfo& level : store.levels()) {
    if (level.points <= max_points) return level.level;
  }
  return store.top();
}

stream::Overlay open_height_overlay(const std::string& path, const stream::Store& store) {
  stream::Overlay overlay = stream::Overlay::open(path, store);
  const std::string& heights = store.schema().coordinates[2].name;
  if (overlay.channel() != heights) {
    throw stream::Error(
        path, "has values of '" + overlay.channel() + "', not of the heights '" + heights + "'")
        .remedy("pass an overlay written by terrace mesh");
  }
  return overlay;
}

}  // namespace terrace::terrain
