// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "box_tree.hpp"
#include "fast_distances.hpp"
#include "lagrangian.hpp"
#include "parallel_blocks.hpp"

namespace terrace::cluster {

/// L(v) of points, where all facilities cost the same and only the clients near a facility pay for
/// it: those to which it is nearer than what they pay per weight. A leaf of facilities looks for
/// the leaves with such clients together.
///
/// The variables are u * sqrt(w), where u = v / w is the payment per weight: in v the light
/// clients would hardly move, in u the heavy ones.
template <class Space>
class PointDual final : public DualFunction {
 public:
  /// Space and weights are in the order of the tree's leaves. `price`: what a client of weight 1
  /// pays at most, or infinite.
  PointDual(const BoxTree& tree, const Space& space, std::span<const double> weights,
            double facility_cost, double price, unsigned threads)
      : tree_(&tree),
        space_(&space),
        distances_(space),
        weights_(weights),
        facility_cost_(facility_cost),
        price_(price),
        threads_(threads),
        payment_(weights.size()),
        paid_(weights.size()),
        root_(weights.size()),
        longest_(tree.nodes().size()),
        count_(std::make_unique<std::atomic<std::uint32_t>[]>(weights.size())) {
    for (std::size_t i = 0; i < weights.size(); ++i) root_[i] = std::sqrt(weights[i]);
    for (std::uint32_t n = 0; n < tree.nodes().size(); ++n) {
      if (tree.nodes()[n].child_count == 0) leaves_.push_back(n);
    }
  }

  DualValue evaluate(std::span<const double> variables, std::span<double> slope) override {
    const std::size_t n = weights_.size();
    for (std::size_t i = 0; i < n; ++i) {
      payment_[i] = payment(variables[i], i);
      count_[i].store(0, std::memory_order_relaxed);
    }
    read_longest();
    constexpr std::size_t kBlock = 64;  // leaves
    std::atomic<std::size_t> most{0};
    parallel_blocks((leaves_.size() + kBlock - 1) / kBlock, threads_, [&](std::size_t block) {
      Work work;
      std::size_t most_here = 0;
      const std::size_t end = std::min(leaves_.size(), (block + 1) * kBlock);
      for (std::size_t k = block * kBlock; k < end; ++k) {
        most_here = std::max(most_here, visit(leaves_[k], work));
      }
      std::size_t seen = most.load();
      while (seen < most_here && !most.compare_exchange_weak(seen, most_here)) {
      }
    });
    DualSum sum(most);
    for (std::size_t i = 0; i < n; ++i) {
      sum.client(weights_[i] * payment_[i]);
      sum.facility(facility_cost_, paid_[i]);
      slope[i] = root_[i] * (1.0 - count_[i].load(std::memory_order_relaxed));
    }
    return sum.value();
  }

  void clamp(std::span<double> variables) const override {
    for (std::size_t i = 0; i < variables.size(); ++i) {
      variables[i] = std::max(0.0, std::min(variables[i], price_ * root_[i]));
    }
  }

  [[nodiscard]] std::vector<double> variables(std::span<const double> payments) const {
    std::vector<double> result(payments.size());
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = payments[i] * root_[i];
    return result;
  }
  /// v, of the variables.
  [[nodiscard]] std::vector<double> duals(std::span<const double> variables) const {
    std::vector<double> result(variables.size());
    for (std::size_t i = 0; i < result.size(); ++i) {
      result[i] = weights_[i] * payment(variables[i], i);
    }
    return result;
  }

 private:
  // A weight may be too small beside others to be told from 0.
  [[nodiscard]] double payment(double variable, std::size_t i) const {
    return root_[i] > 0.0 ? variable / root_[i] : 0.0;
  }

  struct Work {
    std::vector<std::uint32_t> stack, leaves, near;
  };

