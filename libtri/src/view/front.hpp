// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "columns.hpp"
#include "model/tree.hpp"
#include "terrace/tri/view.hpp"

namespace terrace::tri {

/// Decides by a view which clusters to expand and which to collapse, and in what order; it knows
/// the tree of expanded clusters and no triangulation.
///
/// The demand of a cluster is taken to be no greater than that of the one above it: then what is
/// wanted is a tree, whatever records and cones say. It loses no truth of the error: no descendant
/// is farther from the head of the cluster above, which is present, than that one's error.
///
/// Per step it measures the expanded clusters, one box around the collapsed children of each, and
/// the children themselves only where that box may hold one that is wanted.
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

  /// The tree must outlive it.
  ViewFront(const ClusterTree& tree, const ViewOptions& options);

  /// Call it for the root, then for every cluster that was expanded, with the records of its
  /// children in the tree's order. In a step (after start()), `candidate` is what next() gave.
  void add(Slot slot, std::span<const ClusterRecord> children, const Candidate* candidate);
  /// Call it after the tree has released the cluster, with the place where it hung.
  void drop(Slot slot, ChildRef place);
  [[nodiscard]] std::uint64_t members(ChildRef child) const {
    return groups_[group_of_[child.parent]]->members[child.index];
  }
  /// As it was given, but for bounds beyond 1e150.
  [[nodiscard]] ClusterRecord record(ChildRef child) const;

  /// Overrides the view for one cluster: what is pinned expanded is so as soon as the cluster above
  /// it is, and then all above it stays; what is pinned collapsed takes all below along.
  void pin(ClusterId cluster, Pin how) { pins_[cluster] = how; }
  void unpin(ClusterId cluster) { pins_.erase(cluster); }

  /// Measures all. The view must live until the step's end.
  void start(const View& view);
  /// The collapsed cluster that is wanted most, of equals the coarsest, then the smallest id; none
  /// when no demand is left that is more than 1. Children of what was added take part.
  [[nodiscard]] std::optional<Candidate> next();
  /// Those that may be wanted soon, the most demanded first. Call it when next() has no more.
  [[nodiscard]] std::span<const Candidate> soon();
  /// Points of expanded clusters whose demand is less than `below`.
  [[nodiscard]] std::size_t points_below(double below);
  /// The expanded cluster to collapse first, if its demand is less than `below`: out of view before
  /// in view, then the farthest; in view the least demand, then the farthest. Children before
  /// parents. kNoSlot: none.
  [[nodiscard]] Slot next_to_collapse(double below);
  /// By the widened view, of a child now.
  [[nodiscard]] double keep(ChildRef child);

  [[nodiscard]] std::size_t memory() const;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  // The children of one expanded cluster.
  struct Group {
    Slot parent = ClusterTree::kNoSlot;
    std::vector<std::uint64_t> members;  // numbers of them
    ViewColumns columns;
  };
  struct Ordered {
    double key;
    ClusterId id;
    Slot slot;
    std::size_t points_before;  // of those earlier in the order
  };

  /// The order of the heap: whether `a` comes after `b`.
  [[nodiscard]] static bool less_wanted(const Candidate& a, const Candidate& b);
  void bound(std::uint32_t group);
  void measure_group(std::uint32_t group);
  void clamp_to_parents();
  void apply_pins();
  void override_by_pins(std::uint32_t group);
  void sort(double below);
  [[nodiscard]] double key(Slot slot) const;
  [[nodiscard]] bool pinned_down(Slot slot) const { return own_.keep[slot] == kPinnedDown; }
  static constexpr double kPinnedDown = -1.0;

  const ClusterTree* tree_;
  const ViewOptions* options_;
  double ask_above_;
  std::map<ClusterId, Pin> pins_;

  // By slot: the expanded clusters.
  ViewColumns columns_;
  ViewDemand own_;
  std::vector<std::uint32_t> group_of_;
  // By number of group: a box and the greatest error of its collapsed children.
  std::vector<std::unique_ptr<Group>> groups_;
  std::vector<std::uint32_t> free_groups_, changed_groups_;
  ViewColumns bounds_;
  ViewDemand bound_demand_;

  // A step's.
  const View* view_ = nullptr;
  std::vector<Candidate> candidates_;  // a heap
  std::vector<Candidate> soon_;
  ViewDemand scratch_;
  std::vector<Slot> by_level_;
  std::vector<Ordered> order_;
  double sorted_below_ = 0.0;  // order_ holds the clusters of a lesser key
  std::size_t collapsed_ = 0;  // entries of order_ that are done with
  ClusterId last_{~std::uint64_t{0}};
};

}  // namespace terrace::tri
