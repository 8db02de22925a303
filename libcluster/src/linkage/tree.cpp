// SPDX-License-Identifier: Apache-2.0
#include "linkage/tree.hpp"

#include <algorithm>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

namespace terrace::cluster {
namespace {

constexpr unsigned kSharedLevels = 6;  ///< levels whose nodes are split one level after the other

}  // namespace

LinkageTree::LinkageTree(std::span<const Point3> points, std::span<const std::uint32_t> chosen,
                         unsigned threads, const base::StopCheck& check_stop) {
  const std::size_t count = chosen.size();
  while (count > (kLeaf << depth_)) ++depth_;
  boxes_.resize(nodes());
  number_.resize(count);
  for (std::vector<double>& axis : axes_) axis.assign(count + kLeaf, 0.0);
  std::vector<Record> records(count);
  for (std::size_t i = 0; i < count; ++i) records[i] = {points[chosen[i]], chosen[i]};

  const unsigned shared = std::min(kSharedLevels, depth_);
  for (unsigned level = 0; level < shared; ++level) {
    const std::size_t first = std::size_t{1} << level;
    base::parallel_blocks(first, 1, threads, [&](std::size_t q, std::size_t, unsigned) {
      if (check_stop) check_stop();
      split(first + q, level, records);
    });
  }
  const std::size_t first = std::size_t{1} << shared;
  base::parallel_blocks(first, 1, threads, [&](std::size_t q, std::size_t, unsigned) {
    base::StopTicks ticks(check_stop);
    split_all(first + q, shared, records, ticks);
    const std::size_t end = ((q + 1) * count) >> shared;
    for (std::size_t i = (q * count) >> shared; i < end; ++i) {
      for (unsigned a = 0; a < 3; ++a) axes_[a][i] = records[i].p[a];
      number_[i] = records[i].number;
    }
  });
}

/// Sets the box of a node and divides its points among its children, if it has any.
void LinkageTree::split(std::size_t node, unsigned level, std::vector<Record>& records) {
  const std::size_t q = node - (std::size_t{1} << level);
  const std::size_t begin = (q * size()) >> level;
  const std::size_t end = ((q + 1) * size()) >> level;
  Box3 box;
  for (std::size_t i = begin; i < end; ++i) box.include(records[i].p);
  boxes_[node] = box;
  const auto at = [&](std::size_t i) { return records.begin() + static_cast<std::ptrdiff_t>(i); };
  if (level == depth_) {
    // The contents of a leaf do not depend on how the library finds a median, but their order
    // would.
    std::sort(at(begin), at(end),
              [](const Record& x, const Record& y) { return x.number < y.number; });
    return;
  }
  unsigned axis = 0;
  for (unsigned a = 1; a < 3; ++a) {
    if (box.max[a] - box.min[a] > box.max[axis] - box.min[axis]) axis = a;
  }
  const std::size_t middle = ((2 * q + 1) * size()) >> (level + 1);
  std::nth_element(at(begin), at(middle), at(end), [axis](const Record& x, const Record& y) {
    return x.p[axis] < y.p[axis] || (x.p[axis] == y.p[axis] && x.number < y.number);
  });
}

void LinkageTree::split_all(std::size_t node, unsigned level, std::vector<Record>& records,
                            base::StopTicks& ticks) {
  constexpr std::size_t kTicksOfPoint = 8;
  ticks(kTicksOfPoint * (size() >> level));
  split(node, level, records);
  if (level == depth_) return;
  split_all(2 * node, level + 1, records, ticks);
  split_all(2 * node + 1, level + 1, records, ticks);
}

}  // namespace terrace::cluster
