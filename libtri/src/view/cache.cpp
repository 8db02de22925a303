// SPDX-License-Identifier: Apache-2.0
#include "cache.hpp"

#include <cassert>
#include <string>
#include <utility>

namespace terrace::tri {
namespace {

// Bytes of a cluster's nodes in the list and the table.
constexpr std::size_t kOverhead = sizeof(LoadedCluster) + 64;

std::size_t bytes_held(const LoadedCluster& cluster) {
  return kOverhead + cluster.positions.capacity() * sizeof(Point3) +
         cluster.children.capacity() * sizeof(std::uint64_t) + cluster.values.capacity() +
         cluster.child_records.capacity() * sizeof(ClusterRecord);
}

LoadedCluster load(ClusterSource& source, ClusterId id, const ClusterId* head_child) {
  const unsigned level = level_of(id);
  source.announce({&id, 1});
  const ClusterMembers members = source.read(id);
  LoadedCluster cluster;
  cluster.cluster = id;
  cluster.positions.assign(members.positions.begin(), members.positions.end());
  cluster.children.assign(members.children.begin(), members.children.end());
  cluster.values.assign(members.values.begin(), members.values.end());
  if (level == 0) return cluster;
  if (cluster.children.size() != cluster.positions.size() * level) {
    throw HierarchyError(id, std::to_string(cluster.positions.size()) + " members of level " +
                                 std::to_string(level) + " came with " +
                                 std::to_string(cluster.children.size()) +
                                 " child ordinals; the source is damaged, verify it");
  }
  const std::uint64_t count = source.cluster_count(level - 1);
  cluster.child_records.reserve(cluster.positions.size() + 1);
  for (std::size_t i = 0; i < cluster.positions.size(); ++i) {
    const std::uint64_t ordinal = cluster.children[i * level + level - 1];
    if (ordinal >= count) {
      throw HierarchyError(
          id, "member " + std::to_string(i) + " heads cluster " + std::to_string(ordinal) +
                  " of level " + std::to_string(level - 1) + ", which has " +
                  std::to_string(count) + " clusters; the source is damaged, verify it");
    }
    cluster.child_records.push_back(source.record(cluster_id(level - 1, ordinal)));
  }
  if (head_child) cluster.child_records.push_back(source.record(*head_child));
  return cluster;
}

}  // namespace

LoadedCluster load(ClusterSource& source, const ViewRequest& request) {
  return load(source, request.cluster, &request.head_child);
}

LoadedCluster load_root(ClusterSource& source) {
  return load(source, cluster_id(source.top(), 0), nullptr);
}

double ViewCache::bytes_of(unsigned level, std::uint64_t members) const {
  const double per_member = sizeof(Point3) + level * double{sizeof(std::uint64_t)} +
                            (level > 0 ? sizeof(ClusterRecord) : 0) +
                            static_cast<double>(value_bytes_);
  return static_cast<double>(members) * per_member + sizeof(ClusterRecord) + kOverhead;
}

bool ViewCache::give(LoadedCluster cluster) {
  drop(cluster.cluster);
  cluster.positions.shrink_to_fit();
  cluster.children.shrink_to_fit();
  cluster.child_records.shrink_to_fit();
  cluster.values.shrink_to_fit();
  if (!cluster.positions.empty()) value_bytes_ = cluster.values.size() / cluster.positions.size();
  const std::size_t bytes = bytes_held(cluster);
  if (bytes > max_bytes_) return false;
  while (bytes_ > max_bytes_ - bytes) erase(places_.find(clusters_.front().cluster));
  const ClusterId id = cluster.cluster;
  clusters_.push_back(std::move(cluster));
  places_[id] = std::prev(clusters_.end());
  bytes_ += bytes;
  return true;
}

const LoadedCluster* ViewCache::find(ClusterId cluster, bool use) {
  const auto at = places_.find(cluster);
  if (at == places_.end()) return nullptr;
  if (use) clusters_.splice(clusters_.end(), clusters_, at->second);
  return &*at->second;
}

const LoadedCluster* ViewCache::find(ClusterId cluster) const {
  const auto at = places_.find(cluster);
  return at == places_.end() ? nullptr : &*at->second;
}

void ViewCache::drop(ClusterId cluster) {
  const auto at = places_.find(cluster);
  if (at != places_.end()) erase(at);
}

void ViewCache::erase(std::unordered_map<ClusterId, Places::iterator>::iterator at) {
  bytes_ -= bytes_held(*at->second);
  clusters_.erase(at->second);
  places_.erase(at);
}

ClusterRecord ViewCache::record(ClusterId id) {
  assert(id == expected_);
  static_cast<void>(id);
  return record_;
}

ClusterMembers ViewCache::read(ClusterId id) {
  const auto at = places_.find(id);
  assert(at != places_.end());
  return {at->second->positions, at->second->children, at->second->values};
}

}  // namespace terrace::tri
