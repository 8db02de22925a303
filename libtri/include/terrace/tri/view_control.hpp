// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "terrace/tri/multiresolution.hpp"
#include "terrace/tri/view.hpp"
#include "terrace/tri/view_cache.hpp"
#include "terrace/tri/view_front.hpp"

namespace terrace::tri {

/// What a step needs to spend; all times are of StepBudget::clock.
class StepMeter {
 public:
  void start(const StepBudget& budget);
  /// Whether one more operation on this many points fits. The first one always does.
  [[nodiscard]] bool has(std::size_t points) const;
  /// Call it after each operation.
  void spend(std::size_t points);
  /// Call it before the first operation, and at the end of the step.
  void ready() { last_ = now(); }
  void end();

 private:
  [[nodiscard]] double now() const { return timed_ ? budget_->clock() : 0.0; }

  const StepBudget* budget_ = nullptr;
  bool timed_ = false;
  double begin_ = 0.0, last_ = 0.0;
  std::size_t operations_ = 0, points_ = 0;
  // Seconds per point of operations and of the end, as in the steps before.
  double operation_rate_ = 0.0, end_rate_ = 0.0;
};

/// Level of detail by view: a multiresolution model that follows a camera under budgets of memory
/// and time, and never waits for data. Each step it tells which clusters it lacks; whoever drives
/// it loads them in any manner and gives them, whenever they are there.
///
/// With S the expanded clusters, a view that stays, enough budgets and all clusters given, steps
/// end at
///     { c : want(c) > 1 }  and  { c in S : keep(c) >= collapse_below }
/// whatever interrupts them, want and keep being the demands of the view and of the view widened by
/// the guard, each no greater than that of the cluster above. So what a step has done the next one
/// does not undo. (J. Skala, Algorithms for manipulating large geometric data, section 8.4, expands
/// by closeness alone.)
///
/// Order of a step: what is wanted most is expanded first. Where the points would be too many,
/// clusters of less than collapse_below times its demand are collapsed for it: out of view first,
/// the farthest of them first, then those of the least demand. What time is left goes to collapsing
/// what is no longer wanted, in the same order; once that is a quarter of the points, it comes
/// before expanding. Under max_points the outcome depends on sizes, but
/// it too stays once it is reached.
///
/// Cost of a step without changes: O(expanded clusters + collapsed clusters next to wanted ones).
/// Memory beside the model: 57 bytes per expanded cluster and 65 per cluster that could be expanded
/// (with outlines 89 and 97), and the given clusters that are kept.
template <DynamicTriangulation Triangulation>
class ViewControl {
 public:
  using Model = MultiresolutionModel<Triangulation>;
  using Delta = typename Model::Delta;
  using Pin = ViewFront::Pin;

  struct Fault {
    ClusterId cluster{};
    std::string what;
  };
  /// What a step did and what it lacks. Lives until the next step.
  struct Step {
    const Delta* delta = nullptr;
    std::size_t expanded = 0, collapsed = 0;  ///< clusters
    /// Wanted clusters that remain collapsed: not given yet; given, but the step's budget was
    /// spent; no room under max_points or max_cached_bytes.
    std::size_t missing = 0, pending = 0, blocked = 0;
    /// The greatest demand among these; at most 1: the view is as detailed as it should be.
    double worst = 0.0;
    /// Whether another step with the same view and no new clusters would change nothing.
    bool settled = false;
    /// The missing ones that are worth loading, most important first, as far as max_points and
    /// max_cached_bytes have room for them; then those that may be wanted soon.
    std::vector<ViewRequest> wanted;
    /// Of these, those that no step has named before, or only before they were withdrawn or
    /// forgotten: for a caller who starts loading at once.
    std::vector<ViewRequest> requests;
    /// Named before and of no use any more, in ascending order.
    std::vector<ClusterId> withdrawn;
    /// Clusters that contradict themselves; they stay collapsed until they are given again.
    std::vector<Fault> faults;
  };

