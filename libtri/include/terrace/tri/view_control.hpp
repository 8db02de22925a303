// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "terrace/tri/multiresolution.hpp"
#include "terrace/tri/view.hpp"
#include "terrace/tri/view_cache.hpp"
#include "terrace/tri/view_front.hpp"
#include "terrace/tri/view_meter.hpp"

namespace terrace::tri {

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
/// Memory beside the model: 85 bytes per expanded cluster and 65 per cluster that could be expanded
/// (with outlines 32 more each), and the given clusters that are kept.
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

/// The view control of points in the plane with heights.
template <class Coord>
using ViewControl2 = ViewControl<Delaunay2<Coord>>;

}  // namespace terrace::tri

#include "terrace/tri/view_control_impl.hpp"  // IWYU pragma: keep
