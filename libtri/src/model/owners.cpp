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
  const std::size_t capacity = standing_.capacity();
  if (vertex_slots <= capacity) return;
  // Grows by at least an eighth instead of doubling: memory per vertex matters here.
  const std::size_t wanted = std::max(vertex_slots, capacity + capacity / 8 + 64);
  standing_.reserve(wanted);
  heights_.reserve(wanted);
}

void VertexOwners::grow(std::size_t slots) {
  reserve(slots);
  standing_.resize(slots);
  heights_.resize(slots);
}

VertexOwners::Change VertexOwners::add_further(VertexId vertex, Owner owner, double height,
                                               const ClusterTree& tree) {
  Owner& standing = standing_[static_cast<std::uint32_t>(vertex)];
  double& standing_height = heights_[static_cast<std::uint32_t>(vertex)];
  const Owner before = this->standing(vertex);
  const PointId before_id = point_id(before, tree), id = point_id(owner, tree);
  if (stands_before(id, before_id)) {
    further_.insert({vertex, before_id, before, standing_height});
    standing = {owner.slot, owner.index | kShared};
    standing_height = height;
    return Change::other;
  }
  further_.insert({vertex, id, owner, height});
  standing.index |= kShared;
  return Change::none;
}

VertexOwners::Change VertexOwners::remove_shared(VertexId vertex, Owner owner,
                                                 const ClusterTree& tree) {
  Owner& standing = standing_[static_cast<std::uint32_t>(vertex)];
  const bool stood = standing.slot == owner.slot && (standing.index & ~kShared) == owner.index;
  const auto first = further_.lower_bound({vertex, kFirst, {}, 0.0});
  assert(first != further_.end() && first->vertex == vertex);
  const auto gone = stood ? first : further_.find({vertex, point_id(owner, tree), owner, 0.0});
  assert(gone != further_.end());
  if (stood) {
    standing = {gone->owner.slot, gone->owner.index | kShared};
    heights_[static_cast<std::uint32_t>(vertex)] = gone->height;
  }
  const auto after = further_.erase(gone);
  const bool alone = (after == further_.end() || after->vertex != vertex) &&
                     (after == further_.begin() || std::prev(after)->vertex != vertex);
  if (alone) standing.index &= ~kShared;
  return stood ? Change::other : Change::none;
}

std::size_t VertexOwners::memory() const {
  constexpr std::size_t kNode = sizeof(Further) + 4 * sizeof(void*);
  return standing_.capacity() * sizeof(Owner) + heights_.capacity() * sizeof(double) +
         further_.size() * kNode;
}

}  // namespace terrace::tri
