// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "check_input.hpp"
#include "owners.hpp"
#include "terrace/tri/multiresolution.hpp"
#include "tree.hpp"

/// Implements the templates of multiresolution.hpp, for files that instantiate them.

namespace terrace::tri {

/// The model's requirements on a triangulation, which all triangulations of this library meet. The
/// result of any sequence of calls must be a function of the point set alone, so that collapse is
/// the exact inverse of expand. Point is an array of 2 or 3 coordinates, integers of at most 30
/// bits or doubles.
template <class T>
concept DynamicTriangulation = requires(T t, const T& c, std::span<const typename T::Point> points,
                                        std::span<typename T::Insertion> results, VertexId hint,
                                        std::span<const VertexId> vertices,
                                        typename T::Changes& changes) {
  { t.build(points) } -> std::same_as<std::vector<VertexId>>;
  t.insert(points, results, hint);
  t.remove(vertices);
  t.start_journal();
  t.take_changes(changes);
  { c.vertex_count() } -> std::convertible_to<std::size_t>;
  { c.alive(hint) } -> std::same_as<bool>;
  { results[0].vertex } -> std::convertible_to<VertexId>;
  { changes.removed_vertices } -> std::convertible_to<std::span<const VertexId>>;
  { changes.added_vertices } -> std::convertible_to<std::span<const VertexId>>;
};

namespace detail {

/// Converts the first coordinates of a position to a point of the triangulation. Returns false if
/// that is impossible: a coordinate is not finite or, for integers, not an integer of 30 bits.
template <class Point>
bool to_point(const Point3& position, Point& point) {
  using Coord = typename Point::value_type;
  static_assert(std::tuple_size_v<Point> <= 3);
  for (std::size_t i = 0; i < point.size(); ++i) {
    const double value = position[i];
    if constexpr (std::is_integral_v<Coord>) {
      if (!(value >= 0.0 && value < double{1 << 30})) return false;
      point[i] = static_cast<Coord>(value);
      if (static_cast<double>(point[i]) != value) return false;
    } else {
      if (!std::isfinite(value)) return false;
      point[i] = static_cast<Coord>(value) + Coord{0};  // -0 becomes 0
    }
  }
  return true;
}

}  // namespace detail

template <class Triangulation>
struct MultiresolutionModel<Triangulation>::Impl {
  static_assert(DynamicTriangulation<Triangulation>);

  Impl(ClusterSource& source, const Detail& start, ModelOptions options, Triangulation empty);

  // Implements the public members of the same names.
  const Delta& expand(ClusterId cluster);
  const Delta& collapse(ClusterId cluster);
  /// Removes, within a step, points of an expanded cluster that has no expanded clusters below it,
  /// until `remaining` of them remain. The cluster is collapsed once 0 remain. Until then no other
  /// cluster may be expanded or collapsed.
  void collapse_to(ClusterTree::Slot cluster, std::uint32_t remaining);
  /// The points of an expanded cluster that are present.
  [[nodiscard]] std::span<const VertexId> present(ClusterTree::Slot cluster) {
    const std::span<const VertexId> vertices = tree_.vertices(cluster);
    return cluster == partial_ ? vertices.first(remaining_) : vertices;
  }
  const Delta& refine(const Box3& region, unsigned level) {
    return change_region(region, level, true, false);
  }
  const Delta& coarsen(const Box3& region, unsigned level) {
    return change_region(region, level, false, true);
  }
  const Delta& set_region(const Box3& region, unsigned level) {
    return change_region(region, level, true, true);
  }
  const Delta& set_detail(const Detail& detail) { return apply(tree_.plan(judge(detail), take())); }
  void open_step();
  const Delta& close_step();
  const Delta& restore(unsigned threads);

  [[nodiscard]] PointId point_id(VertexId vertex) const;
  [[nodiscard]] unsigned level(VertexId vertex) const {
    return tree_.level(owners_.representative(vertex).slot);
  }
  void heads(VertexId vertex, std::vector<ClusterId>& clusters) const;
  [[nodiscard]] std::vector<ClusterId> expanded() const;
  void children(ClusterId cluster, std::vector<ClusterId>& clusters) const;
  [[nodiscard]] std::size_t memory_bytes() const;

