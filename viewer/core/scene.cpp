// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <variant>

#include <terrace/terrain/store_view.hpp>
#include <terrace/tri/geomorph.hpp>

#include "blocks.hpp"
#include "body_normals.hpp"
#include "picking.hpp"
#include "slide.hpp"
#include "stored_surface.hpp"
#include "transitions.hpp"

namespace terrace::viewer {
namespace {

using stream::Point3;

template <class Shown>
class SceneOf final : public Scene {
  /// Seconds for which removed parts stay drawn, a little longer than kSlide, and the limit of it
  /// for parts that change repeatedly.
  static constexpr double kRemovalDelay = 0.5, kLongestDelay = 3.0;

 public:
  using View = terrain::StoreView<Shown>;
  using Triangulation = terrain::ViewTriangulation<Shown>;
  static constexpr bool kRaster = std::is_same_v<Shown, tri::ThinnedDelaunay2>;
  static constexpr bool kTriangles = !std::is_same_v<Shown, tri::PointCloud>;
  using Vertex = std::conditional_t<kRaster, SceneVertex,
                                    std::conditional_t<kTriangles, SceneBodyPoint, ScenePoint>>;
  static constexpr std::uint32_t kSpareVertices = kTriangles ? Transitions<Vertex>::kVertices : 0,
                                 kSpareTriangles = kTriangles ? Transitions<Vertex>::kTriangles : 0;

  SceneOf(const stream::Store& store, const stream::LinearMap& ground,
          const tri::ViewOptions& options,
          const std::function<bool(const stream::ByteRange&)>& has_bytes)
      : store_(store), view_(store, ground, options, has_bytes), bounds_(store.bounds()) {
    const stream::Box3 all = box();
    base_[2] = (all.min[2] + all.max[2]) / 2;
    vertices_.reserve(options.max_points);
    if constexpr (kTriangles) triangles_.reserve(2 * options.max_points);
    if constexpr (!kRaster) {
      std::vector<std::byte> records;
      for (const tri::VertexId vertex : mesh().all_vertices()) {
        const auto record = view_.attributes(vertex);
        records.insert(records.end(), record.begin(), record.end());
      }
      colours_ = CloudColours(store.schema(), records);
    }
    grow();
    for (const tri::VertexId vertex : mesh().all_vertices()) place(vertex);
    if constexpr (kTriangles) {
      for (const tri::TriangleId triangle : mesh().all_triangles()) {
        triangles_.change(draw_slot(triangle)) = add(triangle);
      }
      update_normals();
    }
  }

  SceneState frame(const tri::View& view, double seconds, double time) override {
    const double start = now();
    transitions_.end_until(time);
    transitions_.sweep();
    update_gaps(start + seconds / 2);
    const auto& step = view_.frame(view, seconds - (now() - start), point_cost_);
    const double begin = now();
    apply(*step.delta, time);
    added_points_ += static_cast<double>(step.delta->changes.added_vertices.size());
    removed_points_ += static_cast<double>(step.delta->changes.removed_vertices.size());
    apply_seconds_ += now() - begin;
    const terrain::ViewTraffic traffic = view_.traffic();
    SceneState state{.points = view_.points(),
                     .expanded = view_.model().expanded_count(),
                     .vertex_slots = kSpareVertices + vertex_slots(),
                     .settled = view_.settled(),
                     .waiting = !transitions_.empty() || unsure_ > 0,
                     .worst = step.worst,
                     .clusters = static_cast<std::size_t>(traffic.clusters),
                     .stored_bytes = static_cast<std::size_t>(traffic.bytes)};
    if constexpr (kTriangles) {
      state.triangles = mesh().triangle_count() - gaps_;
      state.triangle_slots = kSpareTriangles + mesh().triangle_slots();
    }
    return state;
  }
  const SceneChanges& take_changes() override {
    const double begin = now();
    vertices_.take(changes_.vertex_blocks, changed_vertices_);
    changes_.vertices = std::as_bytes(std::span(changed_vertices_));
    triangles_.take(changes_.triangle_blocks, changes_.triangles);
    // Copying the result costs as much as collecting it.
    learn_point_cost(apply_seconds_ + 2 * (now() - begin));
    added_points_ = removed_points_ = apply_seconds_ = 0;
    return changes_;
  }
  [[nodiscard]] std::span<const stream::ByteRange> missing() const override {
    return view_.missing();
  }
  void restore(double time) override {
    if constexpr (kTriangles && !kRaster) apply(view_.restore(), time);
  }
  [[nodiscard]] std::uint64_t hash() const override { return mesh().hash(); }
  [[nodiscard]] std::optional<SceneHit> pick(const Point3& origin, const Point3& direction,
                                             double angle) const override;
  [[nodiscard]] std::vector<std::array<std::uint32_t, 2>> outline(
      tri::ClusterId cluster) const override;
  void pin(tri::ClusterId cluster, tri::ViewPin pin) override {
    if (pin == tri::ViewPin::collapsed && tri::level_of(cluster) >= view_.model().top()) return;
    view_.pin(cluster, pin);
    pinned_.push_back(cluster);
  }
  void release() override {
    for (const tri::ClusterId id : pinned_) view_.unpin(id);
    pinned_.clear();
  }
  [[nodiscard]] const CloudColours& colours() const override { return colours_; }
  [[nodiscard]] stream::Box3 box() const override {
    stream::Box3 box;
    for (unsigned corner = 0; corner < 8; ++corner) {
      box.include(view_.in_view_frame(Point3{(corner & 1 ? bounds_.max : bounds_.min)[0],
                                             (corner & 2 ? bounds_.max : bounds_.min)[1],
                                             (corner & 4 ? bounds_.max : bounds_.min)[2]}));
    }
    return box;
  }

