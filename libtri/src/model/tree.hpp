// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "map.hpp"
#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri {

/// The expanded clusters and how they hang together; the part of the multiresolution model that
/// knows nothing of any triangulation. A cluster of level L, headed by p, has as children the
/// clusters of level L - 1 headed by p and by each member; it can be expanded while its parent is.
///
/// A step has two halves. In the first, plan() or stage() reads from the source all that the step
/// needs; any exception there leaves the tree as it was. In the second, the clusters to collapse
/// are released; nothing in it can fail.
///
/// Memory: 48 bytes per expanded cluster and 4 per member; above level 0 also 20 + 8 * level per
/// member and about 24 for its place in the map, and 64 once its record was asked for.
class ClusterTree {
 public:
  using Slot = std::uint32_t;
  static constexpr Slot kNoSlot = 0xFFFFFFFFu;
  static constexpr Slot kRoot = 0;
  /// Indices have 31 bits, the last one means the head.
  static constexpr std::uint32_t kMaxMembers = 0x7FFFFFFEu;

  /// The source must outlive the tree. Call read_root() before anything else.
  explicit ClusterTree(ClusterSource& source);

  // Clusters that are there: expanded or staged.
  [[nodiscard]] ClusterId id(Slot slot) const { return clusters_[slot].id; }
  [[nodiscard]] unsigned level(Slot slot) const { return level_of(clusters_[slot].id); }
  [[nodiscard]] std::uint32_t size(Slot slot) const { return clusters_[slot].size; }
  /// One handle per member, to be filled in and read by the owner of the triangulation.
  [[nodiscard]] std::span<VertexId> vertices(Slot slot) {
    return {clusters_[slot].vertices.get(), clusters_[slot].size};
  }
  /// The vertex of the head; kNoVertex for the root.
  [[nodiscard]] VertexId head_vertex(Slot slot) const;
  /// The id of the point that heads the cluster. Requires slot != kRoot.
  [[nodiscard]] PointId head(Slot slot) const;
  /// The cluster of `level` that a member heads. Requires level < level(slot).
  [[nodiscard]] ClusterId headed_by(Slot slot, std::uint32_t member, unsigned level) const;

  // Clusters that could be there: the children of expanded clusters.
  [[nodiscard]] std::optional<ChildRef> find(ClusterId id) const;
  [[nodiscard]] std::uint32_t child_count(Slot slot) const;
  [[nodiscard]] ClusterId child_id(ChildRef child) const;
  [[nodiscard]] VertexId head_vertex(ChildRef child) const;
  /// The cluster one level below the child that the child's own head heads. Requires a child above
  /// level 0.
  [[nodiscard]] ClusterId head_child(ChildRef child) const;
  /// Whether a cluster is in this slot; any number.
  [[nodiscard]] bool live(Slot slot) const {
    return slot < clusters_.size() && clusters_[slot].live;
  }
  [[nodiscard]] Slot slots() const { return static_cast<Slot>(clusters_.size()); }
  /// Where an expanded cluster hangs; its parent is kNoSlot for the root.
  [[nodiscard]] ChildRef place(Slot slot) const { return clusters_[slot].place; }
  /// kNoSlot while it is not expanded.
  [[nodiscard]] Slot child_slot(ChildRef child) const;
  /// Asks the source at the first call, remembers afterwards. Throws: what the source throws;
  /// HierarchyError if the record makes no sense.
  const ClusterRecord& record(ChildRef child);

  [[nodiscard]] bool has_expanded_children(Slot slot) const {
    return clusters_[slot].inner && clusters_[slot].inner->expanded != 0;
  }

  /// Number of expanded clusters, the root not counted.
  [[nodiscard]] std::size_t expanded_count() const { return live_ - 1; }
  /// Calls visit(slot) for each of them, in no order worth knowing.
  template <class Visit>
  void for_each_expanded(Visit&& visit) const {
    for (Slot s = kRoot + 1; s < clusters_.size(); ++s) {
      if (clusters_[s].live) visit(s);
    }
  }
  [[nodiscard]] unsigned top() const { return level(kRoot); }

  /// What a plan does with a child of an expanded cluster.
  enum class Verdict {
    keep,          ///< leave it and all below it as it is
    visit,         ///< leave it, but look at its children if it is expanded
    expand,        ///< expand it, if it is not, and look at its children
    expand_alone,  ///< the same, but none of its children is wanted expanded
    collapse       ///< collapse it, if it is expanded, and with it all below
  };
  using Judge = std::function<Verdict(ChildRef, unsigned level, bool expanded)>;
  /// Receives the positions of a staged cluster, before the next is read. May throw.
  using Take = std::function<void(Slot, ClusterId, std::span<const Point3>)>;

  /// Stages the root.
  void read_root(const Take& take);

  /// A step to come. `staged`: parents before children. `collapsed`: children before parents.
  struct Plan {
    std::vector<Slot> staged, collapsed;
  };
  /// Walks down from the root, level by level, and reads the clusters that `judge` wants expanded.
  /// Throws: what the source, judge or take throw, HierarchyError; the tree is then unchanged.
  [[nodiscard]] Plan plan(const Judge& judge, const Take& take);
  /// The plan that expands one cluster. Requires that it is not expanded.
  [[nodiscard]] Plan plan_expand(ChildRef child, const Take& take);
  /// The plan that collapses one cluster and all below it.
  [[nodiscard]] Plan plan_collapse(Slot slot) const;
  /// Takes back what a plan has staged.
  void cancel(const Plan& plan);

  /// Drops a collapsed cluster. Requires that nothing below it is expanded.
  void release(Slot slot);

  /// Bytes held.
  [[nodiscard]] std::size_t memory() const;

 private:
  // What only clusters above level 0 have.
  struct Inner {
    std::vector<std::uint64_t> ordinals;  // of the clusters its members head: level per member
    std::vector<Slot> children;           // of those one level down; kNoSlot if not expanded
    std::vector<ClusterRecord> records;   // of the same; empty until one was asked for
    std::uint32_t expanded = 0;           // number of children that are
  };
  struct Cluster {
    ClusterId id{};
    ChildRef place;       // among its parent's children
    Slot home = kNoSlot;  // the head is member home_index of the cluster in this slot
    std::uint32_t home_index = 0;
    std::uint32_t size = 0;
    bool live = false;
    std::unique_ptr<VertexId[]> vertices;
    std::unique_ptr<Inner> inner;
  };

  [[nodiscard]] Slot stage(ClusterId id, ChildRef place, const Take& take);
  void check_ordinals(ClusterId id, std::span<const std::uint64_t> ordinals) const;
  void append_below(Slot slot, std::vector<Slot>& out) const;
  void add_children(Slot slot);
  void drop_children(Slot slot, std::uint32_t count);

  ClusterSource* source_;
  std::vector<Cluster> clusters_;
  std::vector<Slot> free_;
  std::size_t live_ = 0;
  ClusterMap map_;
};

}  // namespace terrace::tri