  /// counts: clusters of each level below the top, as ClusterSource::cluster_count tells. root: all
  /// of cluster_id(counts.size(), 0).
  /// Throws: HierarchyError, std::length_error; std::invalid_argument for options out of range.
  ViewControl(std::vector<std::uint64_t> counts, GivenCluster root, ViewOptions options = {});
  ViewControl(const ViewControl&) = delete;
  ViewControl& operator=(const ViewControl&) = delete;

  [[nodiscard]] const Model& model() const { return model_; }
  [[nodiscard]] const ViewOptions& options() const { return options_; }

  /// Brings the model nearer to what the view asks for. Throws std::invalid_argument for a
  /// tolerance that is negative or not a number, or seconds without a clock; nothing has changed
  /// then. Clock and cone must not throw.
  const Step& step(const View& view, const StepBudget& budget = {});

  /// Hands over a cluster, asked for or not. It is kept, as far as max_cached_bytes goes, also
  /// after it was expanded, for when it comes back. False: it is larger than the budget.
  /// Throws HierarchyError where counts of members, children and records do not agree.
  bool give(GivenCluster cluster);
  /// Loading it has failed, or was given up: it may be asked for again.
  void forget(ClusterId cluster) { asked_.erase(cluster); }

  /// Overrides the view: see ViewFront::pin.
  void pin(ClusterId cluster, Pin how) { front_.pin(cluster, how); }
  void unpin(ClusterId cluster) { front_.unpin(cluster); }

  /// Bytes of the given clusters.
  [[nodiscard]] std::size_t cached_bytes() const { return cache_.bytes(); }
  /// Bytes held beside the triangulation and the given clusters.
  [[nodiscard]] std::size_t memory_bytes() const {
    return model_.memory_bytes() + front_.memory() + asked_.size() * 64;
  }

 private:
  using Slot = ClusterTree::Slot;
  using Candidate = ViewFront::Candidate;
  struct Asked {
    std::uint64_t step = 0;
    double bytes = 0.0;
  };

  void expand_wanted();
  bool collapse_unwanted(std::size_t up_to);
  enum class Room { enough, none, later };
  [[nodiscard]] std::size_t lacking(std::size_t points) const {
    const std::size_t needed = model_.point_count() + points;
    return needed > options_.max_points ? needed - options_.max_points : 0;
  }
  [[nodiscard]] bool could_fit(const Candidate& candidate, std::size_t points);
  [[nodiscard]] Room make_room(const Candidate& candidate);
  void ask(const Candidate& candidate);
  void ask_soon();
  void request(const Candidate& candidate, double importance, double bytes);
  void expand(const Candidate& candidate, const GivenCluster& given);
  void collapse(Slot slot);
  void withdraw();

  ViewOptions options_;
  ViewCache cache_;
  Model model_;
  ViewFront front_;
  std::unordered_map<ClusterId, Asked> asked_;
  std::set<ClusterId> faulty_;