 private:
  static double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
  /// Estimates the cost of an added and of a removed point by normalised least mean squares.
  /// Estimates rise fast and fall slowly. A measurement counts as at most twice the expected cost,
  /// because other programs may have disturbed it. measured: in seconds.
  void learn_point_cost(double measured) {
    const double size = added_points_ * added_points_ + removed_points_ * removed_points_;
    if (size < 64 * 64) return;
    const double expected = added_points_ * point_cost_[0] + removed_points_ * point_cost_[1];
    if (expected > 0) measured = std::min(measured, 2 * expected + 5e-4);
    const double error = measured - expected;
    const double step = (expected == 0 ? 1.0 : error > 0 ? 0.5 : 0.02) * error / size;
    point_cost_[0] = std::max(0.0, point_cost_[0] + step * added_points_);
    point_cost_[1] = std::max(0.0, point_cost_[1] + step * removed_points_);
  }
  [[nodiscard]] const auto& mesh() const { return view_.model().triangulation(); }
  [[nodiscard]] std::uint32_t vertex_slots() const {
    if constexpr (kRaster) return mesh().dense_slots();
    return mesh().vertex_slots();
  }
  /// A removed vertex has a slot until others are placed.
  [[nodiscard]] std::uint32_t draw_slot(tri::VertexId v) const {
    if constexpr (kRaster) return drawn_at_[slot(v)];
    return kSpareVertices + slot(v);
  }
  [[nodiscard]] static std::uint32_t draw_slot(tri::TriangleId t) {
    return kSpareTriangles + slot(t);
  }
  [[nodiscard]] SceneTriangle draw_slot(const std::array<tri::VertexId, 3>& corners) const {
    return {draw_slot(corners[0]), draw_slot(corners[1]), draw_slot(corners[2])};
  }
  void grow() {
    vertices_.grow(kSpareVertices + vertex_slots());
    is_queued_.resize(mesh().vertex_slots());
    if constexpr (kRaster) drawn_at_.resize(mesh().vertex_slots());
    if constexpr (kTriangles) triangles_.grow(kSpareTriangles + mesh().triangle_slots());
    if constexpr (kRaster) spans_gap_.resize(has_gaps_ ? mesh().triangle_slots() : 0);
    if constexpr (kTriangles && !kRaster) normals_.grow(mesh().vertex_slots());
  }
  /// Places a vertex without sliding.
  void place(tri::VertexId vertex) {
    if constexpr (kRaster) drawn_at_[slot(vertex)] = kSpareVertices + mesh().dense_slot(vertex);
    const Point3 p = difference(view_.in_view_frame(vertex), base_);
    Vertex& v = vertices_.change(draw_slot(vertex));
    v.x = static_cast<float>(p[0]);
    v.y = static_cast<float>(p[1]);
    v.z = static_cast<float>(p[2]);
    v.level = static_cast<std::uint8_t>(view_.model().level(vertex));
    if constexpr (kTriangles) v.start_time = -1e9F;
    if constexpr (!kRaster) {
      const CloudColour colour = colours_(view_.attributes(vertex));
      v.rgb = colour.rgb;
      v.group = colour.group;
      v.intensity = colour.intensity;
    }
    if constexpr (kTriangles && !kRaster) normals_.place(slot(vertex), mesh().point(vertex));
  }
  template <class Delta>
  void apply(const Delta& delta, double time);
  /// Adds a triangle. Returns its corners as they are drawn.
  SceneTriangle add(tri::TriangleId triangle) {
    const auto corners = mesh().vertices(triangle);
    for (const tri::VertexId corner : corners) queue_normal(corner);
    if constexpr (!kRaster) normals_.add({slot(corners[0]), slot(corners[1]), slot(corners[2])});
    return drawn_triangle(triangle);
  }
  void queue_normal(tri::VertexId vertex) {
    if (slot(vertex) >= is_queued_.size() || is_queued_[slot(vertex)]) return;
    is_queued_[slot(vertex)] = true;
    stale_normals_.push_back(vertex);
  }
  void update_normals();
  /// SceneHit::expandable of a vertex that is a member of `cluster`.
  [[nodiscard]] std::optional<tri::ClusterId> cluster_to_expand(tri::VertexId vertex,
                                                                tri::ClusterId cluster) const;
  template <class Place>
  [[nodiscard]] Point3 to_draw(const Place& place) const {
    return difference(view_.model_in_view_frame(place), base_);
  }
  void slide(const tri::Slides& slides, double time) {
    for (std::size_t i = 0; i < slides.size(); ++i) {
      start_slide(vertices_.change(draw_slot(slides.vertices[i])), to_draw(slides.start[i]),
                  to_draw(slides.end[i]), time);
    }
  }
  template <class Delta>
  void delay_removals(const Delta& delta, double time);
  [[nodiscard]] Point3 position(tri::VertexId vertex) const {
    const Vertex& v = vertices_[draw_slot(vertex)];
    return {v.x + base_[0], v.y + base_[1], v.z + base_[2]};
  }

