// SPDX-License-Identifier: Apache-2.0
#include "tree.hpp"

#include <algorithm>
#include <cassert>
#include <string>

namespace terrace::tri {
namespace {

// One less than 56 bits allow, because the table of clusters uses the last ordinal for "none".
constexpr std::uint64_t kMaxClusters = base::kClusterOrdinalEnd - 1;

}  // namespace

void ClusterSource::announce(std::span<const ClusterId>) {}

ClusterTree::ClusterTree(ClusterSource& source) : source_(&source) {
  const unsigned top = source.top();
  if (top > 255) {
    throw HierarchyError(cluster_id(255, 0), "the source has " + std::to_string(top) +
                                                 " levels; at most 255 are possible");
  }
}

VertexId ClusterTree::head_vertex(Slot slot) const {
  const Cluster& cluster = clusters_[slot];
  return cluster.home == kNoSlot ? kNoVertex : clusters_[cluster.home].vertices[cluster.home_index];
}

VertexId ClusterTree::head_vertex(ChildRef child) const {
  const Cluster& parent = clusters_[child.parent];
  return child.index < parent.size ? parent.vertices[child.index] : head_vertex(child.parent);
}

PointId ClusterTree::head(Slot slot) const {
  const Cluster& cluster = clusters_[slot];
  assert(cluster.home != kNoSlot);
  return {clusters_[cluster.home].id, cluster.home_index};
}

ClusterId ClusterTree::headed_cluster(Slot slot, std::uint32_t member, unsigned level) const {
  const Cluster& cluster = clusters_[slot];
  const std::size_t per_member = level_of(cluster.id);
  assert(level < per_member && member < cluster.size);
  return cluster_id(level, cluster.inner->ordinals[member * per_member + level]);
}

std::optional<ChildRef> ClusterTree::find(ClusterId id) const {
  const ChildRef* place = map_.find(id);
  return place ? std::optional(*place) : std::nullopt;
}

std::uint32_t ClusterTree::child_count(Slot slot) const {
  const Cluster& cluster = clusters_[slot];
  return cluster.inner ? static_cast<std::uint32_t>(cluster.inner->children.size()) : 0;
}

ClusterId ClusterTree::child_id(ChildRef child) const {
  const Cluster& parent = clusters_[child.parent];
  const unsigned level = level_of(parent.id) - 1;
  if (child.index < parent.size) return headed_cluster(child.parent, child.index, level);
  return headed_cluster(parent.home, parent.home_index, level);
}

ClusterId ClusterTree::head_child(ChildRef child) const {
  const Cluster& parent = clusters_[child.parent];
  const unsigned level = level_of(parent.id) - 1;
  assert(level > 0);
  if (child.index < parent.size) return headed_cluster(child.parent, child.index, level - 1);
  return headed_cluster(parent.home, parent.home_index, level - 1);
}

ClusterTree::Slot ClusterTree::child_slot(ChildRef child) const {
  return clusters_[child.parent].inner->children[child.index];
}

const ClusterRecord& ClusterTree::record(ChildRef child) {
  constexpr std::uint64_t kUnknown = ~std::uint64_t{0};
  Inner& inner = *clusters_[child.parent].inner;
  if (inner.records.empty()) {
    ClusterRecord unknown;
    unknown.members = kUnknown;
    inner.records.assign(inner.children.size(), unknown);
  }
  ClusterRecord& cached = inner.records[child.index];
  if (cached.members == kUnknown) {
    const ClusterId id = child_id(child);
    const ClusterRecord record = source_->record(id);
    if (record.members > kMaxMembers) {
      throw HierarchyError(id, "its record claims " + std::to_string(record.members) +
                                   " members, at most " + std::to_string(kMaxMembers) +
                                   " are possible; the source is damaged, verify it");
    }
    cached = record;
  }
  return cached;
}

ClusterTree::Plan ClusterTree::plan(const Judge& judge, const Take& take) {
  Plan result;
  std::vector<Slot> upper_level{kRoot}, current_level;
  struct Wanted {
    ChildRef child;
    bool children_too;
  };
  std::vector<Wanted> wanted;
  std::vector<ClusterId> ids;
  try {
    for (unsigned level = top(); level-- > 0 && !upper_level.empty();
         upper_level.swap(current_level)) {
      current_level.clear();
      wanted.clear();
      ids.clear();
      for (const Slot parent : upper_level) {
        const std::uint32_t count = child_count(parent);
        for (std::uint32_t i = 0; i < count; ++i) {
          const ChildRef child{parent, i};
          const Slot present = child_slot(child);
          const bool expanded = present != kNoSlot;
          const Verdict verdict = judge(child, level, expanded);
          switch (verdict) {
            case Verdict::keep:
              break;
            case Verdict::visit:
              if (expanded) current_level.push_back(present);
              break;
            case Verdict::expand:
            case Verdict::expand_alone:
              if (!expanded) {
                wanted.push_back({child, verdict == Verdict::expand});
                ids.push_back(child_id(child));
              } else if (verdict == Verdict::expand || has_expanded_children(present)) {
                current_level.push_back(present);
              }
              break;
            case Verdict::collapse:
              if (expanded) append_below(present, result.collapsed);
              break;
          }
        }
      }
      if (!ids.empty()) source_->announce(ids);
      for (std::size_t i = 0; i < ids.size(); ++i) {
        // before anything that may throw, as every staged cluster must be listed
        result.staged.push_back(kNoSlot);
        result.staged.back() = stage(ids[i], wanted[i].child, take);
        if (wanted[i].children_too) current_level.push_back(result.staged.back());
      }
    }
  } catch (...) {
    cancel(result);
    throw;
  }
  return result;
}

ClusterTree::Plan ClusterTree::plan_expand(ChildRef child, const Take& take) {
  assert(child_slot(child) == kNoSlot);
  const ClusterId id = child_id(child);
  Plan result;
  result.staged.reserve(1);
  source_->announce({&id, 1});
  result.staged.push_back(stage(id, child, take));
  return result;
}

ClusterTree::Plan ClusterTree::plan_collapse(Slot slot) const {
  Plan result;
  append_below(slot, result.collapsed);
  return result;
}

void ClusterTree::read_root(const Take& take) {
  assert(clusters_.empty());
  const ClusterId id = cluster_id(source_->top(), 0);
  source_->announce({&id, 1});
  static_cast<void>(stage(id, ChildRef{kNoSlot, 0}, take));
}

void ClusterTree::append_below(Slot slot, std::vector<Slot>& out) const {
  const Cluster& cluster = clusters_[slot];
  if (has_expanded_children(slot)) {
    for (const Slot child : cluster.inner->children) {
      if (child != kNoSlot) append_below(child, out);
    }
  }
  out.push_back(slot);
}

// Reads a cluster and adds it to the tree. Does everything that can fail before the first visible
// change.
ClusterTree::Slot ClusterTree::stage(ClusterId id, ChildRef place, const Take& take) {
  const unsigned level = level_of(id);
  const bool is_root = place.parent == kNoSlot;
  const ClusterMembers members = source_->read(id);
  const std::size_t size = members.positions.size();
  if (size > kMaxMembers) {
    throw HierarchyError(id, "it has " + std::to_string(size) + " members, at most " +
                                 std::to_string(kMaxMembers) + " are possible");
  }
  if (!is_root && record(place).members != size) {
    throw HierarchyError(id, "its record claims " + std::to_string(record(place).members) +
                                 " members, " + std::to_string(size) +
                                 " were delivered; the source is damaged, verify it");
  }
  if (members.children.size() != size * level) {
    throw HierarchyError(id, std::to_string(size) + " members of level " + std::to_string(level) +
                                 " came with " + std::to_string(members.children.size()) +
                                 " child ordinals, not " + std::to_string(size * level) +
                                 "; the source is damaged, verify it");
  }

  Cluster cluster;
  cluster.id = id;
  cluster.place = place;
  cluster.size = static_cast<std::uint32_t>(size);
  cluster.live = true;
  cluster.vertices = std::make_unique<VertexId[]>(size);
  if (!is_root) {
    // The head is the parent's own head or a member of the parent.
    const Cluster& parent = clusters_[place.parent];
    const bool shares_head = place.index == parent.size;
    cluster.home = shares_head ? parent.home : place.parent;
    cluster.home_index = shares_head ? parent.home_index : place.index;
  }
  if (level > 0) {
    check_ordinals(id, members.children);
    cluster.inner = std::make_unique<Inner>();
    cluster.inner->ordinals.assign(members.children.begin(), members.children.end());
    cluster.inner->children.assign(size + (is_root ? 0 : 1), kNoSlot);
    map_.reserve(map_.size() + cluster.inner->children.size());
  }
  if (free_.empty()) {
    clusters_.emplace_back();
    free_.reserve(clusters_.capacity());  // so that release() never allocates
    free_.push_back(static_cast<Slot>(clusters_.size() - 1));
  }
  const Slot slot = free_.back();
  take(slot, id, members.positions);

  free_.pop_back();
  clusters_[slot] = std::move(cluster);
  ++live_;
  if (!is_root) {
    Inner& siblings = *clusters_[place.parent].inner;
    siblings.children[place.index] = slot;
    ++siblings.expanded;
  }
  add_children(slot);
  return slot;
}

void ClusterTree::check_ordinals(ClusterId id, std::span<const std::uint64_t> ordinals) const {
  const unsigned level = level_of(id);
  for (unsigned below = 0; below < level; ++below) {
    const std::uint64_t count = std::min(source_->cluster_count(below), kMaxClusters);
    for (std::size_t i = below; i < ordinals.size(); i += level) {
      if (ordinals[i] < count) continue;
      throw HierarchyError(id, "member " + std::to_string(i / level) + " heads " + "cluster " +
                                   std::to_string(ordinals[i]) + " of level " +
                                   std::to_string(below) + ", which has " + std::to_string(count) +
                                   " clusters; the source is damaged, verify it");
    }
  }
}

void ClusterTree::add_children(Slot slot) {
  const std::uint32_t count = child_count(slot);
  for (std::uint32_t i = 0; i < count; ++i) {
    const ClusterId child = child_id({slot, i});
    if (map_.insert(child, {slot, i})) continue;
    const ClusterId id = clusters_[slot].id;
    const ClusterId other = clusters_[map_.find(child)->parent].id;
    drop_children(slot, i);
    clusters_[slot].inner->children.clear();
    release(slot);
    throw HierarchyError(
        id,
        (i < count - 1 || slot == kRoot ? "member " + std::to_string(i) : std::string("its head")) +
            " heads " + to_string(child) + ", which a point of " + to_string(other) +
            " heads as well; the source is damaged, verify it");
  }
}

void ClusterTree::drop_children(Slot slot, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) map_.erase(child_id({slot, i}));
}

