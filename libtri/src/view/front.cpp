// SPDX-License-Identifier: Apache-2.0
#include "front.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace terrace::tri {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

ViewFront::ViewFront(const ClusterTree& tree, const ViewOptions& options,
                     ClusterAlignment* alignment)
    : tree_(&tree),
      options_(&options),
      alignment_(alignment),
      request_above_(std::max(options.ask_above, options.collapse_below)),
      columns_(options.silhouette < 1.0),
      bounds_(options.silhouette < 1.0) {}

void ViewFront::add(Slot slot, std::span<const ClusterRecord> children,
                    const Candidate* candidate) {
  if (slot >= columns_.size()) {
    const std::size_t size = std::max<std::size_t>(slot + 1, columns_.size() * 5 / 4);
    columns_.resize(size);
    demand_.resize(size);
    group_of_.resize(size, kNone);
  }
  const ChildRef place = tree_->place(slot);
  if (slot == ClusterTree::kRoot) {
    constexpr Point3 kLow{-kInfinity, -kInfinity, -kInfinity};
    columns_.set(slot, {{kLow, {kInfinity, kInfinity, kInfinity}}, kInfinity, 0}, tree_->top());
  } else {
    const std::uint32_t parent = group_of_[place.parent];
    columns_.copy(slot, measured(*groups_[parent]), place.index);
    changed_groups_.push_back(parent);
  }
  if (candidate) {
    demand_.want[slot] = candidate->want;
    demand_.keep[slot] = candidate->keep;
    demand_.distance[slot] = candidate->distance;
  }
  assert(children.size() == tree_->child_count(slot));
  if (children.empty()) return;

  if (free_groups_.empty()) {
    free_groups_.push_back(static_cast<std::uint32_t>(groups_.size()));
    groups_.emplace_back();
    bounds_.resize(groups_.size());
    bound_demand_.resize(groups_.size());
  }
  const std::uint32_t number = free_groups_.back();
  free_groups_.pop_back();
  group_of_[slot] = number;
  groups_[number] = std::make_unique<Group>();
  Group& group = *groups_[number];
  group.parent = slot;
  group.columns = ViewColumns(columns_.cones());
  group.columns.resize(children.size());
  if (alignment_ != nullptr) {
    group.aligned = ViewColumns(columns_.cones());
    group.aligned.resize(children.size());
  }
  for (std::uint32_t i = 0; i < children.size(); ++i) {
    group.members.push_back(children[i].members);
    set_columns(group, i, children[i]);
  }
  for (std::uint32_t i = 0; alignment_ != nullptr && i < children.size(); ++i) align(group, i);
  changed_groups_.push_back(number);
  if (candidate) measure_group(number);
}

void ViewFront::drop(Slot slot, ChildRef place) {
  if (collapsed_ < order_.size() && order_[collapsed_].slot == slot) ++collapsed_;
  const std::uint32_t group = group_of_[slot];
  group_of_[slot] = kNone;
  if (group != kNone) {
    groups_[group].reset();
    free_groups_.push_back(group);
  }
  changed_groups_.push_back(group_of_[place.parent]);
  // A cluster that gave way to a more important one may find room again in the same step, just as
  // it would in the next.
  if (demand_.want[slot] > 1.0 && !is_pinned_collapsed(slot)) {
    candidates_.push_back({demand_.want[slot], demand_.keep[slot], demand_.distance[slot], place,
                           tree_->child_id(place), members(place)});
    std::push_heap(candidates_.begin(), candidates_.end(), &ViewFront::less_wanted);
  }
}

ClusterRecord ViewFront::record(ChildRef child) const {
  const Group& group = *groups_[group_of_[child.parent]];
  ClusterRecord record;
  for (std::size_t k = 0; k < 3; ++k) {
    record.box.min[k] = group.columns.column(k)[child.index];
    record.box.max[k] = group.columns.column(k + 3)[child.index];
  }
  record.error = group.columns.error(child.index);
  record.members = group.members[child.index];
  return record;
}

