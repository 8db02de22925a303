// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "terrace/tri/delaunay2.hpp"
#include "tree.hpp"

namespace terrace::tri {

/// Which points share which vertex, and which of them represents it: of several points with equal
/// coordinates the one of the highest level, then of the smallest id. A vertex exists as long as it
/// has an owner.
///
/// Memory: 16 bytes per vertex slot, and about 90 for each further owner of a vertex.
class VertexOwners {
 public:
  /// A point as a member of an expanded cluster.
  struct Owner {
    ClusterTree::Slot slot = ClusterTree::kNoSlot;
    std::uint32_t index = 0;
  };
  enum class Change {
    first,  ///< the vertex had no owner before
    last,   ///< the vertex has no owner left
    other,  ///< the vertex is now represented by another point
    none    ///< the same point represents the vertex
  };

  void reserve(std::size_t vertex_slots);
  /// Upper bound of all vertex slots seen so far.
  [[nodiscard]] std::size_t slots() const { return representatives_.size(); }

  Change add(VertexId vertex, Owner owner, double height, const ClusterTree& tree) {
    const std::size_t at = static_cast<std::uint32_t>(vertex);
    if (at >= representatives_.size()) grow(at + 1);
    if (representatives_[at].slot == ClusterTree::kNoSlot) {
      representatives_[at] = owner;
      heights_[at] = height;
      return Change::first;
    }
    return add_other(vertex, owner, height, tree);
  }

  /// Must be called while the owner's cluster is still in the tree.
  Change remove(VertexId vertex, Owner owner, const ClusterTree& tree) {
    Owner& current = representatives_[static_cast<std::uint32_t>(vertex)];
    if (current.slot == owner.slot && current.index == owner.index) {
      current.slot = ClusterTree::kNoSlot;
      return Change::last;
    }
    return remove_shared(vertex, owner, tree);
  }

  /// The point that represents an existing vertex.
  [[nodiscard]] Owner representative(VertexId vertex) const {
    const Owner owner = representatives_[static_cast<std::uint32_t>(vertex)];
    return {owner.slot, owner.index & ~kShared};
  }
  [[nodiscard]] double height(VertexId vertex) const {
    return heights_[static_cast<std::uint32_t>(vertex)];
  }
  /// Calls visit(owner) for the point that represents the vertex, then for the others in the order
  /// of succession.
  template <class Visit>
  void for_each(VertexId vertex, Visit&& visit) const {
    visit(representative(vertex));
    if (!(representatives_[static_cast<std::uint32_t>(vertex)].index & kShared)) return;
    for (auto it = other_owners_.lower_bound(OtherOwner{vertex, kFirstId, {}, 0.0});
         it != other_owners_.end() && it->vertex == vertex; ++it) {
      visit(it->owner);
    }
  }

  [[nodiscard]] std::size_t memory() const;

 private:
  /// Set in the index of a representing owner that is not the only one.
  static constexpr std::uint32_t kShared = 0x80000000u;

  /// Sorts before all points.
  static constexpr PointId kFirstId{cluster_id(255, 0), 0};

  // An owner that does not represent its vertex. Points at the same x, y (walls seen from above)
  // can give one vertex many owners, so they are kept in order.
  struct OtherOwner {
    VertexId vertex{};
    PointId id;
    Owner owner;
    double height = 0.0;
    bool operator<(const OtherOwner& other) const {
      if (vertex != other.vertex) return vertex < other.vertex;
      return takes_precedence(id, other.id);
    }
  };

  void grow(std::size_t slots);
  Change add_other(VertexId vertex, Owner owner, double height, const ClusterTree& tree);
  Change remove_shared(VertexId vertex, Owner owner, const ClusterTree& tree);

  std::vector<Owner> representatives_;
  std::vector<double> heights_;
  std::set<OtherOwner> other_owners_;
};

}  // namespace terrace::tri
