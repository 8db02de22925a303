// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

#include "facility/bounds/lagrangian.hpp"
#include "facility/bounds/matrix_dual.hpp"
#include "facility/points/client_tree.hpp"
#include "facility/points/fast_distances.hpp"
#include "facility/points/point_space.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

/// L(v) of points. All facilities cost the same, and a client pays for a facility only if it is
/// closer than the client's payment per weight. The facilities of a leaf search together for the
/// leaves that contain such clients.
///
/// The variables are u * sqrt(w), where u = v / w is the payment per weight. If the variables were
/// v, light clients would hardly move; if they were u, heavy clients would not.
template <class Space>
class PointDual final : public DualFunction {
 public:
  /// Space and weights must be in the order of the tree's leaves. `price` is an upper bound of what
  /// a client of weight 1 pays, and may be infinite.
  PointDual(const ClientTree& tree, const Space& space, std::span<const double> weights,
            double facility_cost, double price, const LowerBoundOptions& options)
      : tree_(&tree),
        space_(&space),
        distances_(space),
        weights_(weights),
        facility_cost_(facility_cost),
        price_(price),
        threads_(options.threads),
        check_stop_(&options.check_stop),
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
    constexpr std::size_t kBlock = 64;  // leaves per block
    std::atomic<std::size_t> most{0};
    base::parallel_for((leaves_.size() + kBlock - 1) / kBlock, threads_, [&](std::size_t block) {
      Work work;
      std::size_t block_max = 0;
      const std::size_t end = std::min(leaves_.size(), (block + 1) * kBlock);
      for (std::size_t k = block * kBlock; k < end; ++k) {
        if (*check_stop_) (*check_stop_)();
        block_max = std::max(block_max, visit(leaves_[k], work));
      }
      std::size_t seen = most.load();
      while (seen < block_max && !most.compare_exchange_weak(seen, block_max)) {
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
  /// Converts variables to the duals v.
  [[nodiscard]] std::vector<double> duals(std::span<const double> variables) const {
    std::vector<double> result(variables.size());
    for (std::size_t i = 0; i < result.size(); ++i) {
      result[i] = weights_[i] * payment(variables[i], i);
    }
    return result;
  }

 private:
  // A weight may underflow compared with others.
  [[nodiscard]] double payment(double variable, std::size_t i) const {
    return root_[i] > 0.0 ? variable / root_[i] : 0.0;
  }

  struct Work {
    std::vector<std::uint32_t> stack, leaves, near;
  };

  // Goes backwards, because children come after their parents.
  void read_longest() {
    const auto& nodes = tree_->nodes();
    for (std::size_t n = nodes.size(); n-- > 0;) {
      const ClientTree::Node& node = nodes[n];
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

  // Returns the largest number of clients that a facility of the leaf has examined.
  std::size_t visit(std::uint32_t leaf, Work& work) {
    const auto& nodes = tree_->nodes();
    const std::uint32_t first = nodes[leaf].first, end = first + nodes[leaf].count;
    work.leaves.clear();
    work.stack.assign(1, 0);
    while (!work.stack.empty()) {
      const std::uint32_t n = work.stack.back();
      work.stack.pop_back();
      const bool near = may_pay(leaf, n);
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

  // Returns whether a client of the node may pay for a facility of the leaf: whether the distance
  // of their boxes is below a payment in the node.
  [[nodiscard]] bool may_pay(std::uint32_t leaf, std::uint32_t node) const {
    const ClientTree::Node& facilities = tree_->nodes()[leaf];
    const Box3& box = tree_->nodes()[node].box;
    if constexpr (std::is_same_v<Space, FieldSpace>) {
      for (std::uint32_t j = facilities.first; j < facilities.first + facilities.count; ++j) {
        if (space_->box_distance(j, box) < longest_[node]) return true;
      }
      return false;
    } else {
      // The distance of two boxes is the distance of any point of the first from the second,
      // enlarged by the extent of the first around that point.
      const Point3& p = space_->points()[facilities.first];
      Box3 grown = box;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        grown.min[axis] -= facilities.box.max[axis] - p[axis];
        grown.max[axis] += p[axis] - facilities.box.min[axis];
      }
      return space_->box_distance(facilities.first, grown) < longest_[node];
    }
  }

  // Returns the number of clients examined.
  std::size_t add_up(std::uint32_t facility, Work& work) {
    auto row = distances_.row(facility);
    std::size_t looked = 0;
    work.near.clear();
    for (const std::uint32_t n : work.leaves) {
      const ClientTree::Node& node = tree_->nodes()[n];
      if (!(space_->box_distance(facility, node.box) < longest_[n])) continue;
      row.add(node.first, node.count, payment_.data(), weights_.data());
      work.near.push_back(n);
      looked += node.count;
    }
    paid_[facility] = row.sum();
    if (paid_[facility] > facility_cost_) count_payers(facility, work);
    return looked;
  }

  // Few facilities are worth opening, so their distances are simply recomputed.
  void count_payers(std::uint32_t facility, const Work& work) {
    const auto row = space_->row(facility);
    for (const std::uint32_t n : work.near) {
      const ClientTree::Node& node = tree_->nodes()[n];
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        if (payment_[i] > row(i)) count_[i].fetch_add(1, std::memory_order_relaxed);
      }
    }
  }

  const ClientTree* tree_;
  const Space* space_;
  FastDistances<Space> distances_;
  std::span<const double> weights_;
  double facility_cost_, price_;
  unsigned threads_;
  const base::StopCheck* check_stop_;
  std::vector<double> payment_;  // u
  std::vector<double> paid_;     // by facility: what clients pay
  std::vector<double> root_;     // sqrt(w)
  std::vector<double> longest_;  // by node: the greatest payment in it
  std::vector<std::uint32_t> leaves_;
  // per client: number of paid facilities for which it pays
  std::unique_ptr<std::atomic<std::uint32_t>[]> count_;
};

void check_start(const FacilitySolution& start, std::size_t count, double outlier_price,
                 const std::string& what) {
  if (start.assignment.size() != count) {
    throw std::invalid_argument("the solution assigns " + std::to_string(start.assignment.size()) +
                                " " + what + ", but there are " + std::to_string(count));
  }
  for (const std::uint32_t j : start.facilities) {
    if (j < count) continue;
    throw std::invalid_argument("the solution has facility " + std::to_string(j) +
                                ", but there are only " + std::to_string(count) + " " + what);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t c = start.assignment[i];
    if (c < start.facilities.size()) continue;
    if (c == kOutlier && outlier_price < std::numeric_limits<double>::infinity()) continue;
    throw std::invalid_argument("the solution leaves client " + std::to_string(i) +
                                " without a facility");
  }
}

// The solution from which the bound starts, with its distances.
struct Start {
  std::vector<std::uint32_t> facility;  // per client
  std::vector<double> distance;         // per client, at most the price
  double cost = 0.0;

  template <class Space>
  Start(const Space& space, const FacilitySolution& start, const std::vector<std::uint32_t>& order,
        const SearchFrame& frame)
      : facility(order.size(), kOutlier), distance(order.size(), frame.outlier_price) {
    std::vector<std::uint32_t> place(order.size());
    for (std::uint32_t k = 0; k < order.size(); ++k) place[order[k]] = k;
    for (std::uint32_t k = 0; k < order.size(); ++k) {
      const std::uint32_t c = start.assignment[order[k]];
      if (c == kOutlier) continue;
      facility[k] = place[start.facilities[c]];
      distance[k] = std::min(distance[k], space.row(facility[k])(k));
    }
    cost = frame.facility_cost * static_cast<double>(start.facilities.size());
    for (std::size_t k = 0; k < order.size(); ++k) cost += frame.weights[k] * distance[k];
  }

  // Returns payments per weight. The clients of a cluster pay a common level, or their distance if
  // that is greater, and at most the price. The level is so high that the cluster pays for its
  // facility.
  [[nodiscard]] std::vector<double> payments(const SearchFrame& frame) const {
    const std::size_t n = facility.size();
    std::vector<std::uint32_t> clients(n);
    std::iota(clients.begin(), clients.end(), 0u);
    std::sort(clients.begin(), clients.end(), [&](std::uint32_t a, std::uint32_t b) {
      if (facility[a] != facility[b]) return facility[a] < facility[b];
      return distance[a] < distance[b] || (distance[a] == distance[b] && a < b);
    });
    std::vector<double> result = distance;
    for (std::size_t begin = 0, end = 0; begin < n; begin = end) {
      double weight = 0.0, sum = frame.facility_cost, level = 0.0;
      for (; end < n && facility[clients[end]] == facility[clients[begin]]; ++end) {
        const std::uint32_t i = clients[end];
        if (weight > 0.0 && distance[i] >= level) continue;
        weight += frame.weights[i];
        sum += frame.weights[i] * distance[i];
        if (weight > 0.0) level = sum / weight;
      }
      for (std::size_t k = begin; k < end; ++k) {
        double& payment = result[clients[k]];
        payment = std::min(std::max(payment, level), frame.outlier_price);
      }
    }
    return result;
  }
};

void permute(SearchFrame& frame, const std::vector<std::uint32_t>& order) {
  const SearchFrame old = frame;
  const std::size_t channels = frame.channel_count;
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (!old.points.empty()) frame.points[k] = old.points[order[k]];
    frame.weights[k] = old.weights[order[k]];
    for (std::size_t c = 0; c < channels; ++c) {
      frame.channels[k * channels + c] = old.channels[order[k] * channels + c];
    }
  }
}

// Replaces the duals, given as payments per weight, by the best ones found. Returns L there.
template <class Space>
double ascend_from(const Start& start, const Space& space, const SearchFrame& frame,
                   const ClientTree* tree, const LowerBoundOptions& options,
                   std::vector<double>& duals) {
  duals = start.payments(frame);
  if constexpr (Space::kHasBoxes) {
    PointDual<Space> function(*tree, space, frame.weights, frame.facility_cost, frame.outlier_price,
                              options);
    std::vector<double> variables = function.variables(duals);
    const double best = ascend(function, variables, start.cost, options);
    duals = function.duals(variables);
    return best;
  } else {
    const PointRows<Space> rows(space, frame.weights, frame.outlier_price, options.check_stop);
    const std::vector<double> opening(duals.size(), frame.facility_cost);
    std::vector<double> ceiling;
    if (std::isfinite(frame.outlier_price)) {
      for (const double w : frame.weights) ceiling.push_back(w * frame.outlier_price);
    }
    for (std::size_t i = 0; i < duals.size(); ++i) duals[i] *= frame.weights[i];
    RowDual function(rows, opening, ceiling, options.threads);
    return ascend(function, duals, start.cost, options);
  }
}

LowerBound make_bound(double value, const std::vector<double>& duals,
                      const std::vector<std::uint32_t>& order, int exponent) {
  LowerBound bound;
  bound.lower_bound = std::ldexp(std::max(0.0, value), exponent);
  bound.duals.resize(duals.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    bound.duals[order[k]] = std::ldexp(duals[k], exponent);
  }
  return bound;
}

}  // namespace

LowerBound lower_bound(const FacilityPoints& problem, const FacilitySolution& start,
                       const LowerBoundOptions& options) {
  check(problem);
  check_start(start, problem.points.size(), problem.outlier_price, "points");
  SearchFrame frame = make_frame(problem);
  std::vector<std::uint32_t> order(problem.points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<Point3> original(problem.points.begin(), problem.points.end());
  std::optional<ClientTree> tree;
  if (!frame.points.empty()) {
    tree.emplace(ClientTree::Kind::kd_tree, frame.points);
    order = tree->order();
    permute(frame, order);
    for (std::size_t k = 0; k < order.size(); ++k) original[k] = problem.points[order[k]];
  }
  const double rounding = rounding_of_frame(problem, frame);
  std::vector<double> duals;
  const double value = visit_space(problem, frame, original, [&](const auto& space) {
    const Start first(space, start, order, frame);
    return ascend_from(first, space, frame, tree ? &*tree : nullptr, options, duals);
  });
  return make_bound(value - rounding, duals, order, frame.cost_exponent);
}

LowerBound lower_bound(const FacilityEntities& problem, const FacilitySolution& start,
                       const LowerBoundOptions& options) {
  check(problem);
  check_start(start, problem.count, problem.outlier_price, "entities");
  const SearchFrame frame = make_frame(problem);
  std::vector<std::uint32_t> order(problem.count);
  std::iota(order.begin(), order.end(), 0u);
  const IndexSpace space = space_of(problem);
  const Start first(space, start, order, frame);
  std::vector<double> duals;
  const double value = ascend_from(first, space, frame, nullptr, options, duals);
  return make_bound(value, duals, order, frame.cost_exponent);
}

}  // namespace terrace::cluster