bool ViewFront::meets_collapsed(const Box3& box, const std::function<bool(const Box3&)>& counts,
                                Slot below) const {
  if (group_of_[below] == kNone) return false;
  const ViewColumns& columns = groups_[group_of_[below]]->columns;
  for (std::uint32_t i = 0; i < columns.size(); ++i) {
    bool meets = true;
    for (std::size_t k = 0; k < 3 && meets; ++k) {
      meets = columns.column(k)[i] <= box.max[k] && columns.column(k + 3)[i] >= box.min[k];
    }
    if (!meets || (counts && !counts(record({below, i}).box))) continue;
    const Slot child = tree_->child_slot({below, i});
    if (child == ClusterTree::kNoSlot || meets_collapsed(box, counts, child)) return true;
  }
  return false;
}

bool ViewFront::meets_collapsed(const Box3& box, Slot below) const {
  return meets_collapsed(box, {}, below);
}

void ViewFront::set_record(ChildRef child, const ClusterRecord& record) {
  const std::uint32_t number = group_of_[child.parent];
  Group& group = *groups_[number];
  if (group.members[child.index] != ClusterRecord::kUnread) return;
  group.members[child.index] = record.members;
  set_columns(group, child.index, record);
  if (alignment_ != nullptr) align(group, child.index);
  changed_groups_.push_back(number);
}

void ViewFront::set_columns(Group& group, std::uint32_t i, const ClusterRecord& record) {
  const unsigned level = tree_->level(group.parent) - 1;
  group.columns.set(i, record, level);
  if (alignment_ != nullptr) {
    group.box.include(record.box);
    if (level == 0 && record.members != ClusterRecord::kUnread && alignment_->add(record))
      changed_.include(alignment_->aligned(record, level).box);
  }
  if (!columns_.cones()) return;
  group.columns.set_cone(i, options_->cone
                                ? options_->cone(tree_->child_id({group.parent, i}), record)
                                : terrain_cone(record));
}

void ViewFront::align(Group& group, std::uint32_t i) {
  const ChildRef child{group.parent, i};
  const unsigned level = tree_->level(group.parent) - 1;
  group.aligned.copy(i, group.columns, i);  // with its cone
  group.aligned.set_bounds(i, alignment_->aligned(record(child), level));
  const Slot slot = tree_->child_slot(child);
  if (slot != ClusterTree::kNoSlot) columns_.copy(slot, group.aligned, i);
}

// Aligns the clusters near changed ones again.
void ViewFront::align_near(const Box3& changed) {
  const auto meets = [&](const Box3& box) {
    return box.min[0] <= changed.max[0] && box.max[0] >= changed.min[0] &&
           box.min[1] <= changed.max[1] && box.max[1] >= changed.min[1];
  };
  for (std::uint32_t number = 0; number < groups_.size(); ++number) {
    if (!groups_[number] || !meets(groups_[number]->box)) continue;
    Group& group = *groups_[number];
    for (std::uint32_t i = 0; i < group.columns.size(); ++i) {
      if (meets(record({group.parent, i}).box)) align(group, i);
    }
    changed_groups_.push_back(number);
  }
}

// Computes a box around the collapsed children, and the greatest of their errors.
void ViewFront::compute_bound(std::uint32_t number) {
  const Group& group = *groups_[number];
  ClusterRecord none;
  none.box = {{1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}};
  bounds_.set(number, none, tree_->level(group.parent) - 1);  // never in view
  double error = 0.0;
  for (std::uint32_t i = 0; i < group.columns.size(); ++i) {
    if (tree_->child_slot({group.parent, i}) != ClusterTree::kNoSlot) continue;
    bounds_.join(number, measured(group), i);
    error = std::max(error, measured(group).error(i));
  }
  bounds_.set_error(number, error);
}