  using Slot = ClusterTree::Slot;
  using Verdict = ClusterTree::Verdict;
  /// True if part of the triangulation is updated by follow() after operations, and if restore()
  /// can compute it from scratch.
  static constexpr bool kFollows = requires(Triangulation t) { t.follow(); };
  static constexpr bool kRestores = requires(Triangulation t) { t.restore(1u); };
  /// True if the triangulation chooses its vertices by heights and levels.
  static constexpr bool kAssigns = requires(Triangulation t) { t.assign(VertexId{}, 0.0, 0u); };
  static constexpr std::size_t kMaxScratchPoints = 1 << 16;

  struct Staged {
    Slot slot;
    std::size_t first;  // of its points in `points` and `heights`
  };
  // Points that a step has read and not yet inserted.
  struct Stage {
    std::vector<Staged> clusters;
    std::vector<Point> points;
    std::vector<double> heights;
  };

  [[nodiscard]] ClusterTree::Take take();
  [[nodiscard]] ClusterTree::Judge judge(const Detail& detail);
  const Delta& change_region(const Box3& region, unsigned level, bool refine, bool coarsen);
  const Delta& apply(const ClusterTree::Plan& plan);
  void check_room() const;
  void remove_points(Slot cluster, std::uint32_t remaining);
  void reserve(std::size_t vertices);
  void insert_clusters(bool list_created);
  void build_clusters();
  void record_change(VertexOwners::Change change, VertexId vertex, double former_height);
  void assign([[maybe_unused]] VertexOwners::Change change, [[maybe_unused]] VertexId vertex) {
    if constexpr (kAssigns) {
      if (change == VertexOwners::Change::first || change == VertexOwners::Change::other)
        triangulation_.assign(vertex, owners_.height(vertex), level(vertex));
    }
  }
  void start_delta();
  void finish_delta();
  void finish_reassigned();
  void finish_heights();
  [[nodiscard]] ChildRef find(ClusterId cluster) const;

