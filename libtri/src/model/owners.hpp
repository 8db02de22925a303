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
  [[nodiscard]] std::size_t slots() const { return standing_.size(); }

  Change add(VertexId vertex, Owner owner, double height, const ClusterTree& tree) {
    const std::size_t at = static_cast<std::uint32_t>(vertex);
    if (at >= standing_.size()) grow(at + 1);
    if (standing_[at].slot == ClusterTree::kNoSlot) {
      standing_[at] = owner;
      heights_[at] = height;
      return Change::first;
    }
    return add_further(vertex, owner, height, tree);
  }

  /// Must be called while the owner's cluster is still in the tree.
  Change remove(VertexId vertex, Owner owner, const ClusterTree& tree) {
    Owner& standing = standing_[static_cast<std::uint32_t>(vertex)];
    if (standing.slot == owner.slot && standing.index == owner.index) {
      standing.slot = ClusterTree::kNoSlot;
      return Change::last;
    }
    return remove_shared(vertex, owner, tree);
  }

  /// The point that represents an existing vertex.
  [[nodiscard]] Owner standing(VertexId vertex) const {
    const Owner owner = standing_[static_cast<std::uint32_t>(vertex)];
    return {owner.slot, owner.index & ~kShared};
  }
  /// True if a point is on the vertex in this slot, which must be below slots().
  [[nodiscard]] bool owned(VertexId vertex) const {
    return standing_[static_cast<std::uint32_t>(vertex)].slot != ClusterTree::kNoSlot;
  }
  [[nodiscard]] double height(VertexId vertex) const {
    return heights_[static_cast<std::uint32_t>(vertex)];
  }
  /// Calls visit(owner) for the point that represents the vertex, then for the others in the order
  /// of succession.
  template <class Visit>
  void for_each(VertexId vertex, Visit&& visit) const {
    visit(standing(vertex));
    if (!(standing_[static_cast<std::uint32_t>(vertex)].index & kShared)) return;
    for (auto it = further_.lower_bound(Further{vertex, kFirst, {}, 0.0});
         it != further_.end() && it->vertex == vertex; ++it) {
      visit(it->owner);
    }
  }

  [[nodiscard]] std::size_t memory() const;

 private:
  /// Set in the index of a representing owner that is not the only one.
  static constexpr std::uint32_t kShared = 0x80000000u;

  /// Sorts before all points.
  static constexpr PointId kFirst{cluster_id(255, 0), 0};

  // A waiting owner. Points at the same x, y (walls seen from above) can give one vertex many
  // owners, so they are kept in order.
  struct Further {
    VertexId vertex{};
    PointId id;
    Owner owner;
    double height = 0.0;
    bool operator<(const Further& other) const {
      if (vertex != other.vertex) return vertex < other.vertex;
      return stands_before(id, other.id);
    }
  };

  void grow(std::size_t slots);
  Change add_further(VertexId vertex, Owner owner, double height, const ClusterTree& tree);
  Change remove_shared(VertexId vertex, Owner owner, const ClusterTree& tree);

  std::vector<Owner> standing_;
  std::vector<double> heights_;
  std::set<Further> further_;
};

}  // namespace terrace::tri
