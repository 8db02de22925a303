// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <terrace/base/random.hpp>
#include <terrace/base/stop_check.hpp>

#include "facility/points/client_tree.hpp"
#include "facility/points/search_engine.hpp"
#include "facility/points/search_space.hpp"
#include "facility/points/search_state.hpp"

namespace terrace::cluster {

/// The local search over one of the spaces of search_space.hpp.
template <class Space>
class SpaceSearch final : public SearchEngine {
 public:
  /// strategy: one that the space admits, not automatic.
  SpaceSearch(SearchFrame& frame, Space space, FacilityStrategy strategy, unsigned threads,
              const base::StopCheck& check_stop)
      : SearchEngine(frame, strategy, threads, check_stop), space_(std::move(space)) {
    if constexpr (Space::kHasBoxes) {
      if (strategy == FacilityStrategy::quadtree)
        tree_.emplace(ClientTree::Kind::quadtree, points());
      if (strategy == FacilityStrategy::octree) tree_.emplace(ClientTree::Kind::octree, points());
      if (strategy == FacilityStrategy::kd_tree) tree_.emplace(ClientTree::Kind::kd_tree, points());
    }
    std::vector<std::uint32_t> facility(state_.size(), 0);
    std::vector<double> distances(state_.size());
    const auto row = space_.row(0);
    for (std::uint32_t i = 0; i < state_.size(); ++i) {
      distances[i] = i == 0 ? 0.0 : row(i);
      if (distances[i] > state_.outlier_price()) {
        distances[i] = state_.outlier_price();
        facility[i] = kOutlier;
      }
    }
    replace(std::move(facility), std::move(distances));
  }

  using SearchEngine::start;
  void start(std::mt19937_64& random) override {
    const auto count = static_cast<std::uint32_t>(state_.size());
    const double price = state_.outlier_price();
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    for (std::uint32_t i = count; i > 1; --i) {
      std::swap(order[i - 1], order[base::draw_below(i, random)]);
    }
    std::vector<std::uint32_t> facility(count), open;
    std::vector<double> distances(count);
    base::StopTicks ticks(check_stop_);
    for (const std::uint32_t i : order) {
      ticks(8 + 2 * open.size());
      std::uint32_t nearest = kOutlier;
      double least = std::numeric_limits<double>::infinity();
      for (const std::uint32_t j : open) {
        const double d = space_.row(j).order(i);
        if (d < least) {
          least = d;
          nearest = j;
        }
      }
      least = Space::from_order(least);
      if (least > price) {
        least = price;
        nearest = kOutlier;
      }
      if (open.empty() ||
          base::draw_unit(random) * state_.facility_cost() < state_.weight(i) * least) {
        open.push_back(i);
        nearest = i;
        least = 0.0;
      }
      facility[i] = nearest;
      distances[i] = least;
    }
    replace(std::move(facility), std::move(distances));
  }

  void assign_nearest() override {
    std::vector<std::uint32_t> facility(state_.size());
    for (std::uint32_t i = 0; i < state_.size(); ++i) facility[i] = state_.facility(i);
    std::vector<double> distances = state_.distances();
    find_nearest(facility, distances);
    replace(std::move(facility), std::move(distances));
  }

  [[nodiscard]] std::size_t wrongly_assigned() const override {
    std::vector<std::uint32_t> facility(state_.size(), 0);
    std::vector<double> distances = state_.distances();
    find_nearest(facility, distances);
    std::size_t wrong = 0;
    for (std::uint32_t i = 0; i < state_.size(); ++i) {
      wrong += distances[i] < state_.distance(i) ? 1u : 0u;
    }
    return wrong;
  }

 private:
  using Row = typename Space::Row;

  [[nodiscard]] auto points() const { return space_.points(); }

  // Finds open facilities that are nearer than `distances`. A facility remains its own client, at
  // distance 0.
  void find_nearest(std::vector<std::uint32_t>& facility, std::vector<double>& distances) const {
    base::StopTicks ticks(check_stop_);
    for (const std::uint32_t j : state_.open()) {
      ticks(2 * state_.size());
      const Row row = space_.row(j);
      for (std::uint32_t i = 0; i < state_.size(); ++i) {
        const double d = row(i);
        if (d < distances[i]) {
          distances[i] = d;
          facility[i] = j;
        }
      }
    }
  }

