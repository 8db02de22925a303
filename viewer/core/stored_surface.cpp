// SPDX-License-Identifier: GPL-3.0-or-later
#include "stored_surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <terrace/terrain/surface_view.hpp>

#include "blocks.hpp"
#include "body_normals.hpp"
#include "picking.hpp"
#include "slide.hpp"

namespace terrace::viewer {
namespace {

using stream::Point3;

/// New vertices slide from where their parents are drawn, at which the surface looks as it did
/// before. Vertices that are removed vanish at once: the change is smaller than the error.
class StoredSurfaceScene final : public Scene {
 public:
  StoredSurfaceScene(const stream::Store& store, const stream::LinearMap& ground,
                     const tri::ViewOptions& options)
      : store_(store), view_(store, ground, options), slot_of_(view_.surface().size(), kNone) {
    box_.include(view_.in_view_frame(store.bounds().min));
    box_.include(view_.in_view_frame(store.bounds().max));
    base_[2] = (box_.min[2] + box_.max[2]) / 2;
    double side = 0.0;
    for (std::size_t k = 0; k < 3; ++k) side = std::max(side, box_.max[k] - box_.min[k]);
    node_scale_ = side > 0.0 ? kNodes / side : 1.0;
    std::vector<std::byte> records;
    for (std::uint32_t v = 0; v < view_.surface().size(); ++v) {
      const auto record = view_.attributes(tri::VertexId{v});
      records.insert(records.end(), record.begin(), record.end());
    }
    colours_ = CloudColours(store.schema(), records);
    for (const stream::LevelInfo& level : store.levels()) {
      clusters_ += level.clusters;
      bytes_ += level.bytes;
    }
    bytes_ += store.surface()->bytes;
    for (const tri::VertexId v : surface().all_vertices()) place(v);
    for (const tri::TriangleId t : surface().all_triangles()) add(t);
    update_normals();
  }

  SceneState frame(const tri::View& view, double seconds, double time) override {
    const auto& step = view_.frame(view, seconds, {kSecondsPerVertex, kSecondsPerVertex});
    apply(*step.changes, time);
    return {.points = surface().vertex_count(),
            .triangles = surface().triangle_count(),
            .vertex_slots = vertices_.size(),
            .triangle_slots = surface().triangle_slots(),
            .settled = view_.settled(),
            .worst = step.worst,
            .clusters = clusters_,
            .stored_bytes = bytes_};
  }
  const SceneChanges& take_changes() override {
    vertices_.take(changes_.vertex_blocks, changed_vertices_);
    changes_.vertices = std::as_bytes(std::span(changed_vertices_));
    triangles_.take(changes_.triangle_blocks, changes_.triangles);
    return changes_;
  }
  [[nodiscard]] std::span<const stream::ByteRange> missing() const override { return {}; }
  void restore(double) override {}
  [[nodiscard]] std::uint64_t hash() const override { return surface().hash(); }

  [[nodiscard]] std::optional<SceneHit> pick(const Point3& origin, const Point3& direction,
                                             double) const override {
    const double length = std::sqrt(dot(direction, direction));
    const Point3 unit{direction[0] / length, direction[1] / length, direction[2] / length};
    const auto found = first_hit(
        surface(), origin, unit, [this](tri::VertexId v) { return view_.in_view_frame(v); },
        [](tri::TriangleId) { return false; });
    if (!found) return {};
    const auto corners = surface().vertices(found->triangle);
    const tri::VertexId vertex = corners[found->nearest()];
    SceneHit hit;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        hit.stored[k] += found->weights[i] * view_.stored(corners[i])[k];
      }
    }
    for (std::size_t k = 0; k < 3; ++k) hit.place[k] = origin[k] + found->distance * unit[k];
    hit.cluster = view_.cluster(vertex);
    hit.level = tri::level_of(hit.cluster);
    hit.expandable = view_.expandable(vertex);
    const Point3 aside = difference(view_.in_view_frame(vertex), hit.place);
    hit.corner_distance = 1.001 * std::sqrt(dot(aside, aside));
    const stream::StoreSchema& schema = store_.schema();
    const auto record = view_.attributes(vertex);
    for (std::size_t i = 0; i < schema.attributes.size(); ++i) {
      hit.attributes.push_back(
          stream::to_double(schema.attributes[i].type, record.data() + schema.attribute_offset(i)));
    }
    return hit;
  }
  void pin(tri::ClusterId cluster, tri::ViewPin pin) override {
    if (pin == tri::ViewPin::collapsed && tri::level_of(cluster) >= store_.top()) return;
    view_.pin(cluster, pin);
    pinned_.push_back(cluster);
  }
  void release() override {
    for (const tri::ClusterId id : pinned_) view_.unpin(id);
    pinned_.clear();
  }
  [[nodiscard]] std::vector<std::array<std::uint32_t, 2>> outline(
      tri::ClusterId cluster) const override {
    std::vector<std::array<std::uint32_t, 2>> edges;
    for (const tri::TriangleId t : surface().all_triangles()) {
      const auto corners = surface().vertices(t);
      if (!std::all_of(corners.begin(), corners.end(),
                       [&](tri::VertexId v) { return view_.is_in(cluster, v); })) {
        continue;
      }
      const SceneTriangle c = drawn(corners);
      for (std::size_t i = 0; i < 3; ++i) edges.push_back({c[i], c[(i + 1) % 3]});
    }
    return outline_of(edges);
  }
  [[nodiscard]] const CloudColours& colours() const override { return colours_; }
  [[nodiscard]] stream::Box3 box() const override { return box_; }