  /// Returns the triangle as it is drawn: empty where a raster has no data.
  [[nodiscard]] SceneTriangle drawn_triangle(tri::TriangleId triangle) {
    if (has_gaps_) set_gap(triangle, view_.spans_gap(triangle));
    return is_gap(triangle) ? SceneTriangle{} : draw_slot(mesh().vertices(triangle));
  }
  void set_gap(tri::TriangleId triangle, bool spans) {
    gaps_ += static_cast<std::size_t>(spans) - static_cast<std::size_t>(is_gap(triangle));
    spans_gap_[slot(triangle)] = spans;
  }
  [[nodiscard]] bool is_gap(tri::TriangleId triangle) const {
    return has_gaps_ && spans_gap_[slot(triangle)];
  }
  void update_gaps(double until);

  stream::Store store_;
  View view_;
  stream::Box3 bounds_;
  /// Origin of the drawn coordinates: the middle of the heights, because floats far from 0 are
  /// coarse.
  Point3 base_{};
  CloudColours colours_;
  Blocks<Vertex> vertices_;
  std::vector<Vertex> changed_vertices_;
  Blocks<SceneTriangle> triangles_;
  SceneChanges changes_;
  std::vector<std::uint32_t> drawn_at_;  // of a raster's vertices, by slot; see draw_slot()
  std::vector<bool> is_queued_;          // in stale_normals_, by slot
  std::vector<tri::VertexId> stale_normals_, ring_;
  std::vector<tri::TriangleId> around_;
  std::vector<tri::ClusterId> pinned_;
  bool has_gaps_ = view_.has_gaps();
  std::vector<bool> spans_gap_;  ///< whether a triangle spans a gap, by slot
  std::size_t gaps_ = 0;         ///< number of triangles that span one
  /// Triangle slots to check from next_unsure_ on; see update_gaps().
  std::uint32_t unsure_ = 0, next_unsure_ = 0;
  /// Seconds that the changes of an added, or removed, point cost after a step.
  std::array<double, 2> point_cost_{};
  double apply_seconds_ = 0, added_points_ = 0,
         removed_points_ = 0;  ///< since changes were last taken
  /// Unused for points.
  std::conditional_t<kTriangles, tri::Geomorph<typename Triangulation::type>, std::monostate>
      morph_;
  BodyNormals normals_;  // for surfaces in space
  Transitions<Vertex> transitions_{vertices_, triangles_};
  /// A connected part of the last step.
  struct Part {
    std::uint32_t vertices = 0, triangles = 0;  ///< removed ones
    std::uint32_t added = 0;                    ///< vertices
    bool delayed = false;
    std::uint32_t group = 0;
  };
  std::vector<Part> parts_;
  /// By drawn slot of a removed vertex: the part that removes it, then the slot where it stays
  /// drawn. Unset between calls.
  std::vector<std::uint32_t> redirect_;
  /// Removed triangles that are still drawn and have such a vertex, and their groups.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> redirected_triangles_;
};

/// Checks whether triangles span gaps. Newly read clusters can change that for triangles far from
/// them, so all triangles are checked in turn, a thousand per frame. If there is no other work, the
/// check continues for up to half of the frame.
template <class Shown>
void SceneOf<Shown>::update_gaps(double until) {
  constexpr std::uint32_t kAtOnce = 1024;
  const bool settled = view_.settled() && transitions_.empty();
  if constexpr (kRaster) {
    if (!has_gaps_) return;
    const std::uint32_t slots = mesh().triangle_slots();
    if (!settled) unsure_ = slots;
    for (std::uint32_t checks = 0; unsure_ > 0; --unsure_) {
      if (++checks % kAtOnce == 0 && (!settled || now() > until)) break;
      next_unsure_ = (next_unsure_ + 1) % slots;
      const tri::TriangleId triangle{next_unsure_};
      const std::uint32_t at = draw_slot(triangle);
      if (!mesh().alive(triangle) || transitions_.hiding(at) != Transitions<Vertex>::kNone)
        continue;
      const SceneTriangle corners = drawn_triangle(triangle);
      if (triangles_[at] == corners) continue;
      triangles_.change(at) = corners;
      for (const tri::VertexId corner : mesh().vertices(triangle)) queue_normal(corner);
    }
    update_normals();
  }
}

/// Delays the removal of the connected parts of a step that only remove vertices (collapses) or,
/// for a raster, remove more than they add. If a part changes hidden triangles, it joins the group
/// that hides them. If the part is not delayed, that group ends.
template <class Shown>
template <class Delta>
void SceneOf<Shown>::delay_removals(const Delta& delta, double time) {
  constexpr std::uint32_t kNone = Transitions<Vertex>::kNone;
  const auto& changes = delta.changes;
  const auto& numbers = morph_.parts;
  parts_.assign(numbers.count, {});
  for (const std::uint32_t p : numbers.removed) ++parts_[p].vertices;
  for (const std::uint32_t p : numbers.removed_triangles) ++parts_[p].triangles;
  for (const std::uint32_t p : numbers.added) ++parts_[p].added;
  std::size_t vertices = transitions_.vertex_room(), triangles = transitions_.triangle_room();
  for (Part& part : parts_) {
    // A window of a raster becomes coarser by many vertices that go and a few that come.
    const bool shrinks = kRaster ? part.vertices > part.added : part.added == 0;
    part.delayed =
        shrinks && part.vertices > 0 && part.vertices <= vertices && part.triangles <= triangles;
    if (!part.delayed) continue;
    vertices -= part.vertices;
    triangles -= part.triangles;
  }

  redirect_.resize(vertices_.size(), kNone);
  for (std::size_t i = 0; i < numbers.removed.size(); ++i) {
    redirect_[draw_slot(morph_.removed.vertices[i])] = numbers.removed[i];
  }
  const auto for_each_affected = [&](const auto& visit) {
    if (transitions_.empty()) return;
    for (std::size_t i = 0; i < changes.removed_triangles.size(); ++i) {
      const std::uint32_t group = transitions_.hiding(draw_slot(changes.removed_triangles[i]));
      if (group != kNone) visit(parts_[numbers.removed_triangles[i]], group);
    }
    for (const auto& [removed_slot, group] : redirected_triangles_) {
      for (const std::uint32_t corner : triangles_[removed_slot]) {
        if (redirect_[corner] != kNone) visit(parts_[redirect_[corner]], group);
      }
    }
  };
  // On the hull a vertex may lose all its triangles without getting new ones, so this also checks
  // the removed triangles that are still drawn.
  const auto find_redirected_triangles = [&] {
    redirected_triangles_.clear();
    if (numbers.removed.empty()) return;
    transitions_.for_each_triangle([&](std::uint32_t removed_slot, std::uint32_t group) {
      const auto& [a, b, c] = triangles_[removed_slot];
      if ((redirect_[a] & redirect_[b] & redirect_[c]) != kNone)
        redirected_triangles_.emplace_back(removed_slot, group);
    });
  };
  find_redirected_triangles();
  for_each_affected([&](const Part& part, std::uint32_t group) {
    if (!part.delayed || time - transitions_.begin(group) > kLongestDelay) transitions_.end(group);
  });
  if (transitions_.sweep()) find_redirected_triangles();
  for (Part& part : parts_) {
    if (part.delayed) part.group = transitions_.open(time, time + kRemovalDelay);
  }
  for_each_affected(
      [&](const Part& part, std::uint32_t group) { transitions_.join(part.group, group); });

  for (std::size_t i = 0; i < transitions_.anchors().size(); ++i) {
    const tri::Anchor& anchor = transitions_.anchors()[i];
    if (!anchor.moved) continue;
    Vertex& v = vertices_.change(transitions_.slot_of_anchor(i));
    start_slide(v, position_at(v, time), to_draw(anchor.end), time);
  }
  for (std::size_t i = 0; i < numbers.removed.size(); ++i) {
    const Part& part = parts_[numbers.removed[i]];
    std::uint32_t& on = redirect_[draw_slot(morph_.removed.vertices[i])];
    on = kNone;
    if (!part.delayed) continue;
    Vertex v = vertices_[draw_slot(morph_.removed.vertices[i])];
    start_slide(v, position_at(v, time), to_draw(morph_.removed.end[i]), time);
    on = transitions_.keep(
        part.group, v,
        {morph_.removed.start[i], morph_.removed.end[i], morph_.removed_on[i], false});
  }
  const auto redirected = [&](SceneTriangle corners) {
    for (std::uint32_t& corner : corners) {
      if (redirect_[corner] != kNone) corner = redirect_[corner];
    }
    return corners;
  };
  for (const auto& [removed_slot, group] : redirected_triangles_) {
    triangles_.change(removed_slot) = redirected(triangles_[removed_slot]);
  }
  for (std::size_t i = 0; i < changes.removed_triangles.size(); ++i) {
    const Part& part = parts_[numbers.removed_triangles[i]];
    const std::uint32_t triangle = draw_slot(changes.removed_triangles[i]);
    if (!part.delayed) continue;
    if (transitions_.hiding(triangle) != kNone) {
      transitions_.forget(triangle);
    } else if (triangles_[triangle] != SceneTriangle{}) {
      transitions_.keep(part.group, redirected(triangles_[triangle]));
    }
  }
  for (const tri::VertexId vertex : morph_.removed.vertices) redirect_[draw_slot(vertex)] = kNone;
}

template <class Shown>
template <class Delta>
void SceneOf<Shown>::apply(const Delta& delta, double time) {
  grow();
  const auto& changes = delta.changes;
  if constexpr (kTriangles) {
    if (changes.removed_triangles.empty() && changes.added_triangles.empty() &&
        changes.removed_vertices.empty() && changes.added_vertices.empty() &&
        delta.reassigned.empty()) {
      return;
    }
    morph_.make(view_.model(), delta, true, transitions_.anchors());
    delay_removals(delta, time);
    for (std::size_t i = 0; i < changes.removed_triangles.size(); ++i) {
      const auto& c = changes.removed_corners[i];
      if constexpr (!kRaster) normals_.remove({slot(c[0]), slot(c[1]), slot(c[2])});
      triangles_.change(draw_slot(changes.removed_triangles[i])) = {};
      if (has_gaps_) set_gap(changes.removed_triangles[i], false);
    }
  }
  for (const tri::VertexId vertex : changes.removed_vertices)
    vertices_.change(draw_slot(vertex)) = {};
  for (const tri::VertexId vertex : changes.added_vertices) place(vertex);
  for (const tri::VertexId vertex : delta.reassigned) place(vertex);
  if constexpr (kTriangles) {
    for (std::size_t i = 0; i < changes.added_triangles.size(); ++i) {
      const tri::TriangleId triangle = changes.added_triangles[i];
      const Part& part = parts_[morph_.parts.added_triangles[i]];
      const SceneTriangle corners = add(triangle);
      if (part.delayed) {
        transitions_.hide(part.group, draw_slot(triangle), corners);
      } else {
        triangles_.change(draw_slot(triangle)) = corners;
      }
    }
    for (const auto& corners : changes.removed_corners) {
      for (const tri::VertexId vertex : corners) queue_normal(vertex);
    }
    if constexpr (kRaster) {
      for (const tri::VertexId vertex : delta.reassigned) {
        queue_normal(vertex);
        mesh().adjacent(vertex, ring_);
        for (const tri::VertexId other : ring_) queue_normal(other);
      }
    }
    update_normals();
    slide(morph_.added, time);
    slide(morph_.reassigned, time);
  }
}

template <class Shown>
void SceneOf<Shown>::update_normals() {
  if constexpr (kTriangles && !kRaster) {
    for (const tri::VertexId vertex : stale_normals_) {
      is_queued_[slot(vertex)] = false;
      if (mesh().alive(vertex)) vertices_.change(draw_slot(vertex)).normal = normals_[slot(vertex)];
    }
    stale_normals_.clear();
  }
  if constexpr (kRaster) {
    for (const tri::VertexId vertex : stale_normals_) {
      is_queued_[slot(vertex)] = false;
      if (!mesh().alive(vertex)) continue;
      Point3 sum{};
      mesh().triangles_around(vertex, around_);
      for (const tri::TriangleId triangle : around_) {
        if (is_gap(triangle)) continue;
        const auto c = mesh().vertices(triangle);
        const Point3 a = position(c[0]);
        const Point3 normal = cross(difference(position(c[1]), a), difference(position(c[2]), a));
        // Rows grow downward, so the same triangle has the opposite orientation in the view frame.
        const double sign = normal[2] < 0 ? -1 : 1;
        for (std::size_t k = 0; k < 3; ++k) sum[k] += sign * normal[k];
      }
      const double length = std::sqrt(dot(sum, sum));
      SceneVertex& v = vertices_.change(draw_slot(vertex));
      for (std::size_t k = 0; k < 3; ++k) {
        v.normal[k] = length > 0 ? static_cast<std::int8_t>(std::lround(127 * sum[k] / length))
                                 : static_cast<std::int8_t>(k == 2 ? 127 : 0);
      }
    }
    stale_normals_.clear();
  }
}

template <class Shown>
std::optional<SceneHit> SceneOf<Shown>::pick(const Point3& origin, const Point3& direction,
                                             double angle) const {
  const double length = std::sqrt(dot(direction, direction));
  const Point3 unit{direction[0] / length, direction[1] / length, direction[2] / length};
  double best = std::numeric_limits<double>::infinity();
  std::optional<SceneHit> hit;
  const auto hit_at = [&](tri::VertexId vertex, const Point3& stored, const Point3& place) {
    const tri::PointId id = view_.model().point_id(vertex);
    hit = {.stored = stored,
           .place = place,
           .level = tri::level_of(id.cluster),
           .cluster = id.cluster,
           .expandable = cluster_to_expand(vertex, id.cluster)};
    // The page reads those of rasters from the store.
    if constexpr (kRaster) return;
    const stream::StoreSchema& schema = store_.schema();
    const auto record = view_.attributes(vertex);
    for (std::size_t i = 0; i < schema.attributes.size() && !record.empty(); ++i) {
      hit->attributes.push_back(
          stream::to_double(schema.attributes[i].type, record.data() + schema.attribute_offset(i)));
    }
  };
  if constexpr (kTriangles) {
    // Points on one line have no triangles and are drawn as points.
    if (mesh().triangle_count() > gaps_) {
      const auto found = first_hit(
          mesh(), origin, unit, [this](tri::VertexId v) { return position(v); },
          [this](tri::TriangleId triangle) { return is_gap(triangle); });
      if (!found) return {};
      const auto vertices = mesh().vertices(found->triangle);
      Point3 stored{};
      for (std::size_t i = 0; i < 3; ++i) {
        const Point3 corner = view_.stored(vertices[i]);
        for (std::size_t k = 0; k < 3; ++k) stored[k] += found->weights[i] * corner[k];
      }
      const std::size_t nearest = found->nearest();
      const double along = found->distance;
      hit_at(
          vertices[nearest], stored,
          {origin[0] + along * unit[0], origin[1] + along * unit[1], origin[2] + along * unit[2]});
      const Point3 aside = difference(position(vertices[nearest]), hit->place);
      // Positions were rounded to floats.
      const Point3 size = difference(box().max, box().min);
      hit->corner_distance =
          1.001 * std::sqrt(dot(aside, aside)) + 1e-6 * std::sqrt(dot(size, size));
      return hit;
    }
  }
  for (const tri::VertexId vertex : mesh().all_vertices()) {
    const Point3 place = position(vertex), to = difference(place, origin);
    const double along = dot(to, unit);
    if (along <= 0) continue;
    const double aside = std::sqrt(std::max(0.0, dot(to, to) - along * along)) / along;
    // Among points that are about equally near to the line, the one nearest to the eye hides the
    // others.
    if (aside > angle || along * (1 + aside / angle) >= best) continue;
    best = along * (1 + aside / angle);
    hit_at(vertex, view_.stored(vertex), place);
  }
  return hit;
}

template <class Shown>
std::optional<tri::ClusterId> SceneOf<Shown>::cluster_to_expand(tri::VertexId vertex,
                                                                tri::ClusterId cluster) const {
  std::vector<tri::ClusterId> heads;
  view_.model().heads(vertex, heads);
  for (const tri::ClusterId id : heads) {
    if (view_.model().can_expand(id)) return id;
  }
  // All samples around it are known, of which a raster shows only some.
  if (!kRaster) return {};
  const tri::ClusterId finest = heads.empty() ? cluster : heads.back();
  const bool shows_some = tri::level_of(finest) == 0 && view_.model().top() > 0;
  if (!shows_some || !view_.model().is_expanded(finest)) return {};
  return finest;
}

template <class Shown>
std::vector<std::array<std::uint32_t, 2>> SceneOf<Shown>::outline(tri::ClusterId cluster) const {
  std::vector<std::array<std::uint32_t, 2>> lines;
  const auto& model = view_.model();
  if (tri::level_of(cluster) >= model.top() || !model.is_expanded(cluster)) return lines;
  std::vector<tri::ClusterId> inside{cluster}, children;
  for (std::size_t i = 0; i < inside.size(); ++i) {
    model.children(inside[i], children);
    for (const tri::ClusterId child : children) {
      if (model.is_expanded(child)) inside.push_back(child);
    }
  }
  std::sort(inside.begin(), inside.end());
  std::vector<bool> is_inside(vertices_.size());
  for (const tri::VertexId vertex : mesh().all_vertices()) {
    is_inside[draw_slot(vertex)] =
        std::binary_search(inside.begin(), inside.end(), model.point_id(vertex).cluster);
  }
  const tri::VertexId head = model.head_vertex(cluster);
  if (mesh().alive(head)) is_inside[draw_slot(head)] = true;
  if constexpr (!kTriangles) {
    for (std::uint32_t i = 0; i < is_inside.size(); ++i) {
      if (is_inside[i]) lines.push_back({i, i});
    }
  } else {
    // An edge between two triangles inside appears twice, once in each direction.
    std::vector<std::array<std::uint32_t, 2>> edges;
    for (const tri::TriangleId triangle : mesh().all_triangles()) {
      const SceneTriangle c = draw_slot(mesh().vertices(triangle));
      // Few samples of a raster's cluster are vertices, so triangles that reach into it count.
      const int corners = is_inside[c[0]] + is_inside[c[1]] + is_inside[c[2]];
      if (corners < (kRaster ? 1 : 3) || is_gap(triangle)) continue;
      for (std::size_t i = 0; i < 3; ++i) edges.push_back({c[i], c[(i + 1) % 3]});
    }
    return outline_of(edges);
  }
  return lines;
}

}  // namespace

std::unique_ptr<Scene> Scene::open(const stream::Store& store, const stream::LinearMap& ground,
                                   std::size_t max_points,
                                   const std::function<bool(const stream::ByteRange&)>& has_bytes) {
  if (store.points() == 0) throw std::invalid_argument("the store has no points");
  tri::ViewOptions options;
  options.max_points = max_points;
  options.max_cached_bytes = std::size_t{128} << 20;
  options.model.reserve = max_points;
#ifdef TERRACE_VIEWER_BODY
  if (shows_stored_surface(store)) return open_stored_surface(store, ground, max_points);
  return std::make_unique<SceneOf<tri::DynamicSurface<std::int32_t>>>(store, ground, options,
                                                                      has_bytes);
#else
  if (store.schema().grid) {
    options.model.old_heights = true;  // for the slides
    return std::make_unique<SceneOf<tri::ThinnedDelaunay2>>(store, ground, options, has_bytes);
  }
  return std::make_unique<SceneOf<tri::PointCloud>>(store, ground, options, has_bytes);
#endif
}

}  // namespace terrace::viewer
