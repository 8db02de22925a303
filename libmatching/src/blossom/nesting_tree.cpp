// SPDX-License-Identifier: Apache-2.0
#include "blossom/nesting_tree.hpp"

namespace terrace::matching::blossom {

NestingTree::NestingTree(const Solver& solver) {
  const std::uint32_t count = solver.node_count(), n = solver.vertex_count();
  begin_.assign(count + std::size_t{2}, 0);
  const auto slot = [&](std::uint32_t node) {
    const std::uint32_t parent = solver.parent(node);
    return std::size_t{parent == kNone ? count : parent};
  };
  for (std::uint32_t x = 0; x < count; ++x) {
    if (solver.in_use(x)) ++begin_[slot(x) + 1];
  }
  for (std::size_t k = 1; k < begin_.size(); ++k) begin_[k] += begin_[k - 1];
  children_.resize(begin_.back());
  std::vector<std::uint32_t> fill(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t x = 0; x < count; ++x) {
    if (solver.in_use(x)) children_[fill[slot(x)]++] = x;
  }
  // Depth first. A blossom is visited twice: before its parts, where its range begins, and after
  // them.
  ranges_.assign(count, {});
  std::vector<std::uint32_t> open;
  for (const std::uint32_t top : children_of(kNone)) {
    open.push_back(top);
    while (!open.empty()) {
      const std::uint32_t x = open.back();
      const auto position = static_cast<std::uint32_t>(order_.size());
      if (x < n) {
        ranges_[x] = {position, position + 1};
        order_.push_back(x);
        open.pop_back();
      } else if (ranges_[x].end == kNone) {
        ranges_[x].end = position;
        open.pop_back();
      } else {
        ranges_[x] = {position, kNone};
        for (const std::uint32_t child : children_of(x)) open.push_back(child);
      }
    }
  }
}

}  // namespace terrace::matching::blossom