 private:
  static constexpr std::uint32_t kNone = 0xffffffff;
  /// Nodes along the longest side of the box, for BodyNormals.
  static constexpr double kNodes = 1 << 29;
  /// Work of a changed vertex after a step, to be kept free.
  static constexpr double kSecondsPerVertex = 2e-6;

  [[nodiscard]] const tri::SurfaceFront& surface() const { return view_.surface(); }
  [[nodiscard]] SceneTriangle drawn(const std::array<tri::VertexId, 3>& corners) const {
    return {slot_of_[slot(corners[0])], slot_of_[slot(corners[1])], slot_of_[slot(corners[2])]};
  }
  /// Draws a vertex at its place.
  void place(tri::VertexId vertex) {
    std::uint32_t at = used_;
    if (free_.empty()) {
      ++used_;
    } else {
      at = free_.back();
      free_.pop_back();
    }
    slot_of_[slot(vertex)] = at;
    vertices_.grow(used_);
    normals_.grow(used_);
    is_queued_.resize(used_);
    const Point3 p = view_.in_view_frame(vertex);
    SceneBodyPoint& v = vertices_.change(at);
    v = {};
    v.x = static_cast<float>(p[0] - base_[0]);
    v.y = static_cast<float>(p[1] - base_[1]);
    v.z = static_cast<float>(p[2] - base_[2]);
    v.level = static_cast<std::uint8_t>(tri::level_of(view_.cluster(vertex)));
    const CloudColour colour = colours_(view_.attributes(vertex));
    v.rgb = colour.rgb;
    v.group = colour.group;
    v.intensity = colour.intensity;
    BodyNormals::Node node;
    for (std::size_t k = 0; k < 3; ++k) {
      node[k] = static_cast<std::int32_t>(std::lround((p[k] - box_.min[k]) * node_scale_));
    }
    normals_.place(at, node);
    queue_normal(at);
  }
  void add(tri::TriangleId triangle) {
    const SceneTriangle corners = drawn(surface().vertices(triangle));
    triangles_.grow(surface().triangle_slots());
    triangles_.change(slot(triangle)) = corners;
    normals_.add(corners);
    for (const std::uint32_t corner : corners) queue_normal(corner);
  }
  void queue_normal(std::uint32_t at) {
    if (is_queued_[at]) return;
    is_queued_[at] = true;
    stale_normals_.push_back(at);
  }
  void update_normals() {
    for (const std::uint32_t at : stale_normals_) {
      is_queued_[at] = false;
      if (vertices_[at].level != SceneVertex::kNone) vertices_.change(at).normal = normals_[at];
    }
    stale_normals_.clear();
  }
  void apply(const tri::SurfaceFront::Changes& changes, double time) {
    for (std::size_t i = 0; i < changes.removed_triangles.size(); ++i) {
      const SceneTriangle corners = drawn(changes.removed_corners[i]);
      normals_.remove(corners);
      triangles_.change(slot(changes.removed_triangles[i])) = {};
      for (const std::uint32_t corner : corners) queue_normal(corner);
    }
    for (const tri::VertexId vertex : changes.removed_vertices) {
      std::uint32_t& at = slot_of_[slot(vertex)];
      vertices_.change(at) = {};
      free_.push_back(at);
      at = kNone;
    }
    // Parents before their children.
    added_ = changes.added_vertices;
    std::sort(added_.begin(), added_.end());
    for (const tri::VertexId vertex : added_) {
      place(vertex);
      const tri::VertexId parent = surface().parent(vertex);
      if (parent == tri::kNoVertex) continue;
      SceneBodyPoint& v = vertices_.change(slot_of_[slot(vertex)]);
      const Point3 from = position_at(vertices_[slot_of_[slot(parent)]], time);
      start_slide(v, from, {v.x, v.y, v.z}, time);
    }
    for (const tri::TriangleId triangle : changes.added_triangles) add(triangle);
    update_normals();
  }

  stream::Store store_;
  terrain::SurfaceView view_;
  stream::Box3 box_;
  Point3 base_{};  ///< as in other scenes: the middle of the heights
  double node_scale_ = 1.0;
  CloudColours colours_;
  std::size_t clusters_ = 0, bytes_ = 0;
  std::vector<std::uint32_t> slot_of_;  ///< of each vertex of the surface, if it is drawn
  std::vector<std::uint32_t> free_;
  std::uint32_t used_ = 0;
  Blocks<SceneBodyPoint> vertices_;
  std::vector<SceneBodyPoint> changed_vertices_;
  Blocks<SceneTriangle> triangles_;
  SceneChanges changes_;
  BodyNormals normals_;
  std::vector<bool> is_queued_;
  std::vector<std::uint32_t> stale_normals_;
  std::vector<tri::VertexId> added_;
  std::vector<tri::ClusterId> pinned_;
};

}  // namespace

bool shows_stored_surface(const stream::Store& store) {
  constexpr std::uint64_t kMostBytes = 48 << 20, kMostPoints = 2'000'000;
  if (!terrain::SurfaceView::serves(store)) return false;
  std::uint64_t bytes = store.surface()->bytes;
  for (const stream::LevelInfo& level : store.levels()) bytes += level.bytes;
  return bytes <= kMostBytes && store.points() <= kMostPoints;
}

std::unique_ptr<Scene> open_stored_surface(const stream::Store& store,
                                           const stream::LinearMap& ground,
                                           std::size_t max_points) {
  tri::ViewOptions options;
  options.max_points = max_points;
  return std::make_unique<StoredSurfaceScene>(store, ground, options);
}

}  // namespace terrace::viewer