  Step result_;
  StepMeter meter_;
  std::uint64_t number_ = 0;  // of the step
  bool evict_ = true;         // whether room can still be made in this step
  std::size_t claimed_ = 0;   // points of clusters that are given or asked for and wanted
  double claimed_bytes_ = 0.0;
};

namespace detail {

/// Throws HierarchyError where a given cluster contradicts itself.
void check(const GivenCluster& cluster, unsigned top);
ViewOptions checked(ViewOptions options);

}  // namespace detail

template <DynamicTriangulation Triangulation>
ViewControl<Triangulation>::ViewControl(std::vector<std::uint64_t> counts, GivenCluster root,
                                        ViewOptions options)
    : options_(detail::checked(std::move(options))),
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
      model_(cache_, Detail{}, options_.model),
      front_(model_.tree_, options_) {
  front_.add(ClusterTree::kRoot, root.child_records, nullptr);
  cache_.drop(root.cluster);
  cache_.limit(options_.max_cached_bytes);
}

template <DynamicTriangulation Triangulation>
auto ViewControl<Triangulation>::step(const View& view, const StepBudget& budget) -> const Step& {
  check(view);
  meter_.start(budget);
  result_ = {};
  ++number_;
  evict_ = true;
  claimed_ = 0;
  claimed_bytes_ = 0.0;
  for (const auto& [id, asked] : asked_) claimed_bytes_ += asked.bytes;

  front_.start(view);
  meter_.ready();
  model_.open_step();
  expand_wanted();
  ask_soon();
  const bool done = collapse_unwanted(0);
  withdraw();
  result_.delta = &model_.close_step();
  meter_.end();
  result_.settled = done && result_.pending == 0 && result_.expanded == 0 && result_.collapsed == 0;
  return result_;
}

// Until no more than so many points of unwanted clusters are left; false if the budget ended first.
template <DynamicTriangulation Triangulation>
bool ViewControl<Triangulation>::collapse_unwanted(std::size_t up_to) {
  while (front_.points_below(options_.collapse_below) > up_to || up_to == 0) {
    if (!meter_.has(0)) return false;
    const Slot slot = front_.next_to_collapse(options_.collapse_below);
    if (slot == ClusterTree::kNoSlot) break;
    collapse(slot);
  }
  return true;
}

template <DynamicTriangulation Triangulation>
void ViewControl<Triangulation>::expand_wanted() {
  while (const auto candidate = front_.next()) {
    if (!faulty_.empty() && faulty_.count(candidate->id)) continue;
    const GivenCluster* given = cache_.find(candidate->id, false);
    Room room = Room::none;
    if (!given) {
      ++result_.missing;
      ask(*candidate);
    } else {
      room = make_room(*candidate);
      if (room == Room::later) ++result_.pending;
      if (room == Room::none) ++result_.blocked;
      if (room == Room::later) {
        claimed_ += given->positions.size();
        claimed_bytes_ += ViewCache::bytes_of(level_of(candidate->id), candidate->members);
      }
      if (room != Room::none) cache_.find(candidate->id, true);
    }
    if (room == Room::enough) {
      expand(*candidate, *given);
    } else {
      result_.worst = std::max(result_.worst, candidate->want);
    }
  }
}

// Whether room could be made for so many points. Once there is none for a cluster, none is made for
// a lesser one; but what is unwanted anyway always gives way. So it does not matter where a step
// was interrupted.
template <DynamicTriangulation Triangulation>
bool ViewControl<Triangulation>::could_fit(const Candidate& candidate, std::size_t points) {
  const std::size_t lack = lacking(points);
  if (lack == 0) return true;
  const double unwanted = options_.collapse_below;
  if (evict_ && front_.points_below(unwanted * candidate.want) >= lack) return true;
  if (points == candidate.members) evict_ = false;
  return front_.points_below(unwanted) >= lack;
}

template <DynamicTriangulation Triangulation>
auto ViewControl<Triangulation>::make_room(const Candidate& candidate) -> Room {
  const std::size_t members = static_cast<std::size_t>(candidate.members);
  collapse_unwanted(model_.point_count() / 4 + 1);
  if (lacking(members) > 0) {
    if (!could_fit(candidate, members)) return Room::none;
    const double below = options_.collapse_below * (evict_ ? candidate.want : 1.0);
    while (lacking(members) > 0) {
      if (!meter_.has(0)) return Room::later;
      const Slot slot = front_.next_to_collapse(below);
      if (slot == ClusterTree::kNoSlot) return Room::none;  // pins hold them
      collapse(slot);
    }
  }
  // What went may have had this cluster below it.
  const auto place = model_.tree_.find(candidate.id);
  if (!place || *place != candidate.place) return Room::none;
  return meter_.has(members) ? Room::enough : Room::later;
}

template <DynamicTriangulation Triangulation>
void ViewControl<Triangulation>::ask(const Candidate& candidate) {
  const std::size_t members = static_cast<std::size_t>(
      std::min<std::uint64_t>(candidate.members, ClusterTree::kMaxMembers));
  const unsigned level = level_of(candidate.id);
  // Nothing is asked for that could not be expanded, or kept until then.
  const std::size_t claims = claimed_ + members;
  const auto known = asked_.find(candidate.id);
  const double bytes = ViewCache::bytes_of(level, members);
  const double more = known == asked_.end() ? bytes : 0.0;
  if (!could_fit(candidate, members) || !could_fit(candidate, claims) ||
      claimed_bytes_ + more > static_cast<double>(cache_.max_bytes())) {
    --result_.missing;
    ++result_.blocked;
    return;
  }
  claimed_ += members;
  claimed_bytes_ += more;
  request(candidate, candidate.want, bytes);
}

// Asks early for what may be wanted soon, and holds on to it if it is there.
template <DynamicTriangulation Triangulation>
void ViewControl<Triangulation>::ask_soon() {
  for (const Candidate& candidate : front_.soon()) {
    if (!faulty_.empty() && faulty_.count(candidate.id)) continue;
    const double bytes = ViewCache::bytes_of(level_of(candidate.id), candidate.members);
    const bool known = asked_.count(candidate.id) != 0;
    if (!known && claimed_bytes_ + bytes > static_cast<double>(cache_.max_bytes())) break;
    if (!known) claimed_bytes_ += bytes;
    if (!cache_.find(candidate.id, true)) request(candidate, std::min(candidate.keep, 1.0), bytes);
  }
}

template <DynamicTriangulation Triangulation>
void ViewControl<Triangulation>::request(const Candidate& candidate, double importance,
                                         double bytes) {
  ViewRequest request{candidate.id, {}, candidate.members, importance};
  if (level_of(candidate.id) > 0) request.head_child = model_.tree_.head_child(candidate.place);
  result_.wanted.push_back(request);
  const auto [known, fresh] = asked_.try_emplace(candidate.id, Asked{number_, bytes});
  if (fresh) result_.requests.push_back(request);
  known->second.step = number_;
}

template <DynamicTriangulation Triangulation>
void ViewControl<Triangulation>::expand(const Candidate& candidate, const GivenCluster& given) {
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
  front_.add(model_.tree_.child_slot(candidate.place), given.child_records, &candidate);
  meter_.spend(given.positions.size());
}

template <DynamicTriangulation Triangulation>
void ViewControl<Triangulation>::collapse(Slot slot) {
  const ClusterId id = model_.tree_.id(slot);
  const ChildRef place = model_.tree_.place(slot);
  const std::size_t points = model_.tree_.size(slot);
  model_.collapse(id);
  front_.drop(slot, place);
  cache_.find(id, true);  // likely to come back
  ++result_.collapsed;
  meter_.spend(points);
}

// What was asked for and is neither wanted now nor within the band of hysteresis.
template <DynamicTriangulation Triangulation>
void ViewControl<Triangulation>::withdraw() {
  for (const auto& [id, asked] : asked_) {
    if (asked.step == number_) continue;
    const auto place = model_.tree_.find(id);
    if (place && front_.keep(*place) >= options_.collapse_below) continue;
    result_.withdrawn.push_back(id);
  }
  std::sort(result_.withdrawn.begin(), result_.withdrawn.end());
  for (const ClusterId id : result_.withdrawn) asked_.erase(id);
}

template <DynamicTriangulation Triangulation>
bool ViewControl<Triangulation>::give(GivenCluster cluster) {
  detail::check(cluster, model_.top());
  asked_.erase(cluster.cluster);
  faulty_.erase(cluster.cluster);
  return cache_.give(std::move(cluster));
}

/// The view control of points in the plane with heights.
template <class Coord>
using ViewControl2 = ViewControl<Delaunay2<Coord>>;

}  // namespace terrace::tri
