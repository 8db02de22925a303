// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace terrace::matching {

/// Points grouped by label: group g is order[begin[g]] .. order[begin[g + 1] - 1], in ascending
/// order of indices. Groups are in ascending order of labels and never empty.
struct LabelGroups {
  std::vector<std::uint32_t> order;
  std::vector<std::uint32_t> begin;

  [[nodiscard]] std::size_t count() const { return begin.size() - 1; }
  [[nodiscard]] std::span<const std::uint32_t> group(std::size_t g) const {
    return std::span(order).subspan(begin[g], begin[g + 1] - begin[g]);
  }
};

/// Groups points by label. Without labels all points form one group.
inline LabelGroups group_by_label(std::uint32_t points, std::span<const std::uint32_t> labels) {
  LabelGroups groups;
  groups.begin.push_back(0);
  groups.order.resize(points);
  if (labels.empty()) {
    std::iota(groups.order.begin(), groups.order.end(), 0u);
    if (points > 0) groups.begin.push_back(points);
    return groups;
  }
  if (*std::max_element(labels.begin(), labels.end()) < points) {
    std::vector<std::uint32_t> place(points + std::size_t{1}, 0);
    for (const std::uint32_t label : labels) ++place[label + std::size_t{1}];
    std::partial_sum(place.begin(), place.end(), place.begin());
    for (std::uint32_t i = 0; i < points; ++i) groups.order[place[labels[i]]++] = i;
  } else {
    std::iota(groups.order.begin(), groups.order.end(), 0u);
    std::stable_sort(groups.order.begin(), groups.order.end(),
                     [&](std::uint32_t i, std::uint32_t j) { return labels[i] < labels[j]; });
  }
  for (std::uint32_t k = 1; k <= points; ++k) {
    if (k == points || labels[groups.order[k]] != labels[groups.order[k - 1]]) {
      groups.begin.push_back(k);
    }
  }
  return groups;
}

}  // namespace terrace::matching