void ClusterTree::release(Slot slot) {
  drop_children(slot, child_count(slot));
  Cluster& cluster = clusters_[slot];
  assert(cluster.live && !(cluster.inner && cluster.inner->expanded));
  if (cluster.place.parent != kNoSlot) {
    Inner& siblings = *clusters_[cluster.place.parent].inner;
    siblings.children[cluster.place.index] = kNoSlot;
    --siblings.expanded;
  }
  cluster = Cluster();
  free_.push_back(slot);
  --live_;
}

void ClusterTree::cancel(const Plan& plan) {
  for (std::size_t i = plan.staged.size(); i-- > 0;) {
    if (plan.staged[i] != kNoSlot) release(plan.staged[i]);
  }
}

std::size_t ClusterTree::memory() const {
  std::size_t bytes =
      clusters_.capacity() * sizeof(Cluster) + free_.capacity() * sizeof(Slot) + map_.memory();
  for (const Cluster& cluster : clusters_) {
    bytes += cluster.size * sizeof(VertexId);
    if (!cluster.inner) continue;
    bytes += sizeof(Inner) + cluster.inner->ordinals.capacity() * sizeof(std::uint64_t) +
             cluster.inner->children.capacity() * sizeof(Slot) +
             cluster.inner->records.capacity() * sizeof(ClusterRecord);
  }
  return bytes;
}

}  // namespace terrace::tri