  [[nodiscard]] double distance(std::uint32_t facility, std::uint32_t client) const override {
    return space_.row(facility)(client);
  }

  void connections_replaced() override {
    if (tree_) tree_->set(state_.distances());
  }

  void apply(const Move& move) override {
    state_.apply(move, space_.row(move.candidate), changed_);
    if (tree_) tree_->update(changed_, state_.distances());
  }

  void evaluate(std::uint32_t candidate, bool parallel, Move& move) override;

  // Each of these functions appends some terms to a move.
  void scan_all(std::uint32_t candidate, const Row& row, Move& move);
  void scan_tree(std::uint32_t candidate, const Row& row, Move& move) const;
  void scan_outliers(const Row& row, Move& move) const;
  void scan_facilities(std::uint32_t candidate, const Row& row, std::size_t begin, std::size_t end,
                       Move& move) const;
  void inspect(std::uint32_t facility, const Row& row, bool reassigns, Move& move) const;
  void add_reassignment(std::uint32_t client, double d, Move& move) const {
    const std::uint64_t facility = state_.facility(client);
    move.reassigned.push_back(
        {facility << 32 | client, state_.weight(client) * (state_.distance(client) - d)});
  }
  // Returns the loss of a client whose facility closes and which the candidate does not attract.
  [[nodiscard]] double loss(std::uint32_t client, double d) const {
    return state_.weight(client) * (std::min(d, state_.outlier_price()) - state_.distance(client));
  }

  Space space_;
  std::optional<ClientTree> tree_;
  std::vector<std::uint32_t> changed_;  // clients changed by the last move
  std::vector<Move> parts_;             // parts of a move, for the threads
};

// The gain under each strategy.

template <class Space>
void SpaceSearch<Space>::evaluate(std::uint32_t candidate, bool parallel, Move& move) {
  move.clear();
  move.candidate = candidate;
  const Row row = space_.row(candidate);
  const std::size_t open = state_.open().size();
  const bool use_threads = parallel && team_.threads() > 1 && open > 1;
  if (!use_threads) {
    if (strategy_ == FacilityStrategy::full_scan) {
      scan_all(candidate, row, move);
    } else {
      if (tree_) {
        scan_tree(candidate, row, move);
      } else {
        scan_outliers(row, move);
      }
      scan_facilities(candidate, row, 0, open, move);
    }
  } else {
    // There are a few parts per thread, because clusters differ in size. The last part is the tree
    // of clients or the outliers.
    const std::size_t part_count = std::min<std::size_t>(open, 4 * team_.threads());
    parts_.resize(part_count + 1);
    team_.run(part_count + 1, [&](std::size_t part_number) {
      Move& part = parts_[part_number == 0 ? part_count : part_number - 1];
      part.clear();
      if (part_number > 0) {
        scan_facilities(candidate, row, (part_number - 1) * open / part_count,
                        part_number * open / part_count, part);
      } else if (tree_) {
        scan_tree(candidate, row, part);
      } else {
        scan_outliers(row, part);
      }
    });
    for (const Move& part : parts_) {
      move.reassigned.insert(move.reassigned.end(), part.reassigned.begin(), part.reassigned.end());
      move.closings.insert(move.closings.end(), part.closings.begin(), part.closings.end());
      move.inspected += part.inspected;
    }
  }
  const auto by_key = [](const Move::Reassignment& a, const Move::Reassignment& b) {
    return a.key < b.key;
  };
  if (!std::is_sorted(move.reassigned.begin(), move.reassigned.end(), by_key)) {
    std::sort(move.reassigned.begin(), move.reassigned.end(), by_key);
  }
  state_.sum(move);
}

// Examines every client, as in the literature. The reference for the other strategies.
template <class Space>
void SpaceSearch<Space>::scan_all(std::uint32_t candidate, const Row& row, Move& move) {
  std::vector<double>& losses = move.losses;
  losses.assign(state_.slot_count(), 0.0);
  for (std::uint32_t i = 0; i < state_.size(); ++i) {
    const double d = row(i);
    if (d < state_.distance(i)) {
      add_reassignment(i, d, move);
    } else if (state_.facility(i) != kOutlier) {
      losses[state_.slot(state_.facility(i))] += loss(i, d);
    }
  }
  for (const std::uint32_t j : state_.open()) {
    const double saving = state_.facility_cost() - losses[state_.slot(j)];
    if (saving > 0.0 && j != candidate) move.closings.push_back({j, saving});
  }
  move.inspected += state_.size();
}

// Examines clients that may be nearer to the candidate than to their facility.
template <class Space>
void SpaceSearch<Space>::scan_tree(std::uint32_t candidate, const Row& row, Move& move) const {
  if constexpr (Space::kHasBoxes) {
    const std::vector<ClientTree::Node>& nodes = tree_->nodes();
    std::vector<std::uint32_t>& stack = move.stack;  // nodes to visit
    stack.assign(1, 0);
    while (!stack.empty()) {
      const ClientTree::Node& node = nodes[stack.back()];
      stack.pop_back();
      if (space_.box_distance(candidate, node.box) >= node.longest) continue;
      for (std::uint32_t c = 0; c < node.child_count; ++c) stack.push_back(node.first_child + c);
      if (node.child_count > 0) continue;
      for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
        const std::uint32_t i = tree_->order()[k];
        const double d = row(i);
        if (d < state_.distance(i)) add_reassignment(i, d, move);
      }
      move.inspected += node.count;
    }
  }
}