void ViewFront::start(const View& view) {
  view_ = &view;
  candidates_.clear();
  is_heap_ = false;
  soon_.clear();
  unread_.clear();
  order_.clear();
  sorted_below_ = -kInfinity;
  collapsed_ = 0;
  last_id_ = ClusterId{~std::uint64_t{0}};
  if (!changed_.empty()) align_near(std::exchange(changed_, {}));
  std::sort(changed_groups_.begin(), changed_groups_.end());
  changed_groups_.erase(std::unique(changed_groups_.begin(), changed_groups_.end()),
                        changed_groups_.end());
  for (const std::uint32_t group : changed_groups_) {
    if (groups_[group]) compute_bound(group);
  }
  changed_groups_.clear();

  measure(view, *options_, columns_, 0, columns_.size(), demand_);
  demand_.want[ClusterTree::kRoot] = demand_.keep[ClusterTree::kRoot] = kInfinity;
  demand_.distance[ClusterTree::kRoot] = 0.0;
  clamp_to_parents();
  measure(view, *options_, bounds_, 0, bounds_.size(), bound_demand_);
  if (!pins_.empty()) apply_pins();
  for (std::uint32_t group = 0; group < groups_.size(); ++group) {
    if (!groups_[group]) continue;
    if (bound_demand_.want[group] > 1.0 || bound_demand_.keep[group] > request_above_) {
      measure_group(group);
    }
  }
  std::make_heap(candidates_.begin(), candidates_.end(), &ViewFront::less_wanted);
  is_heap_ = true;
}

void ViewFront::clamp_to_parents() {
  by_level_.clear();
  for (Slot slot = ClusterTree::kRoot + 1; slot < tree_->slots(); ++slot) {
    if (tree_->live(slot)) by_level_.push_back(slot);
  }
  // There are few levels, so one pass for each is cheaper than sorting.
  for (unsigned level = tree_->top(); level-- > 0;) {
    for (const Slot slot : by_level_) {
      if (tree_->level(slot) != level) continue;
      const Slot parent = tree_->place(slot).parent;
      demand_.want[slot] = std::min(demand_.want[slot], demand_.want[parent]);
      demand_.keep[slot] = std::min(demand_.keep[slot], demand_.keep[parent]);
      demand_.distance[slot] = std::max(demand_.distance[slot], demand_.distance[parent]);
    }
  }
}

void ViewFront::apply_pins() {
  for (const auto& [id, state] : pins_) {
    const auto place = tree_->find(id);
    if (!place || state != Pin::expanded) continue;
    Slot slot = tree_->child_slot(*place);
    if (slot == ClusterTree::kNoSlot) bound_demand_.want[group_of_[place->parent]] = kInfinity;
    if (slot == ClusterTree::kNoSlot) slot = place->parent;
    for (; slot != ClusterTree::kRoot; slot = tree_->place(slot).parent) {
      demand_.keep[slot] = kInfinity;
    }
  }
  for (const auto& [id, state] : pins_) {
    const auto place = tree_->find(id);
    if (!place || state != Pin::collapsed) continue;
    const Slot slot = tree_->child_slot(*place);
    if (slot == ClusterTree::kNoSlot) continue;
    for (const Slot below : tree_->plan_collapse(slot).collapsed)
      demand_.keep[below] = kPinnedCollapsed;
  }
}

void ViewFront::measure_group(std::uint32_t number) {
  const Group& group = *groups_[number];
  if (is_pinned_collapsed(group.parent)) return;
  const std::size_t count = group.columns.size();
  scratch_.resize(std::max(count, scratch_.want.size()));
  measure(*view_, *options_, measured(group), 0, count, scratch_);
  const double max_want = demand_.want[group.parent],
               least_distance = demand_.distance[group.parent];
  const double max_keep = demand_.keep[group.parent];
  for (std::size_t i = 0; i < count; ++i) {
    scratch_.want[i] = std::min(scratch_.want[i], max_want);
    scratch_.keep[i] = std::min(scratch_.keep[i], max_keep);
    scratch_.distance[i] = std::max(scratch_.distance[i], least_distance);
  }
  if (!pins_.empty()) override_by_pins(number);
  for (std::uint32_t i = 0; i < count; ++i) {
    const bool wanted = scratch_.want[i] > 1.0;
    if (!wanted && !(scratch_.keep[i] > request_above_)) continue;
    const ChildRef place{group.parent, i};
    if (tree_->child_slot(place) != ClusterTree::kNoSlot) continue;
    if (group.members[i] == ClusterRecord::kUnread) {
      // In space errors would shrink less, but only the order depends on this estimate.
      const double estimate = scratch_.keep[i] / std::sqrt(static_cast<double>(count));
      unread_.push_back({0.0, estimate, 0.0, place, tree_->child_id(place), 0});
      continue;
    }
    std::vector<Candidate>& list = wanted ? candidates_ : soon_;
    list.push_back({scratch_.want[i], scratch_.keep[i], scratch_.distance[i], place,
                    tree_->child_id(place), group.members[i]});
    if (!wanted || !is_heap_) continue;
    std::push_heap(candidates_.begin(), candidates_.end(), &ViewFront::less_wanted);
  }
}