  // Children come after their parents.
  void read_longest() {
    const auto& nodes = tree_->nodes();
    for (std::size_t n = nodes.size(); n-- > 0;) {
      const BoxTree::Node& node = nodes[n];
      double longest = 0.0;
      if (node.child_count == 0) {
        for (std::uint32_t i = 0; i < node.count; ++i) {
          longest = std::max(longest, payment_[node.first + i]);
        }
      }
      for (std::uint32_t c = 0; c < node.child_count; ++c) {
        longest = std::max(longest, longest_[node.first_child + c]);
      }
      longest_[n] = longest;
    }
  }

  // Returns the most clients that a facility of the leaf has looked at.
  std::size_t visit(std::uint32_t leaf, Work& work) {
    const auto& nodes = tree_->nodes();
    const std::uint32_t first = nodes[leaf].first, end = first + nodes[leaf].count;
    work.leaves.clear();
    work.stack.assign(1, 0);
    while (!work.stack.empty()) {
      const std::uint32_t n = work.stack.back();
      work.stack.pop_back();
      const bool near = is_near(leaf, n);
      if (!near) continue;
      if (nodes[n].child_count == 0) work.leaves.push_back(n);
      for (std::uint32_t c = 0; c < nodes[n].child_count; ++c) {
        work.stack.push_back(nodes[n].first_child + c);
      }
    }
    std::size_t most = 0;
    for (std::uint32_t j = first; j < end; ++j) most = std::max(most, add_up(j, work));
    return most;
  }

  // Whether some facility of the leaf may be nearer to the node's box than somebody pays there.
  [[nodiscard]] bool is_near(std::uint32_t leaf, std::uint32_t node) const {
    const BoxTree::Node& from = tree_->nodes()[leaf];
    const Bounds& box = tree_->nodes()[node].box;
    if constexpr (std::is_same_v<Space, FieldSpace>) {
      for (std::uint32_t j = from.first; j < from.first + from.count; ++j) {
        if (space_->box_distance(j, box) < longest_[node]) return true;
      }
      return false;
    } else {
      // The distance of two boxes is that of any point of the one from the other grown by what the
      // first extends beside the point.
      const Point3& p = space_->points()[from.first];
      Bounds grown = box;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        grown.min[axis] -= from.box.max[axis] - p[axis];
        grown.max[axis] += p[axis] - from.box.min[axis];
      }
      return space_->box_distance(from.first, grown) < longest_[node];
    }
  }

  // Returns how many clients it has looked at.
  std::size_t add_up(std::uint32_t facility, Work& work) {
    auto from = distances_.from(facility);
    std::size_t looked = 0;
    work.near.clear();
    for (const std::uint32_t n : work.leaves) {
      const BoxTree::Node& node = tree_->nodes()[n];
      if (!(space_->box_distance(facility, node.box) < longest_[n])) continue;
      from.add(node.first, node.count, payment_.data(), weights_.data());
      work.near.push_back(n);
      looked += node.count;
    }
    paid_[facility] = from.sum();
    if (paid_[facility] > facility_cost_) count_payers(facility, work);
    return looked;
  }

  // Few facilities are worth opening: their distances are worked out again.
  void count_payers(std::uint32_t facility, const Work& work) {
    const auto from = space_->from(facility);
    for (const std::uint32_t n : work.near) {
      const BoxTree::Node& node = tree_->nodes()[n];
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        if (payment_[i] > from(i)) count_[i].fetch_add(1, std::memory_order_relaxed);
      }
    }
  }

  const BoxTree* tree_;
  const Space* space_;
  FastDistances<Space> distances_;
  std::span<const double> weights_;
  double facility_cost_, price_;
  unsigned threads_;
  std::vector<double> payment_;  // u
  std::vector<double> paid_;     // by facility
  std::vector<double> root_;     // sqrt(w)
  std::vector<double> longest_;  // by node: the greatest payment in it
  std::vector<std::uint32_t> leaves_;
  std::unique_ptr<std::atomic<std::uint32_t>[]> count_;  // per client: paid facilities it pays for
};

}  // namespace terrace::cluster
