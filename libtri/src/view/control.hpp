// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "cache.hpp"
#include "front.hpp"
#include "model/multiresolution.hpp"
#include "model/owners.hpp"
#include "terrace/tri/view.hpp"
#include "window_demand.hpp"
#include "windows.hpp"

/// Implements the template ViewControl of view.hpp, for files that instantiate it.

namespace terrace::tri {

namespace detail {

/// Throws HierarchyError if a delivered cluster contradicts itself.
void check(const LoadedCluster& cluster, unsigned top);
ViewOptions checked(ViewOptions options);

/// The state of a control that thins a raster. Not a member of the template, so that other controls
/// do not need the windows.
struct Thinning {
  explicit Thinning(const RasterFrame& frame) : windows(frame) {}

  ViewWindows windows;
  WindowDemand demand;
  View last_view, view_of_clusters, view_of_windows;
  std::set<ClusterId> pinned_expanded;  // of level 0
  int coarser = 0;        // steps by which all windows are coarser than wanted, for lack of room
  int least_coarser = 0;  // known to be needed for the current view
  bool full = false;      // there was no room for windows that should become finer
  std::vector<ThinnedDelaunay2::Target> targets, before;
};
struct NoThinning {
  explicit NoThinning(const RasterFrame&) {}
};

}  // namespace detail

template <class Triangulation>
struct ViewControl<Triangulation>::Impl {
  Impl(std::vector<std::uint64_t> counts, LoadedCluster root, ViewOptions options,
       Triangulation&& empty);

  const Step& step(const View& view, const StepBudget& budget);
  [[nodiscard]] ClusterTree& tree() { return model_.impl_->tree_; }

  using Slot = ClusterTree::Slot;
  using Candidate = ViewFront::Candidate;
  struct Requested {
    std::uint64_t step = 0;
    double bytes = 0.0;
  };

  void set_views(const View& view, detail::Thinning& t);
  void expand_wanted();
  bool thin();
  bool collapse_unwanted(std::size_t max_remaining);
  enum class Room { enough, none, later };
  [[nodiscard]] std::size_t points_over_limit(std::size_t points) const {
    const std::size_t needed = model_.point_count() + points;
    return needed > max_points_ ? needed - max_points_ : 0;
  }
  [[nodiscard]] bool could_fit(const Candidate& candidate, std::size_t points);
  [[nodiscard]] Room make_room(const Candidate& candidate);
  void request_missing(const Candidate& candidate);
  void request_upcoming();
  void request_records();
  void request(const Candidate& candidate, double importance, double bytes);
  void expand(const Candidate& candidate, const LoadedCluster& loaded);
  /// The work of removing vertices, as a number of points in ordinary places.
  [[nodiscard]] std::size_t work_to_remove(std::span<const VertexId> vertices) const {
    if constexpr (kEstimatesWork) return model_.triangulation().removal_work(vertices);
    return vertices.size();
  }
  [[nodiscard]] std::size_t work_to_collapse(Slot slot) {
    return work_to_remove(model_.impl_->present(slot));
  }
  [[nodiscard]] bool has_time_to_collapse(Slot slot) {
    if constexpr (kEstimatesWork)
      return meter_.has_time(work_to_collapse(slot), StepMeter::kCollapse);
    return meter_.has_time_for_usual(StepMeter::kCollapse);
  }
  [[nodiscard]] std::uint32_t points_after_budget(Slot slot);
  /// The meter's kind of operation for the expansion of a cluster.
  [[nodiscard]] static std::size_t kind_to_expand(ClusterId id) {
    return kThins && level_of(id) == 0 ? StepMeter::kLoad : StepMeter::kExpand;
  }
  bool collapse(Slot slot);
  void withdraw();

  /// Upper limit of missing clusters requested in a step. Loading that many takes longer than the
  /// step.
  static constexpr std::size_t kMaxRequested = 1024;
  /// Number of clusters between two readings of the clock.
  static constexpr std::size_t kClockInterval = 16;
  /// True if the triangulation shows only some of the model's points. max_points limits its
  /// vertices, and the points are limited to kPointsPerVertex times as many.
  static constexpr bool kThins = std::is_same_v<Triangulation, ThinnedDelaunay2>;
  static constexpr std::size_t kPointsPerVertex = 16;
  /// Windows to thin between two readings of the clock, and the work of one as a number of points.
  static constexpr std::size_t kWindowsAtOnce = 4, kPointsOfWindow = 256;
  static constexpr bool kEstimatesWork = requires(const Triangulation& t) { t.removal_work({}); };