void ViewFront::override_by_pins(std::uint32_t number) {
  const Group& group = *groups_[number];
  for (const auto& [id, state] : pins_) {
    const auto place = tree_->find(id);
    if (!place || place->parent != group.parent) continue;
    const bool expand = state == Pin::expanded;
    scratch_.want[place->index] = scratch_.keep[place->index] = expand ? kInfinity : 0.0;
  }
}

double ViewFront::keep(ChildRef child) {
  const Group& group = *groups_[group_of_[child.parent]];
  scratch_.resize(std::max(group.columns.size(), scratch_.want.size()));
  measure(*view_, *options_, measured(group), child.index, child.index + 1, scratch_);
  return std::min(scratch_.keep[child.index], demand_.keep[child.parent]);
}

std::size_t ViewFront::memory() const {
  std::size_t bytes =
      columns_.memory() + bounds_.memory() + group_of_.capacity() * sizeof(std::uint32_t) +
      (candidates_.capacity() + soon_.capacity() + unread_.capacity()) * sizeof(Candidate) +
      order_.capacity() * sizeof(Ordered) + by_level_.capacity() * sizeof(Slot);
  for (const ViewDemand* demand : {&demand_, &bound_demand_, &scratch_}) {
    bytes += 3 * demand->want.capacity() * sizeof(double);
  }
  for (const auto& group : groups_) {
    if (!group) continue;
    bytes += sizeof(Group) + group->columns.memory() + group->aligned.memory() +
             group->members.capacity() * sizeof(std::uint64_t);
  }
  return bytes;
}

// ---- The next cluster to expand or collapse -----------------------------------------------------

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
    // The cluster above may have been collapsed for lack of room, and even expanded again.
    const auto place = tree_->find(candidate.id);
    if (candidate.id == last_id_ || !place || *place != candidate.place) continue;
    last_id_ = candidate.id;
    return candidate;
  }
  return std::nullopt;
}

// Returns the first `most` candidates by keep, the coarsest first on ties, that still exist.
std::span<const ViewFront::Candidate> ViewFront::first_of(std::vector<Candidate>& list,
                                                          std::size_t most) {
  const auto precedes = [](const Candidate& a, const Candidate& b) {
    if (a.keep != b.keep) return a.keep > b.keep;
    if (level_of(a.id) != level_of(b.id)) return level_of(a.id) > level_of(b.id);
    return a.id < b.id;
  };
  if (list.size() > most) {
    const auto end = list.begin() + static_cast<std::ptrdiff_t>(most);
    std::nth_element(list.begin(), end, list.end(), precedes);
    list.erase(end, list.end());
  }
  std::erase_if(list, [&](const Candidate& candidate) {
    const auto place = tree_->find(candidate.id);
    return !place || *place != candidate.place;
  });
  std::sort(list.begin(), list.end(), precedes);
  return list;
}

double ViewFront::key(Slot slot) const {
  const double keep = demand_.keep[slot];
  if (keep > 0.0) return keep;
  return keep < 0.0 ? -kInfinity : -1.0 - demand_.distance[slot];
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
    if (demand_.distance[a.slot] != demand_.distance[b.slot]) {
      return demand_.distance[a.slot] > demand_.distance[b.slot];
    }
    return a.id < b.id;
  });
  std::size_t points = 0;
  for (Ordered& entry : order_) {
    entry.points_before = points;
    points += tree_->size(entry.slot);
  }
  order_.push_back({kInfinity, ClusterId{}, ClusterTree::kNoSlot, points});
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
    // Pins can keep a child of an unwanted cluster expanded.
    const Slot slot = order_[collapsed_].slot;
    if (!tree_->has_expanded_children(slot)) return slot;
    ++collapsed_;
  }
  return ClusterTree::kNoSlot;
}

}  // namespace terrace::tri
