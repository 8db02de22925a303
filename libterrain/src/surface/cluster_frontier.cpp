// SPDX-License-Identifier: Apache-2.0
#include "surface/cluster_frontier.hpp"

namespace terrace::terrain {
namespace {

/// Adjacent windows share clusters of level 0 at their borders.
constexpr std::uint64_t kCacheBytes = std::uint64_t{2} << 20;

}  // namespace

ClusterFrontier::ClusterFrontier(const stream::Store& store, const WantedClusters& wanted)
    : reader_(store, kCacheBytes),
      root_(store.root()),
      wanted_(wanted),
      skips_none_(store.condition() != nullptr) {}

void ClusterFrontier::begin(const Take& take) {
  entries_.clear();
  open_.clear();
  const stream::StoreQuery::Node& root = reader_.node(root_);
  take(root);
  add_below(root);
}

bool ClusterFrontier::settle(Open& open) const {
  while (true) {
    open.box = entries_[open.entry].box;
    if (open.box.min != open.box.max || skips_none_) return true;
    if (open.level == open.lowest) return false;
    --open.level;
    --open.entry;
  }
}

void ClusterFrontier::add_below(const stream::StoreQuery::Node& node) {
  const unsigned at = node.level();
  for (std::size_t i = 0; i < node.heads(); ++i) {
    unsigned lowest = at;
    while (lowest > wanted_.finest() && wanted_(lowest - 1, node.branch(i, lowest - 1).box)) {
      --lowest;
    }
    if (lowest == at) continue;
    for (unsigned below = lowest; below < at; ++below) {
      const stream::StoreQuery::Branch& branch = node.branch(i, below);
      entries_.push_back({flat(branch.box), branch.ordinal});
    }
    Open next{{},
              static_cast<std::uint32_t>(entries_.size() - 1),
              static_cast<std::uint8_t>(at - 1),
              static_cast<std::uint8_t>(lowest)};
    if (settle(next)) open_.push_back(next);
  }
}

void ClusterFrontier::read_one(std::size_t at, const Take& take) {
  const Open open = open_[at];
  const stream::StoreQuery::Node& node =
      reader_.node(stream::cluster_id(open.level, entries_[open.entry].ordinal));
  take(node);
  add_below(node);
  Open next{{}, open.entry - 1, static_cast<std::uint8_t>(open.level - 1), open.lowest};
  if (open.level > open.lowest && settle(next)) {
    open_[at] = next;
  } else {
    open_[at] = open_.back();
    open_.pop_back();
  }
}

void ClusterFrontier::read_meeting(const StoredBox& box, const Take& take) {
  for (std::size_t at = 0; at < open_.size();) {
    if (open_[at].box.intersects(box)) {
      read_one(at, take);  // the entry that replaced it is next
    } else {
      ++at;
    }
  }
}

void ClusterFrontier::read(std::span<const std::uint32_t> chosen, const Take& take) {
  // In reverse, so that an entry that moves into a gap is not a chosen one.
  for (std::size_t k = chosen.size(); k-- > 0;) read_one(chosen[k], take);
}

}  // namespace terrace::terrain