  ViewOptions options_;
  std::size_t max_points_;
  ViewCache cache_;
  Model model_;
  using Thinning = detail::Thinning;
  static constexpr int kCoarser = ThinnedDelaunay2::kStepsPerDoubling / 2;
  [[nodiscard]] ClusterAlignment* alignment() {
    if constexpr (kThins) return &thinning_.windows;
    return nullptr;
  }
  std::conditional_t<kThins, Thinning, detail::NoThinning> thinning_;
  ViewFront front_;
  std::unordered_map<ClusterId, Requested> requested_;
  std::set<ClusterId> faulty_;

  Slot partial_ = ClusterTree::kNoSlot;  // partly collapsed. Must be finished first
  Step result_;
  StepMeter meter_;
  std::uint64_t number_ = 0;         // of the step
  bool evict_ = true;                // true while room can still be made in this step
  std::size_t reserved_points_ = 0;  // points of wanted clusters that were given or requested
  double reserved_bytes_ = 0.0;
};

template <class Triangulation>
ViewControl<Triangulation>::Impl::Impl(std::vector<std::uint64_t> counts, LoadedCluster root,
                                       ViewOptions options, Triangulation&& empty)
    : options_(detail::checked(std::move(options))),
      max_points_(kThins && options_.max_points < SIZE_MAX / kPointsPerVertex
                      ? options_.max_points * kPointsPerVertex
                      : options_.max_points),
      cache_([&] {
        if (root.cluster != cluster_id(static_cast<unsigned>(counts.size()), 0)) {
          throw HierarchyError(root.cluster, "it is not the root above " +
                                                 std::to_string(counts.size()) + " levels");
        }
        detail::check(root, static_cast<unsigned>(counts.size()));
        ViewCache cache(std::move(counts));
        cache.give(root);
        return cache;
      }()),
      model_(cache_, Detail{}, options_.model, std::move(empty)),
      thinning_(options_.raster),
      front_(tree(), options_, alignment()) {
  front_.add(ClusterTree::kRoot, root.child_records, nullptr);
  cache_.drop(root.cluster);
  cache_.limit(options_.max_cached_bytes);
}

template <class Triangulation>
auto ViewControl<Triangulation>::Impl::step(const View& view, const StepBudget& budget)
    -> const Step& {
  check(view);
  meter_.start(budget);
  result_ = {};
  ++number_;
  evict_ = true;
  reserved_points_ = 0;
  reserved_bytes_ = 0.0;
  for (const auto& [id, requested] : requested_) reserved_bytes_ += requested.bytes;

  if constexpr (kThins) {
    set_views(view, thinning_);
    front_.start(thinning_.view_of_clusters);
  } else {
    front_.start(view);
  }
  meter_.start_operations();
  model_.open_step();
  if (partial_ != ClusterTree::kNoSlot) collapse(partial_);
  expand_wanted();
  request_upcoming();
  request_records();
  meter_.end_fixed_work();
  const bool thinned = thin();
  const bool done = collapse_unwanted(0) && thinned;
  withdraw();
  result_.delta = &model_.close_step();
  meter_.end();
  result_.settled = done && result_.pending == 0 && result_.expanded == 0 &&
                    result_.collapsed == 0 && result_.thinned == 0;
  return result_;
}

// Derives the views by which clusters are loaded and windows thinned.
//
// An error in ground units is a promise. For a thinned raster it can be kept only where all samples
// are known, because of clusters only the range of heights is. An error in pixels is a wish, for
// which that range is a good estimate.
template <class Triangulation>
void ViewControl<Triangulation>::Impl::set_views(const View& view, Thinning& t) {
  if (!(view == t.last_view)) t.least_coarser = 0;
  t.last_view = t.view_of_windows = view;
  for (const ClusterId id : t.pinned_expanded) {
    if (const auto place = tree().find(id))
      t.view_of_windows.focuses.push_back({front_.record(*place).box, 0});
  }
  t.view_of_clusters = t.view_of_windows;
  constexpr double kAll = std::numeric_limits<double>::infinity();
  const auto load = [&](const Box3& box, double error) {
    if (error < kAll) t.view_of_clusters.focuses.push_back({box, 0});
  };
  load({{-kAll, -kAll, -kAll}, {kAll, kAll, kAll}}, view.ground_error);
  for (const ErrorRegion& region : view.regions) load(region.box, region.error);
}

// Chooses the vertices of windows whose tolerance should change. Returns false if the budget ended
// first or the windows must be made coarser.
template <class Triangulation>
bool ViewControl<Triangulation>::Impl::thin() {
  if constexpr (!kThins) {
    return true;
  } else {
    Thinning& t = thinning_;
    ThinnedDelaunay2& raster = model_.impl_->triangulation_;
    for (std::uint32_t i = 0; options_.raster_has_gaps && i < raster.window_slots(); ++i) {
      const ThinnedDelaunay2::Window* const window = raster.window(i);
      if (window == nullptr || window->complete) continue;
      Box3 box = t.windows.box_of(*window);
      box.min[2] = -std::numeric_limits<double>::infinity();
      box.max[2] = std::numeric_limits<double>::infinity();
      const auto meets = [&](const Box3& other) { return t.windows.meets(other, *window); };
      if (!front_.meets_collapsed(box, meets)) raster.set_complete(i);
    }
    const auto changes =
        t.demand.changes(raster, t.windows, t.view_of_windows, options_, t.coarser);
    const bool coarsens = std::any_of(changes.begin(), changes.end(),
                                      [](const auto& change) { return change.coarsens; });
    // Where there was no room, windows become finer only after all others have become coarser.
    t.full = t.full && coarsens;
    bool waiting = false;
    for (std::size_t next = 0; next < changes.size();) {
      t.targets.clear();
      t.before.clear();
      std::size_t end = next;
      for (; end < changes.size() && t.targets.size() < kWindowsAtOnce; ++end) {
        const WindowDemand::Change& change = changes[end];
        if (t.full && !change.coarsens) {
          waiting = true;
          continue;
        }
        t.targets.push_back(change.target);
        if (change.coarsens) continue;
        const ThinnedDelaunay2::Window& window = *raster.window(change.target.window);
        t.before.push_back(
            {change.target.window, window.thinned ? window.step : ThinnedDelaunay2::kFewest});
      }
      if (!t.targets.empty() && !meter_.has_time_for_usual(StepMeter::kThin)) {
        result_.pending += changes.size() - next;
        result_.worst = std::max(result_.worst, changes[next].urgency);
        return false;
      }
      next = end;
      if (t.targets.empty()) continue;
      std::size_t chosen = raster.thin(t.targets);
      t.full = raster.vertex_count() > options_.max_points && !t.before.empty();
      if (t.full) chosen += raster.thin(t.before);
      result_.thinned += chosen;
      meter_.spend(kPointsOfWindow * chosen, StepMeter::kThin);
      if (!t.full) continue;
      if (!coarsens) t.least_coarser = t.coarser += kCoarser;
      return false;
    }
    if (waiting) return false;
    // Tries a finer step where there may be room, once per view.
    if (t.coarser > t.least_coarser && raster.vertex_count() <= options_.max_points / 2) {
      t.coarser -= kCoarser;
      return false;
    }
    if (t.coarser > 0) {
      ++result_.blocked;
      const auto steps = static_cast<ThinnedDelaunay2::Step>(t.coarser);
      result_.worst = std::max(result_.worst, ThinnedDelaunay2::tolerance_of(steps));
    }
    return true;
  }
}

// Collapses until at most this many points of unwanted clusters are left. Returns false if the
// budget ended first.
template <class Triangulation>
bool ViewControl<Triangulation>::Impl::collapse_unwanted(std::size_t max_remaining) {
  if (partial_ != ClusterTree::kNoSlot) return false;
  while (front_.points_below(options_.collapse_below) > max_remaining || max_remaining == 0) {
    const Slot slot = front_.next_to_collapse(options_.collapse_below);
    if (slot == ClusterTree::kNoSlot) break;
    if (!has_time_to_collapse(slot) || !collapse(slot)) return false;
  }
  return true;
}

// Examines only a limited number of clusters per step, as otherwise little would be expanded while
// thousands wait. The most wanted are requested, and once the budget is spent the others are left
// to later steps.
template <class Triangulation>
void ViewControl<Triangulation>::Impl::expand_wanted() {
  for (std::size_t examined = 0; const auto candidate = front_.next();) {
    const bool prepares = result_.pending > 0 || result_.missing > kMaxRequested;
    if (prepares && ++examined % kClockInterval == 0 && meter_.is_late()) {
      result_.pending += 1 + front_.candidates();
      return;
    }
    if (!faulty_.empty() && faulty_.count(candidate->id)) continue;
    const LoadedCluster* loaded = cache_.find(candidate->id, false);
    Room room = Room::none;
    if (!loaded) {
      if (++result_.missing <= kMaxRequested) request_missing(*candidate);
    } else {
      room = make_room(*candidate);
      if (room == Room::later) ++result_.pending;
      if (room == Room::none) ++result_.blocked;
      if (room == Room::later) {
        reserved_points_ += loaded->positions.size();
        reserved_bytes_ += cache_.bytes_of(level_of(candidate->id), candidate->members);
      }
      if (room != Room::none) cache_.find(candidate->id, true);
    }
    if (room == Room::enough) {
      expand(*candidate, *loaded);
    } else {
      result_.worst = std::max(result_.worst, candidate->want);
    }
  }
}

// Returns true if room could be made for this many points. Once it is impossible for one cluster,
// no room is made for less wanted ones, but unwanted clusters always give way. The result therefore
// does not depend on where a step was interrupted.
template <class Triangulation>
bool ViewControl<Triangulation>::Impl::could_fit(const Candidate& candidate, std::size_t points) {
  const std::size_t excess = points_over_limit(points);
  if (excess == 0) return true;
  const double unwanted = options_.collapse_below;
  if (evict_ && front_.points_below(unwanted * candidate.want) >= excess) return true;
  if (points == candidate.members) evict_ = false;
  return front_.points_below(unwanted) >= excess;
}

template <class Triangulation>
auto ViewControl<Triangulation>::Impl::make_room(const Candidate& candidate) -> Room {
  const std::size_t members = static_cast<std::size_t>(candidate.members);
  collapse_unwanted(model_.point_count() / 4 + 1);
  if (partial_ != ClusterTree::kNoSlot) return Room::later;
  if (points_over_limit(members) > 0) {
    if (!could_fit(candidate, members)) return Room::none;
    const double below = options_.collapse_below * (evict_ ? candidate.want : 1.0);
    while (points_over_limit(members) > 0) {
      const Slot slot = front_.next_to_collapse(below);
      if (slot == ClusterTree::kNoSlot) return Room::none;  // pins keep them expanded
      if (!has_time_to_collapse(slot) || !collapse(slot)) return Room::later;
    }
  }
  // The collapsed cluster may have been above this one.
  const auto place = tree().find(candidate.id);
  if (!place || *place != candidate.place) return Room::none;
  return meter_.has_time(members, kind_to_expand(candidate.id)) ? Room::enough : Room::later;
}

template <class Triangulation>
void ViewControl<Triangulation>::Impl::request_missing(const Candidate& candidate) {
  const std::size_t members = static_cast<std::size_t>(
      std::min<std::uint64_t>(candidate.members, ClusterTree::kMaxMembers));
  const unsigned level = level_of(candidate.id);
  // Requests only clusters that could be expanded, and kept until then.
  const std::size_t reserved = reserved_points_ + members;
  const auto entry = requested_.find(candidate.id);
  const double bytes = cache_.bytes_of(level, members);
  const double additional = entry == requested_.end() ? bytes : 0.0;
  if (!could_fit(candidate, members) || !could_fit(candidate, reserved) ||
      reserved_bytes_ + additional > static_cast<double>(cache_.max_bytes())) {
    --result_.missing;
    ++result_.blocked;
    return;
  }
  reserved_points_ += members;
  reserved_bytes_ += additional;
  request(candidate, candidate.want, bytes);
}

// Requests early the clusters that may be wanted soon, and keeps those that are in
// the cache.
template <class Triangulation>
void ViewControl<Triangulation>::Impl::request_upcoming() {
  std::size_t examined = 0;
  for (const Candidate& candidate : front_.upcoming()) {
    if (++examined % kClockInterval == 0 && meter_.is_late()) break;
    if (!faulty_.empty() && faulty_.count(candidate.id)) continue;
    const double bytes = cache_.bytes_of(level_of(candidate.id), candidate.members);
    const bool is_requested = requested_.count(candidate.id) != 0;
    if (!is_requested && reserved_bytes_ + bytes > static_cast<double>(cache_.max_bytes())) break;
    if (!is_requested) reserved_bytes_ += bytes;
    if (!cache_.find(candidate.id, true)) request(candidate, std::min(candidate.keep, 1.0), bytes);
  }
}

// Both lists are ordered by importance.
template <class Triangulation>
void ViewControl<Triangulation>::Impl::request_records() {
  const auto unread_records = front_.unread_records();
  if (unread_records.empty()) return;
  std::vector<ViewRequest> clusters;
  clusters.swap(result_.wanted);
  std::size_t next = 0;
  const auto records_above = [&](double importance) {
    for (; next < unread_records.size() && unread_records[next].keep > importance; ++next) {
      result_.wanted.push_back(
          {unread_records[next].id, {}, ClusterRecord::kUnread, unread_records[next].keep});
    }
  };
  for (const ViewRequest& cluster : clusters) {
    records_above(cluster.importance);
    result_.wanted.push_back(cluster);
  }
  records_above(-1.0);
}

template <class Triangulation>
void ViewControl<Triangulation>::Impl::request(const Candidate& candidate, double importance,
                                               double bytes) {
  ViewRequest request{candidate.id, {}, candidate.members, importance};
  if (level_of(candidate.id) > 0) request.head_child = tree().head_child(candidate.place);
  result_.wanted.push_back(request);
  const auto [entry, is_new] = requested_.try_emplace(candidate.id, Requested{number_, bytes});
  if (is_new) result_.requests.push_back(request);
  entry->second.step = number_;
}

template <class Triangulation>
void ViewControl<Triangulation>::Impl::expand(const Candidate& candidate,
                                              const LoadedCluster& loaded) {
  cache_.expect(candidate.id, front_.record(candidate.place));
  try {
    model_.expand(candidate.id);
  } catch (const HierarchyError& error) {
    result_.faults.push_back({candidate.id, error.what()});
    faulty_.insert(candidate.id);
    cache_.drop(candidate.id);
    return;
  }
  ++result_.expanded;
  front_.add(tree().child_slot(candidate.place), loaded.child_records, &candidate);
  meter_.spend(loaded.positions.size(), kind_to_expand(candidate.id));
}

// Returns the number of points that remain after collapsing a cluster in the rest of the step. They
// are always fewer than are present.
template <class Triangulation>
std::uint32_t ViewControl<Triangulation>::Impl::points_after_budget(Slot slot) {
  const std::span<const VertexId> present = model_.impl_->present(slot);
  if (meter_.fits(work_to_remove(present), StepMeter::kCollapse)) return 0;
  std::size_t remaining = present.size();
  for (std::size_t work = 0; remaining > 0; --remaining) {
    work += work_to_remove(present.subspan(remaining - 1, 1));
    if (remaining < present.size() && !meter_.fits(work, StepMeter::kCollapse)) break;
  }
  return static_cast<std::uint32_t>(remaining);
}

// Returns false if there was no time for all of its points, some of which may cost far more than
// others. The step then ends, and the next ones continue.
template <class Triangulation>
bool ViewControl<Triangulation>::Impl::collapse(Slot slot) {
  const ClusterId id = tree().id(slot);
  const ChildRef place = tree().place(slot);
  const auto present = model_.impl_->present(slot);
  const std::uint32_t remaining = kEstimatesWork ? points_after_budget(slot) : 0;
  const std::size_t work = work_to_remove(present.subspan(remaining));
  model_.impl_->collapse_to(slot, remaining);
  meter_.spend(work, StepMeter::kCollapse);
  partial_ = remaining > 0 ? slot : ClusterTree::kNoSlot;
  if (remaining > 0) {
    ++result_.pending;
    return false;
  }
  front_.drop(slot, place);
  cache_.find(id, true);  // likely to come back
  ++result_.collapsed;
  return true;
}

// Withdraws clusters that were requested and are neither wanted now nor within the band of
// hysteresis.
template <class Triangulation>
void ViewControl<Triangulation>::Impl::withdraw() {
  for (const auto& [id, requested] : requested_) {
    if (requested.step == number_) continue;
    const auto place = tree().find(id);
    if (place && front_.keep(*place) >= options_.collapse_below) continue;
    result_.withdrawn.push_back(id);
  }
  std::sort(result_.withdrawn.begin(), result_.withdrawn.end());
  for (const ClusterId id : result_.withdrawn) requested_.erase(id);
}

template <class Triangulation>
ViewControl<Triangulation>::ViewControl(std::vector<std::uint64_t> counts, LoadedCluster root,
                                        ViewOptions options, Triangulation empty)
    : impl_(std::make_unique<Impl>(std::move(counts), std::move(root), std::move(options),
                                   std::move(empty))) {}
template <class Triangulation>
ViewControl<Triangulation>::~ViewControl() = default;
template <class Triangulation>
auto ViewControl<Triangulation>::model() const -> const Model& {
  return impl_->model_;
}
template <class Triangulation>
const ViewOptions& ViewControl<Triangulation>::options() const {
  return impl_->options_;
}
template <class Triangulation>
auto ViewControl<Triangulation>::step(const View& view, const StepBudget& budget) -> const Step& {
  return impl_->step(view, budget);
}
template <class Triangulation>
auto ViewControl<Triangulation>::restore(unsigned threads) -> const Delta& {
  return impl_->model_.restore(threads);
}
template <class Triangulation>
bool ViewControl<Triangulation>::give(LoadedCluster cluster) {
  detail::check(cluster, impl_->model_.top());
  impl_->requested_.erase(cluster.cluster);
  impl_->faulty_.erase(cluster.cluster);
  return impl_->cache_.give(std::move(cluster));
}
template <class Triangulation>
const LoadedCluster* ViewControl<Triangulation>::cached_cluster(ClusterId cluster) const {
  return std::as_const(impl_->cache_).find(cluster);
}
template <class Triangulation>
void ViewControl<Triangulation>::give_record(ClusterId cluster, const ClusterRecord& record) {
  if (const auto place = impl_->tree().find(cluster)) impl_->front_.set_record(*place, record);
}
template <class Triangulation>
std::optional<ClusterRecord> ViewControl<Triangulation>::represented_cluster(
    VertexId vertex) const {
  const ClusterTree& tree = impl_->tree();
  std::optional<ClusterRecord> record;
  impl_->model_.impl_->owners_.for_each(vertex, [&](VertexOwners::Owner owner) {
    for (unsigned level = tree.level(owner.slot); level-- > 0 && !record;) {
      const auto place = tree.find(tree.headed_cluster(owner.slot, owner.index, level));
      if (place && tree.child_slot(*place) == ClusterTree::kNoSlot) {
        record = impl_->front_.record(*place);
      }
    }
  });
  return record;
}
template <class Triangulation>
bool ViewControl<Triangulation>::meets_collapsed(const Box3& box) const {
  return impl_->front_.meets_collapsed(box);
}
template <class Triangulation>
void ViewControl<Triangulation>::forget(ClusterId cluster) {
  impl_->requested_.erase(cluster);
}
template <class Triangulation>
void ViewControl<Triangulation>::pin(ClusterId cluster, Pin state) {
  impl_->front_.pin(cluster, state);
  if constexpr (Impl::kThins) {
    impl_->thinning_.pinned_expanded.erase(cluster);
    if (level_of(cluster) == 0 && state == Pin::expanded)
      impl_->thinning_.pinned_expanded.insert(cluster);
  }
}
template <class Triangulation>
void ViewControl<Triangulation>::unpin(ClusterId cluster) {
  impl_->front_.unpin(cluster);
  if constexpr (Impl::kThins) impl_->thinning_.pinned_expanded.erase(cluster);
}
template <class Triangulation>
std::size_t ViewControl<Triangulation>::cached_bytes() const {
  return impl_->cache_.bytes();
}
template <class Triangulation>
std::size_t ViewControl<Triangulation>::memory_bytes() const {
  std::size_t bytes =
      impl_->model_.memory_bytes() + impl_->front_.memory() + impl_->requested_.size() * 64;
  if constexpr (Impl::kThins)
    bytes += impl_->thinning_.windows.memory() + impl_->thinning_.demand.memory();
  return bytes;
}

}  // namespace terrace::tri
