// SPDX-License-Identifier: Apache-2.0
#include "owners.hpp"

#include <algorithm>
#include <iterator>

namespace terrace::tri {
namespace {

PointId point_id(VertexOwners::Owner owner, const ClusterTree& tree) {
  return {tree.id(owner.slot), owner.index};
}

}  // namespace

void VertexOwners::reserve(std::size_t vertex_slots) {
  const std::size_t capacity = representatives_.capacity();
  if (vertex_slots <= capacity) return;
  // Grows by at least an eighth instead of doubling: memory per vertex matters here.
  const std::size_t wanted = std::max(vertex_slots, capacity + capacity / 8 + 64);
  representatives_.reserve(wanted);
  heights_.reserve(wanted);
}

void VertexOwners::grow(std::size_t slots) {
  reserve(slots);
  representatives_.resize(slots);
  heights_.resize(slots);
}

VertexOwners::Change VertexOwners::add_other(VertexId vertex, Owner owner, double height,
                                             const ClusterTree& tree) {
  Owner& current = representatives_[static_cast<std::uint32_t>(vertex)];
  double& current_height = heights_[static_cast<std::uint32_t>(vertex)];
  const Owner former = representative(vertex);
  const PointId former_id = point_id(former, tree), id = point_id(owner, tree);
  if (takes_precedence(id, former_id)) {
    other_owners_.insert({vertex, former_id, former, current_height});
    current = {owner.slot, owner.index | kShared};
    current_height = height;
    return Change::other;
  }
  other_owners_.insert({vertex, id, owner, height});
  current.index |= kShared;
  return Change::none;
}

VertexOwners::Change VertexOwners::remove_shared(VertexId vertex, Owner owner,
                                                 const ClusterTree& tree) {
  Owner& current = representatives_[static_cast<std::uint32_t>(vertex)];
  const bool represents = current.slot == owner.slot && (current.index & ~kShared) == owner.index;
  const auto first = other_owners_.lower_bound({vertex, kFirstId, {}, 0.0});
  assert(first != other_owners_.end() && first->vertex == vertex);
  const auto removed =
      represents ? first : other_owners_.find({vertex, point_id(owner, tree), owner, 0.0});
  assert(removed != other_owners_.end());
  if (represents) {
    current = {removed->owner.slot, removed->owner.index | kShared};
    heights_[static_cast<std::uint32_t>(vertex)] = removed->height;
  }
  const auto next = other_owners_.erase(removed);
  const bool is_single = (next == other_owners_.end() || next->vertex != vertex) &&
                         (next == other_owners_.begin() || std::prev(next)->vertex != vertex);
  if (is_single) current.index &= ~kShared;
  return represents ? Change::other : Change::none;
}

std::size_t VertexOwners::memory() const {
  constexpr std::size_t kNode = sizeof(OtherOwner) + 4 * sizeof(void*);
  return representatives_.capacity() * sizeof(Owner) + heights_.capacity() * sizeof(double) +
         other_owners_.size() * kNode;
}

}  // namespace terrace::tri
