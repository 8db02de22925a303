// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "columns.hpp"
#include "model/cluster_map.hpp"
#include "model/tree.hpp"
#include "terrace/tri/view.hpp"

namespace terrace::tri {

/// Supplies other records by which clusters are measured.
class ClusterAlignment {
 public:
  virtual ~ClusterAlignment() = default;
  /// Adds a cluster of level 0. Returns true if that changes what aligned() returns for others.
  virtual bool add(const ClusterRecord& record) = 0;
  /// The record by which to measure a cluster.
  [[nodiscard]] virtual ClusterRecord aligned(const ClusterRecord& record,
                                              unsigned level) const = 0;
};

/// Decides by a view which clusters to expand and to collapse, and in what order. Depends on the
/// tree of expanded clusters but not on a triangulation.
///
/// The demand of a cluster is limited to the demand of the cluster above it, so the wanted clusters
/// form a tree, whatever records and cones say. The error bound remains true: no descendant is
/// farther from the head of the cluster above, which is present, than that cluster's error.
///
/// A step measures the expanded clusters and one box around the collapsed children of each. It
/// measures the children themselves only if that box may contain a wanted one.
class ViewFront {
 public:
  using Slot = ClusterTree::Slot;

  /// A cluster that could be expanded.
  struct Candidate {
    double want = 0.0, keep = 0.0, distance = 0.0;
    ChildRef place;
    ClusterId id{};
    std::uint64_t members = 0;
  };
  using Pin = ViewPin;

  /// All arguments must outlive this object. alignment: null if clusters are measured by their own
  /// records.
  ViewFront(const ClusterTree& tree, const ViewOptions& options,
            ClusterAlignment* alignment = nullptr);

  /// Call this for the root, then for every cluster that was expanded, with the records of its
  /// children in the tree's order. In a step (after start()), `candidate` is the result of next().
  void add(Slot slot, std::span<const ClusterRecord> children, const Candidate* candidate);
  /// Call this after the tree has released the cluster, with its former position.
  void drop(Slot slot, ChildRef place);
  [[nodiscard]] std::uint64_t members(ChildRef child) const {
    return groups_[group_of_[child.parent]]->members[child.index];
  }
  /// The record as it was given, except for bounds beyond 1e150.
  [[nodiscard]] ClusterRecord record(ChildRef child) const;
  /// True if the box of a collapsed cluster below an expanded one meets the given box.
  [[nodiscard]] bool meets_collapsed(const Box3& box, Slot below = ClusterTree::kRoot) const;
  /// The same for those of them, expanded or not, whose box `counts`.
  [[nodiscard]] bool meets_collapsed(const Box3& box,
                                     const std::function<bool(const Box3&)>& counts,
                                     Slot below = ClusterTree::kRoot) const;
  /// Sets the record of a child of which only bounds were known. Must not be called in a step.
  void set_record(ChildRef child, const ClusterRecord& record);

  /// Overrides the view for one cluster. A cluster pinned expanded is expanded as soon as the
  /// cluster above it is, and then all above it stay expanded. A cluster pinned collapsed keeps
  /// everything below it collapsed.
  void pin(ClusterId cluster, Pin state) { pins_[cluster] = state; }
  void unpin(ClusterId cluster) { pins_.erase(cluster); }

  /// Measures everything. The view must exist until the end of the step.
  void start(const View& view);
  /// The collapsed cluster with the greatest demand, on ties the coarsest, then the smallest id, or
  /// nullopt if no demand above 1 is left. Includes children of added clusters.
  [[nodiscard]] std::optional<Candidate> next();
  /// Upper bound of the number that is left.
  [[nodiscard]] std::size_t candidates() const { return candidates_.size(); }
  /// At most a thousand clusters that may be wanted soon, the greatest demand first. Call it after
  /// next().
  [[nodiscard]] std::span<const Candidate> upcoming() { return first_of(soon_, kMaxUpcoming); }
  /// At most a few thousand clusters whose record must be read to decide whether they are wanted,
  /// now or soon. Their `keep` is an estimate. The greatest comes first. Call it after next().
  [[nodiscard]] std::span<const Candidate> unread_records() {
    return first_of(unread_, kMaxUnread);
  }
  /// Points of expanded clusters whose demand is less than `below`.
  [[nodiscard]] std::size_t points_below(double below);
  /// The expanded cluster to collapse first, if its demand is less than `below`. Clusters out of
  /// view come before those in view, the farthest first. Those in view come in order of demand, the
  /// least first, then the farthest. Children come before parents. kNoSlot if there is none.
  /// Returns the same one until it is dropped.
  [[nodiscard]] Slot next_to_collapse(double below);
  /// The demand of a child by the widened view, computed on call.
  [[nodiscard]] double keep(ChildRef child);

  [[nodiscard]] std::size_t memory() const;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  /// Upper limits of requests ahead of time in a step. More would take too much of its time.
  static constexpr std::size_t kMaxUpcoming = 1024, kMaxUnread = 4096;
  // The children of one expanded cluster.
  struct Group {
    Slot parent = ClusterTree::kNoSlot;
    std::vector<std::uint64_t> members;  // their numbers
    ViewColumns columns;
    // With an alignment: the records by which the children are measured, and the box around all
    // children.
    ViewColumns aligned;
    Box3 box;
  };
  struct Ordered {
    double key;
    ClusterId id;
    Slot slot;
    std::size_t points_before;  // of clusters earlier in the order
  };

  /// The order of the heap: true if `a` comes after `b`.
  [[nodiscard]] static bool less_wanted(const Candidate& a, const Candidate& b);
  std::span<const Candidate> first_of(std::vector<Candidate>& list, std::size_t most);
  void set_columns(Group& group, std::uint32_t i, const ClusterRecord& record);
  [[nodiscard]] const ViewColumns& measured(const Group& group) const {
    return alignment_ != nullptr ? group.aligned : group.columns;
  }
  void align(Group& group, std::uint32_t i);
  void align_near(const Box3& changed);
  void compute_bound(std::uint32_t group);
  void measure_group(std::uint32_t group);
  void clamp_to_parents();
  void apply_pins();
  void override_by_pins(std::uint32_t group);
  void sort(double below);
  [[nodiscard]] double key(Slot slot) const;
  [[nodiscard]] bool is_pinned_collapsed(Slot slot) const {
    return demand_.keep[slot] == kPinnedCollapsed;
  }
  static constexpr double kPinnedCollapsed = -1.0;

  const ClusterTree* tree_;
  const ViewOptions* options_;
  ClusterAlignment* alignment_;
  Box3 changed_;  // around the clusters whose alignment may have changed
  double request_above_;
  std::map<ClusterId, Pin> pins_;

  // By slot: the expanded clusters.
  ViewColumns columns_;
  ViewDemand demand_;
  std::vector<std::uint32_t> group_of_;
  // By group number: a box and the greatest error of its collapsed children.
  std::vector<std::unique_ptr<Group>> groups_;
  std::vector<std::uint32_t> free_groups_, changed_groups_;
  ViewColumns bounds_;
  ViewDemand bound_demand_;

  // State of the current step.
  const View* view_ = nullptr;
  std::vector<Candidate> candidates_;  // a heap once all groups are measured
  bool is_heap_ = false;
  std::vector<Candidate> soon_, unread_;
  ViewDemand scratch_;
  std::vector<Slot> by_level_;
  std::vector<Ordered> order_;
  double sorted_below_ = 0.0;  // order_ holds the clusters with a smaller key
  std::size_t collapsed_ = 0;  // entries of order_ that are done
  ClusterId last_id_{~std::uint64_t{0}};
};

}  // namespace terrace::tri
