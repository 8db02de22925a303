// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "cluster_map.hpp"
#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri {

/// The expanded clusters and their tree: the part of the multiresolution model that does not depend
/// on a triangulation. A cluster of level L, headed by p, has as children the clusters of level L -
/// 1 headed by p and by each member. A child can be expanded while its parent is expanded.
///
/// A step has two halves. In the first, plan() or stage() reads everything that the step needs from
/// the source. An exception there leaves the tree unchanged. In the second, the clusters to
/// collapse are released, which cannot fail.
///
/// Memory: 48 bytes per expanded cluster and 4 per member. Above level 0 also 20 + 8 * level per
/// member, about 24 for its entry in the map, and 64 once its record was requested.
class ClusterTree {
 public:
  using Slot = std::uint32_t;
  static constexpr Slot kNoSlot = 0xFFFFFFFFu;
  static constexpr Slot kRoot = 0;
  /// Indices have 31 bits, and the last one represents the head.
  static constexpr std::uint32_t kMaxMembers = 0x7FFFFFFEu;

  /// The source must outlive the tree. Call read_root() before anything else.
  explicit ClusterTree(ClusterSource& source);

  // Existing clusters: expanded or staged.
  [[nodiscard]] ClusterId id(Slot slot) const { return clusters_[slot].id; }
  [[nodiscard]] unsigned level(Slot slot) const { return level_of(clusters_[slot].id); }
  [[nodiscard]] std::uint32_t size(Slot slot) const { return clusters_[slot].size; }
  /// One handle per member, written and read by the owner of the triangulation.
  [[nodiscard]] std::span<VertexId> vertices(Slot slot) {
    return {clusters_[slot].vertices.get(), clusters_[slot].size};
  }
  /// The vertex of the head, or kNoVertex for the root.
  [[nodiscard]] VertexId head_vertex(Slot slot) const;
  /// The id of the point that heads the cluster. Requires slot != kRoot.
  [[nodiscard]] PointId head(Slot slot) const;
  /// The cluster of `level` that a member heads. Requires level < level(slot).
  [[nodiscard]] ClusterId headed_cluster(Slot slot, std::uint32_t member, unsigned level) const;

  // Potential clusters: the children of expanded clusters.
  [[nodiscard]] std::optional<ChildRef> find(ClusterId id) const;
  [[nodiscard]] std::uint32_t child_count(Slot slot) const;
  [[nodiscard]] ClusterId child_id(ChildRef child) const;
  [[nodiscard]] VertexId head_vertex(ChildRef child) const;
  /// The cluster one level below the child that has the same head. Requires a child above level 0.
  [[nodiscard]] ClusterId head_child(ChildRef child) const;
  /// True if a cluster is in this slot. Accepts any number.
  [[nodiscard]] bool live(Slot slot) const {
    return slot < clusters_.size() && clusters_[slot].live;
  }
  [[nodiscard]] Slot slots() const { return static_cast<Slot>(clusters_.size()); }
  /// The position of an expanded cluster. Its parent is kNoSlot for the root.
  [[nodiscard]] ChildRef place(Slot slot) const { return clusters_[slot].place; }
  /// kNoSlot while it is not expanded.
  [[nodiscard]] Slot child_slot(ChildRef child) const;
  /// Asks the source at the first call and remembers the record. Throws whatever the source throws,
  /// and HierarchyError if the record makes no sense.
  const ClusterRecord& record(ChildRef child);

  [[nodiscard]] bool has_expanded_children(Slot slot) const {
    return clusters_[slot].inner && clusters_[slot].inner->expanded != 0;
  }

  /// Number of expanded clusters, not counting the root.
  [[nodiscard]] std::size_t expanded_count() const { return live_ - 1; }
  /// Calls visit(slot) for each of them, in unspecified order.
  template <class Visit>
  void for_each_expanded(Visit&& visit) const {
    for (Slot s = kRoot + 1; s < clusters_.size(); ++s) {
      if (clusters_[s].live) visit(s);
    }
  }
  [[nodiscard]] unsigned top() const { return level(kRoot); }

  /// The action of a plan for a child of an expanded cluster.
  enum class Verdict {
    keep,          ///< leave it and everything below it unchanged
    visit,         ///< leave it unchanged, but visit its children if it is expanded
    expand,        ///< expand it if necessary, and visit its children
    expand_alone,  ///< the same, but expand none of its children
    collapse       ///< collapse it, if it is expanded, and everything below it
  };
  using Judge = std::function<Verdict(ChildRef, unsigned level, bool expanded)>;
  /// Receives the positions of a staged cluster before the next one is read. May throw.
  using Take = std::function<void(Slot, ClusterId, std::span<const Point3>)>;

  /// Stages the root.
  void read_root(const Take& take);

  /// A planned step. `staged` lists parents before children, `collapsed` children before parents.
  struct Plan {
    std::vector<Slot> staged, collapsed;
  };
  /// Walks down from the root, level by level, and reads the clusters that `judge` wants expanded.
  /// Throws whatever the source, `judge` or `take` throw, and HierarchyError. The tree is then
  /// unchanged.
  [[nodiscard]] Plan plan(const Judge& judge, const Take& take);
  /// The plan that expands one cluster, which must not be expanded.
  [[nodiscard]] Plan plan_expand(ChildRef child, const Take& take);
  /// The plan that collapses one cluster and everything below it.
  [[nodiscard]] Plan plan_collapse(Slot slot) const;
  /// Undoes the staging of a plan.
  void cancel(const Plan& plan);

  /// Drops a collapsed cluster. Requires that nothing below it is expanded.
  void release(Slot slot);

  /// Memory in bytes.
  [[nodiscard]] std::size_t memory() const;

 private:
  // Data of clusters above level 0 only.
  struct Inner {
    std::vector<std::uint64_t> ordinals;  // the clusters headed by its members: level per member
    std::vector<Slot> children;           // children one level down, or kNoSlot if not expanded
    std::vector<ClusterRecord> records;   // of the children, or empty until one is requested
    std::uint32_t expanded = 0;           // number of expanded children
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