template <class Space>
void SpaceSearch<Space>::scan_outliers(const Row& row, Move& move) const {
  for (const std::uint32_t i : state_.outliers()) {
    const double d = row(i);
    if (d < state_.distance(i)) add_reassignment(i, d, move);
  }
  move.inspected += state_.outliers().size();
}

// Examines the open facilities from number `begin` to `end`: their clients, unless the tree
// contains them, and whether they close.
template <class Space>
void SpaceSearch<Space>::scan_facilities(std::uint32_t candidate, const Row& row, std::size_t begin,
                                         std::size_t end, Move& move) const {
  const bool triangles = space_.has_triangles();
  for (std::size_t k = begin; k < end; ++k) {
    const std::uint32_t j = state_.open()[k];
    if (j == candidate) continue;
    bool reassigns = !tree_;
    bool may_close = true;
    if (triangles && strategy_ != FacilityStrategy::full_scan) {
      const Cluster& cluster = state_.cluster(j);
      const double d = kBelieved * row(j);
      ++move.inspected;
      // By the triangle inequality, if a client of j is nearer to the candidate than to j, the
      // candidate is within twice the longest connection of j.
      reassigns = reassigns && d < 2.0 * cluster.longest;
      // Likewise, if j closes, every client i loses at least d - 2 d(i, j), or price - d(i, j).
      may_close = cluster.weight * std::min(d, kBelieved * state_.outlier_price()) <
                  state_.facility_cost() + 2.0 * cluster.cost;
    }
    if (reassigns) {
      inspect(j, row, true, move);
    } else if (may_close) {
      inspect(j, row, false, move);
    }
  }
}

// Examines the clients of a facility. If the candidate may attract some, examines all of them,
// otherwise only until their losses reach the facility cost.
template <class Space>
void SpaceSearch<Space>::inspect(std::uint32_t facility, const Row& row, bool reassigns,
                                 Move& move) const {
  const Cluster& cluster = state_.cluster(facility);
  double losses = 0.0;
  std::size_t inspected = 0;
  for (const std::uint32_t i : cluster.clients) {
    const double d = row(i);
    ++inspected;
    if (d < state_.distance(i)) {
      if (reassigns) add_reassignment(i, d, move);
    } else {
      losses += loss(i, d);
      if (!reassigns && losses >= state_.facility_cost()) break;
    }
  }
  move.inspected += inspected;
  const double saving = state_.facility_cost() - losses;
  if (saving > 0.0) move.closings.push_back({facility, saving});
}

}  // namespace terrace::cluster
