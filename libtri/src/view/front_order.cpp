// SPDX-License-Identifier: Apache-2.0
// What comes next: of the clusters to expand, and of those to collapse.
#include <algorithm>
#include <cstddef>
#include <limits>

#include "front.hpp"

namespace terrace::tri {
namespace {}  // namespace

bool ViewFront::less_wanted(const Candidate& a, const Candidate& b) {
  if (a.want != b.want) return a.want < b.want;
  if (level_of(a.id) != level_of(b.id)) return level_of(a.id) < level_of(b.id);
  return a.id > b.id;
}

std::optional<ViewFront::Candidate> ViewFront::next() {
  while (!candidates_.empty()) {
    std::pop_heap(candidates_.begin(), candidates_.end(), less_wanted);
    const Candidate candidate = candidates_.back();
    candidates_.pop_back();
    // The cluster above may have been collapsed for want of room, and even come back.
    const auto place = tree_->find(candidate.id);
    if (candidate.id == last_ || !place || *place != candidate.place) continue;
    last_ = candidate.id;
    return candidate;
  }
  return std::nullopt;
}

std::span<const ViewFront::Candidate> ViewFront::soon() {
  std::erase_if(soon_, [&](const Candidate& candidate) {
    const auto place = tree_->find(candidate.id);
    return !place || *place != candidate.place;
  });
  std::sort(soon_.begin(), soon_.end(), [](const Candidate& a, const Candidate& b) {
    if (a.keep != b.keep) return a.keep > b.keep;
    if (level_of(a.id) != level_of(b.id)) return level_of(a.id) > level_of(b.id);
    return a.id < b.id;
  });
  return soon_;
}

double ViewFront::key(Slot slot) const {
  const double keep = own_.keep[slot];
  if (keep > 0.0) return keep;
  return keep < 0.0 ? -std::numeric_limits<double>::infinity() : -1.0 - own_.distance[slot];
}

void ViewFront::sort(double below) {
  if (below <= sorted_below_) return;
  sorted_below_ = below;
  order_.clear();
  collapsed_ = 0;
  for (Slot slot = ClusterTree::kRoot + 1; slot < tree_->slots(); ++slot) {
    if (tree_->live(slot) && key(slot) < below) {
      order_.push_back({key(slot), tree_->id(slot), slot, 0});
    }
  }
  std::sort(order_.begin(), order_.end(), [&](const Ordered& a, const Ordered& b) {
    if (a.key != b.key) return a.key < b.key;
    if (level_of(a.id) != level_of(b.id)) return level_of(a.id) < level_of(b.id);
    if (own_.distance[a.slot] != own_.distance[b.slot]) {
      return own_.distance[a.slot] > own_.distance[b.slot];
    }
    return a.id < b.id;
  });
  std::size_t points = 0;
  for (Ordered& entry : order_) {
    entry.points_before = points;
    points += tree_->size(entry.slot);
  }
  order_.push_back(
      {std::numeric_limits<double>::infinity(), ClusterId{}, ClusterTree::kNoSlot, points});
}

std::size_t ViewFront::points_below(double below) {
  sort(below);
  const auto first = order_.begin() + static_cast<std::ptrdiff_t>(collapsed_);
  const auto end = std::lower_bound(first, order_.end() - 1, below,
                                    [](const Ordered& a, double value) { return a.key < value; });
  return end->points_before - first->points_before;
}

ViewFront::Slot ViewFront::next_to_collapse(double below) {
  sort(below);
  while (collapsed_ + 1 < order_.size() && order_[collapsed_].key < below) {
    const Ordered& entry = order_[collapsed_++];
    // Pins can hold a child of a cluster that is not wanted.
    if (tree_->has_expanded_children(entry.slot)) continue;
    return entry.slot;
  }
  return ClusterTree::kNoSlot;
}

}  // namespace terrace::tri