  Triangulation triangulation_;
  ClusterTree tree_;
  VertexOwners owners_;
  std::size_t points_ = 0;
  bool deltas_, old_heights_;
  bool open_ = false;                    // between open_step() and close_step()
  Slot partial_ = ClusterTree::kNoSlot;  // has `remaining_` points after collapse_to()
  std::uint32_t remaining_ = 0;
  Delta delta_;
  Stage stage_;
  std::vector<VertexId> created_;                 // vertices created in a step that also collapses
  std::vector<bool> marks_;                       // scratch of finish_delta(), all false
  std::vector<double> former_heights_;            // with old_heights, by slot
  std::vector<bool> has_former_height_;           // marks the valid entries of former_heights_
  std::vector<VertexId> former_height_vertices_;  // the same as a list
  std::vector<VertexId> removed_vertices_;        // scratch of remove_points()
  std::vector<typename Triangulation::Insertion> inserted_;  // scratch of insert_clusters()
};

template <class Triangulation>
MultiresolutionModel<Triangulation>::Impl::Impl(ClusterSource& source, const Detail& start,
                                                ModelOptions options, Triangulation empty)
    : triangulation_(std::move(empty)),
      tree_(source),
      deltas_(options.deltas),
      old_heights_(options.deltas && options.old_heights) {
  const ClusterTree::Take take_points = take();
  tree_.read_root(take_points);
  // Staged clusters stay staged, because the whole model is destroyed if this fails.
  static_cast<void>(tree_.plan(judge(start), take_points));
  check_room();
  if (options.reserve > 0) reserve(options.reserve);
  build_clusters();
  if (deltas_) triangulation_.start_journal();
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::Impl::expand(ClusterId cluster) -> const Delta& {
  const ChildRef place = find(cluster);
  if (tree_.child_slot(place) != ClusterTree::kNoSlot) return apply({});
  return apply(tree_.plan_expand(place, take()));
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::Impl::collapse(ClusterId cluster) -> const Delta& {
  const Slot expanded_slot = tree_.child_slot(find(cluster));
  return apply(expanded_slot == ClusterTree::kNoSlot ? ClusterTree::Plan{}
                                                     : tree_.plan_collapse(expanded_slot));
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::Impl::change_region(const Box3& region, unsigned level,
                                                              bool refine, bool coarsen)
    -> const Delta& {
  const auto judge_child = [&](ChildRef child, unsigned child_level, bool expanded) {
    if (child_level < level ? !(expanded && coarsen) : !(expanded || refine)) return Verdict::keep;
    const Box3& box = tree_.record(child).box;
    if (!region.intersects(box)) return Verdict::keep;
    if (child_level >= level) return refine ? Verdict::expand : Verdict::visit;
    return region.covers(box) ? Verdict::collapse : Verdict::visit;
  };
  return apply(tree_.plan(judge_child, take()));
}

template <class Triangulation>
ClusterTree::Judge MultiresolutionModel<Triangulation>::Impl::judge(const Detail& detail) {
  return [this, &detail](ChildRef child, unsigned child_level, bool) {
    if (child_level > detail.level) return Verdict::expand;
    Verdict verdict = child_level == detail.level ? Verdict::expand_alone : Verdict::collapse;
    for (std::size_t i = 0; i < detail.focuses.size(); ++i) {
      const Focus& focus = detail.focuses[i];
      const Box3& box = tree_.record(child).box;
      if (child_level < focus.level || !focus.box.intersects(box)) continue;
      if (detail.needs && !detail.needs(i, box)) continue;
      if (child_level > focus.level) return Verdict::expand;
      verdict = Verdict::expand_alone;
    }
    return verdict;
  };
}

template <class Triangulation>
ClusterTree::Take MultiresolutionModel<Triangulation>::Impl::take() {
  stage_.clusters.clear();
  stage_.points.clear();
  stage_.heights.clear();
  return [this](Slot cluster, ClusterId id, std::span<const Point3> positions) {
    const std::size_t first = stage_.points.size();
    stage_.points.resize(first + positions.size());
    stage_.heights.resize(first + positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i) {
      if (!detail::to_point(positions[i], stage_.points[first + i])) {
        throw HierarchyError(
            id, "member " + std::to_string(i) + " is at " + std::to_string(positions[i][0]) + ", " +
                    std::to_string(positions[i][1]) + ", " + std::to_string(positions[i][2]) +
                    ", which the triangulation cannot take; coordinates must be " +
                    (std::is_integral_v<typename Point::value_type> ? "integers from 0 to 2^30 - 1"
                                                                    : "finite"));
      }
      stage_.heights[first + i] = positions[i][2];
    }
    stage_.clusters.push_back({cluster, first});
  };
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::check_room() const {
  const std::size_t present_count = triangulation_.vertex_count();
  if (stage_.points.size() <= kMaxVertices - present_count) return;
  throw std::length_error("the step would add " + std::to_string(stage_.points.size()) +
                          " points to " + std::to_string(present_count) +
                          " vertices, more than 2^29 - 2; ask for less detail");
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::Impl::apply(const ClusterTree::Plan& plan)
    -> const Delta& {
  try {
    if (!plan.staged.empty()) check_room();
  } catch (...) {
    tree_.cancel(plan);
    throw;
  }
  if (!open_) start_delta();
  // Collapsing first keeps the peak memory low. Expanding first would keep vertices of points
  // present before and after, but those are few.
  for (const Slot cluster : plan.collapsed) remove_points(cluster, 0);
  if (!plan.staged.empty()) insert_clusters(deltas_ && (open_ || !plan.collapsed.empty()));
  if constexpr (kFollows) triangulation_.follow();  // counts as part of the operation
  if (!open_) finish_delta();
  return delta_;
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::open_step() {
  assert(!open_);
  open_ = true;
  start_delta();
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::Impl::close_step() -> const Delta& {
  assert(open_);
  open_ = false;
  finish_delta();
  return delta_;
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::Impl::restore([[maybe_unused]] unsigned threads)
    -> const Delta& {
  assert(!open_);
  start_delta();
  if constexpr (kRestores) triangulation_.restore(threads);
  finish_delta();
  return delta_;
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::collapse_to(Slot cluster, std::uint32_t remaining) {
  assert(open_);
  remove_points(cluster, remaining);
  if constexpr (kFollows) triangulation_.follow();
}

// Removes points of a cluster until `remaining` of them remain, and the cluster with its last
// point.
template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::remove_points(Slot cluster,
                                                              std::uint32_t remaining) {
  assert(partial_ == ClusterTree::kNoSlot || partial_ == cluster);
  removed_vertices_.clear();
  const std::span<const VertexId> vertices = present(cluster);
  for (std::uint32_t i = remaining; i < vertices.size(); ++i) {
    const double height = old_heights_ ? owners_.height(vertices[i]) : 0.0;
    const VertexOwners::Change change = owners_.remove(vertices[i], {cluster, i}, tree_);
    if (change == VertexOwners::Change::last) removed_vertices_.push_back(vertices[i]);
    record_change(change, vertices[i], height);
    assign(change, vertices[i]);
  }
  triangulation_.remove(removed_vertices_);
  points_ -= vertices.size() - remaining;
  partial_ = remaining > 0 ? cluster : ClusterTree::kNoSlot;
  remaining_ = remaining;
  if (remaining == 0) tree_.release(cluster);
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::reserve(std::size_t vertices) {
  owners_.reserve(vertices + 1);
  if constexpr (requires { triangulation_.reserve(vertices); }) triangulation_.reserve(vertices);
  if (old_heights_) {
    former_heights_.reserve(vertices + 1);
    has_former_height_.reserve(vertices + 1);
  }
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::insert_clusters(bool list_created) {
  if (stage_.points.size() > kMaxScratchPoints) {
    reserve(triangulation_.vertex_count() + stage_.points.size());
  }
  for (const Staged& staged : stage_.clusters) {
    const std::span<VertexId> vertices = tree_.vertices(staged.slot);
    const std::size_t size = vertices.size();
    inserted_.resize(size);
    triangulation_.insert(std::span<const Point>(stage_.points).subspan(staged.first, size),
                          inserted_, tree_.head_vertex(staged.slot));
    for (std::uint32_t i = 0; i < size; ++i) {
      const VertexId vertex = inserted_[i].vertex;
      vertices[i] = vertex;
      const bool had_height = old_heights_ && slot(vertex) < owners_.slots();
      const double height = had_height ? owners_.height(vertex) : 0.0;
      const VertexOwners::Change change =
          owners_.add(vertex, {staged.slot, i}, stage_.heights[staged.first + i], tree_);
      record_change(change, vertex, height);
      assign(change, vertex);
      if (list_created && change == VertexOwners::Change::first) created_.push_back(vertex);
    }
    points_ += size;
  }
  // The scratch memory of one cluster is worth keeping, but the memory of a whole level is not.
  if (stage_.points.capacity() > kMaxScratchPoints) stage_ = {};
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::build_clusters() {
  const std::vector<VertexId> vertices_of_points = triangulation_.build(stage_.points);
  stage_.points = {};
  owners_.reserve(triangulation_.vertex_count() + 1);
  for (const Staged& staged : stage_.clusters) {
    const std::span<VertexId> vertices = tree_.vertices(staged.slot);
    for (std::uint32_t i = 0; i < vertices.size(); ++i) {
      vertices[i] = vertices_of_points[staged.first + i];
      assign(owners_.add(vertices[i], {staged.slot, i}, stage_.heights[staged.first + i], tree_),
             vertices[i]);
    }
  }
  points_ = vertices_of_points.size();
  stage_ = {};
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::record_change(VertexOwners::Change change,
                                                              VertexId vertex,
                                                              double former_height) {
  if (change == VertexOwners::Change::other && deltas_) delta_.reassigned.push_back(vertex);
  if (!old_heights_) return;
  if (change != VertexOwners::Change::other && change != VertexOwners::Change::last) return;
  // The former height is known at the first change within a step.
  if (has_former_height_.size() < owners_.slots()) {
    has_former_height_.resize(owners_.slots());
    former_heights_.resize(owners_.slots());
  }
  if (has_former_height_[slot(vertex)]) return;
  has_former_height_[slot(vertex)] = true;
  former_height_vertices_.push_back(vertex);
  former_heights_[slot(vertex)] = former_height;
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::start_delta() {
  delta_.reassigned.clear();
  delta_.removed_heights.clear();
  delta_.reassigned_heights.clear();
  created_.clear();
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::finish_delta() {
  if (!deltas_) return;
  triangulation_.take_changes(delta_.changes);
  // A vertex that was removed with one point and added again with another counts as unchanged if it
  // has its former slot.
  if (created_.size() > delta_.changes.added_vertices.size()) {
    delta_.reassigned.insert(delta_.reassigned.end(), created_.begin(), created_.end());
  }
  if (!delta_.reassigned.empty()) finish_reassigned();
  if (old_heights_) finish_heights();
}

// Keeps only vertices that existed before and after, each once.
template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::finish_reassigned() {
  const auto& added = delta_.changes.added_vertices;
  const auto& removed = delta_.changes.removed_vertices;
  marks_.resize(owners_.slots());
  const auto mark = [&](const auto& vertices, bool value) {
    for (const VertexId vertex : vertices) marks_[static_cast<std::uint32_t>(vertex)] = value;
  };
  mark(added, true);
  mark(removed, true);
  std::erase_if(delta_.reassigned, [&](VertexId vertex) {
    if (!triangulation_.alive(vertex)) return true;  // added and removed again, or not a vertex
    const bool other = marks_[static_cast<std::uint32_t>(vertex)];
    marks_[static_cast<std::uint32_t>(vertex)] = true;
    return other;
  });
  mark(added, false);
  mark(removed, false);
  mark(delta_.reassigned, false);
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::finish_heights() {
  for (const VertexId vertex : delta_.changes.removed_vertices) {
    // A triangulation that chooses its vertices may remove one whose point stays.
    const bool changed =
        slot(vertex) < has_former_height_.size() && has_former_height_[slot(vertex)];
    delta_.removed_heights.push_back(changed ? former_heights_[slot(vertex)]
                                             : owners_.height(vertex));
  }
  for (const VertexId vertex : delta_.reassigned) {
    delta_.reassigned_heights.push_back(former_heights_[slot(vertex)]);
  }
  for (const VertexId vertex : former_height_vertices_) has_former_height_[slot(vertex)] = false;
  former_height_vertices_.clear();
}

template <class Triangulation>
PointId MultiresolutionModel<Triangulation>::Impl::point_id(VertexId vertex) const {
  const VertexOwners::Owner owner = owners_.representative(vertex);
  return {tree_.id(owner.slot), owner.index};
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::heads(VertexId vertex,
                                                      std::vector<ClusterId>& clusters) const {
  clusters.clear();
  owners_.for_each(vertex, [&](VertexOwners::Owner owner) {
    for (unsigned lower_level = tree_.level(owner.slot); lower_level-- > 0;) {
      clusters.push_back(tree_.headed_cluster(owner.slot, owner.index, lower_level));
    }
  });
}

template <class Triangulation>
ChildRef MultiresolutionModel<Triangulation>::Impl::find(ClusterId cluster) const {
  if (const auto place = tree_.find(cluster)) return *place;
  throw std::invalid_argument(to_string(cluster) +
                              " cannot be used: the cluster above it is not expanded");
}

template <class Triangulation>
std::vector<ClusterId> MultiresolutionModel<Triangulation>::Impl::expanded() const {
  std::vector<ClusterId> ids;
  ids.reserve(tree_.expanded_count());
  tree_.for_each_expanded([&](Slot cluster) { ids.push_back(tree_.id(cluster)); });
  std::sort(ids.begin(), ids.end());
  return ids;
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::Impl::children(ClusterId cluster,
                                                         std::vector<ClusterId>& clusters) const {
  Slot expanded_slot = ClusterTree::kRoot;
  if (cluster != tree_.id(ClusterTree::kRoot)) expanded_slot = tree_.child_slot(find(cluster));
  if (expanded_slot == ClusterTree::kNoSlot) {
    throw std::invalid_argument(to_string(cluster) + " is not expanded");
  }
  clusters.clear();
  const std::uint32_t count = tree_.child_count(expanded_slot);
  for (std::uint32_t i = 0; i < count; ++i) clusters.push_back(tree_.child_id({expanded_slot, i}));
}

template <class Triangulation>
std::size_t MultiresolutionModel<Triangulation>::Impl::memory_bytes() const {
  return tree_.memory() + owners_.memory() + removed_vertices_.capacity() * sizeof(VertexId) +
         created_.capacity() * sizeof(VertexId) + marks_.capacity() / 8 +
         former_heights_.capacity() * sizeof(double) + has_former_height_.capacity() / 8 +
         former_height_vertices_.capacity() * sizeof(VertexId) +
         inserted_.capacity() * sizeof(inserted_[0]) + stage_.points.capacity() * sizeof(Point) +
         stage_.heights.capacity() * sizeof(double);
}

template <class Triangulation>
MultiresolutionModel<Triangulation>::MultiresolutionModel(ClusterSource& source,
                                                          const Detail& start, ModelOptions options,
                                                          Triangulation empty)
    : impl_(std::make_unique<Impl>(source, start, options, std::move(empty))) {}
template <class Triangulation>
MultiresolutionModel<Triangulation>::~MultiresolutionModel() = default;
template <class Triangulation>
MultiresolutionModel<Triangulation>::MultiresolutionModel(MultiresolutionModel&&) noexcept =
    default;
template <class Triangulation>
auto MultiresolutionModel<Triangulation>::operator=(MultiresolutionModel&&) noexcept
    -> MultiresolutionModel& = default;

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::expand(ClusterId cluster) -> const Delta& {
  return impl_->expand(cluster);
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::collapse(ClusterId cluster) -> const Delta& {
  return impl_->collapse(cluster);
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::refine(const Box3& region, unsigned level)
    -> const Delta& {
  return impl_->refine(region, level);
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::coarsen(const Box3& region, unsigned level)
    -> const Delta& {
  return impl_->coarsen(region, level);
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::set_region(const Box3& region, unsigned level)
    -> const Delta& {
  return impl_->set_region(region, level);
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::set_detail(const Detail& detail) -> const Delta& {
  return impl_->set_detail(detail);
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::open_step() {
  impl_->open_step();
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::close_step() -> const Delta& {
  return impl_->close_step();
}

template <class Triangulation>
auto MultiresolutionModel<Triangulation>::restore(unsigned threads) -> const Delta& {
  return impl_->restore(threads);
}

template <class Triangulation>
const Triangulation& MultiresolutionModel<Triangulation>::triangulation() const {
  return impl_->triangulation_;
}

template <class Triangulation>
unsigned MultiresolutionModel<Triangulation>::top() const {
  return impl_->tree_.top();
}

template <class Triangulation>
std::size_t MultiresolutionModel<Triangulation>::point_count() const {
  return impl_->points_;
}

template <class Triangulation>
PointId MultiresolutionModel<Triangulation>::point_id(VertexId vertex) const {
  return impl_->point_id(vertex);
}

template <class Triangulation>
unsigned MultiresolutionModel<Triangulation>::level(VertexId vertex) const {
  return impl_->level(vertex);
}

template <class Triangulation>
double MultiresolutionModel<Triangulation>::height(VertexId vertex) const {
  return impl_->owners_.height(vertex);
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::heads(VertexId vertex,
                                                std::vector<ClusterId>& clusters) const {
  impl_->heads(vertex, clusters);
}

template <class Triangulation>
std::size_t MultiresolutionModel<Triangulation>::expanded_count() const {
  return impl_->tree_.expanded_count();
}

template <class Triangulation>
std::vector<ClusterId> MultiresolutionModel<Triangulation>::expanded() const {
  return impl_->expanded();
}

template <class Triangulation>
bool MultiresolutionModel<Triangulation>::is_expanded(ClusterId cluster) const {
  const auto place = impl_->tree_.find(cluster);
  return place && impl_->tree_.child_slot(*place) != ClusterTree::kNoSlot;
}

template <class Triangulation>
bool MultiresolutionModel<Triangulation>::can_expand(ClusterId cluster) const {
  const auto place = impl_->tree_.find(cluster);
  return place && impl_->tree_.child_slot(*place) == ClusterTree::kNoSlot;
}

template <class Triangulation>
void MultiresolutionModel<Triangulation>::children(ClusterId cluster,
                                                   std::vector<ClusterId>& clusters) const {
  impl_->children(cluster, clusters);
}

template <class Triangulation>
VertexId MultiresolutionModel<Triangulation>::head_vertex(ClusterId cluster) const {
  return impl_->tree_.head_vertex(impl_->find(cluster));
}

template <class Triangulation>
const ClusterRecord& MultiresolutionModel<Triangulation>::record(ClusterId cluster) {
  return impl_->tree_.record(impl_->find(cluster));
}

template <class Triangulation>
std::size_t MultiresolutionModel<Triangulation>::memory_bytes() const {
  return impl_->memory_bytes();
}

}  // namespace terrace::tri
