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
    const auto from = space_.from(0);
    for (std::uint32_t i = 0; i < state_.size(); ++i) {
      distances[i] = i == 0 ? 0.0 : from(i);
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
        const double d = space_.from(j).order(i);
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
  using From = typename Space::From;

  [[nodiscard]] auto points() const { return space_.points(); }

  // Finds open facilities that are nearer than `distances`. A facility remains its own client, at
  // distance 0.
  void find_nearest(std::vector<std::uint32_t>& facility, std::vector<double>& distances) const {
    base::StopTicks ticks(check_stop_);
    for (const std::uint32_t j : state_.open()) {
      ticks(2 * state_.size());
      const From from = space_.from(j);
      for (std::uint32_t i = 0; i < state_.size(); ++i) {
        const double d = from(i);
        if (d < distances[i]) {
          distances[i] = d;
          facility[i] = j;
        }
      }
    }
  }

  [[nodiscard]] double distance(std::uint32_t facility, std::uint32_t client) const override {
    return space_.from(facility)(client);
  }

  void connections_replaced() override {
    if (tree_) tree_->set(state_.distances());
  }

  void apply(const Verdict& verdict) override {
    state_.apply(verdict, space_.from(verdict.candidate), changed_);
    if (tree_) tree_->update(changed_, state_.distances());
  }

  void judge(std::uint32_t candidate, bool parallel, Verdict& verdict) override;

  // Computes parts of a gain. Each function appends to a verdict.
  void scan_all(std::uint32_t candidate, const From& from, Verdict& verdict);
  void scan_tree(std::uint32_t candidate, const From& from, Verdict& verdict) const;
  void scan_outliers(const From& from, Verdict& verdict) const;
  void scan_facilities(std::uint32_t candidate, const From& from, std::size_t begin,
                       std::size_t end, Verdict& verdict) const;
  void inspect(std::uint32_t facility, const From& from, bool takes, Verdict& verdict) const;
  void take(std::uint32_t client, double d, Verdict& verdict) const {
    const std::uint64_t facility = state_.facility(client);
    verdict.taken.push_back(
        {facility << 32 | client, state_.weight(client) * (state_.distance(client) - d)});
  }
  // Returns the loss of a client that the candidate does not take when its facility closes.
  [[nodiscard]] double loss(std::uint32_t client, double d) const {
    return state_.weight(client) * (std::min(d, state_.outlier_price()) - state_.distance(client));
  }

  Space space_;
  std::optional<ClientTree> tree_;
  std::vector<std::uint32_t> changed_;  // clients changed by the last verdict
  std::vector<Verdict> parts_;          // parts of a gain, by piece of work
};

// The gain under each strategy.

template <class Space>
void SpaceSearch<Space>::judge(std::uint32_t candidate, bool parallel, Verdict& verdict) {
  verdict.clear();
  verdict.candidate = candidate;
  const From from = space_.from(candidate);
  const std::size_t open = state_.open().size();
  const bool by_threads = parallel && team_.threads() > 1 && open > 1;
  if (!by_threads) {
    if (strategy_ == FacilityStrategy::full_scan) {
      scan_all(candidate, from, verdict);
    } else {
      if (tree_) {
        scan_tree(candidate, from, verdict);
      } else {
        scan_outliers(from, verdict);
      }
      scan_facilities(candidate, from, 0, open, verdict);
    }
  } else {
    // There are a few pieces per thread, because clusters differ in size. The last piece is the
    // client tree or the outliers.
    const std::size_t pieces = std::min<std::size_t>(open, 4 * team_.threads());
    parts_.resize(pieces + 1);
    team_.run(pieces + 1, [&](std::size_t piece) {
      Verdict& part = parts_[piece == 0 ? pieces : piece - 1];
      part.clear();
      if (piece > 0) {
        scan_facilities(candidate, from, (piece - 1) * open / pieces, piece * open / pieces, part);
      } else if (tree_) {
        scan_tree(candidate, from, part);
      } else {
        scan_outliers(from, part);
      }
    });
    for (const Verdict& part : parts_) {
      verdict.taken.insert(verdict.taken.end(), part.taken.begin(), part.taken.end());
      verdict.closed.insert(verdict.closed.end(), part.closed.begin(), part.closed.end());
      verdict.inspected += part.inspected;
    }
  }
  const auto by_key = [](const Verdict::Taken& a, const Verdict::Taken& b) {
    return a.key < b.key;
  };
  if (!std::is_sorted(verdict.taken.begin(), verdict.taken.end(), by_key)) {
    std::sort(verdict.taken.begin(), verdict.taken.end(), by_key);
  }
  state_.sum(verdict);
}

// Examines every client, as in the literature. The reference for the other strategies.
template <class Space>
void SpaceSearch<Space>::scan_all(std::uint32_t candidate, const From& from, Verdict& verdict) {
  std::vector<double>& losses = verdict.losses;
  losses.assign(state_.slot_count(), 0.0);
  for (std::uint32_t i = 0; i < state_.size(); ++i) {
    const double d = from(i);
    if (d < state_.distance(i)) {
      take(i, d, verdict);
    } else if (state_.facility(i) != kOutlier) {
      losses[state_.slot(state_.facility(i))] += loss(i, d);
    }
  }
  for (const std::uint32_t j : state_.open()) {
    const double spared = state_.facility_cost() - losses[state_.slot(j)];
    if (spared > 0.0 && j != candidate) verdict.closed.push_back({j, spared});
  }
  verdict.inspected += state_.size();
}

// Examines clients that may be nearer to the candidate than to their facility.
template <class Space>
void SpaceSearch<Space>::scan_tree(std::uint32_t candidate, const From& from,
                                   Verdict& verdict) const {
  if constexpr (Space::kHasBoxes) {
    const std::vector<ClientTree::Node>& nodes = tree_->nodes();
    std::vector<std::uint32_t>& stack = verdict.stack;  // nodes to visit
    stack.assign(1, 0);
    while (!stack.empty()) {
      const ClientTree::Node& node = nodes[stack.back()];
      stack.pop_back();
      if (space_.box_distance(candidate, node.box) >= node.longest) continue;
      for (std::uint32_t c = 0; c < node.child_count; ++c) stack.push_back(node.first_child + c);
      if (node.child_count > 0) continue;
      for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
        const std::uint32_t i = tree_->order()[k];
        const double d = from(i);
        if (d < state_.distance(i)) take(i, d, verdict);
      }
      verdict.inspected += node.count;
    }
  }
}

template <class Space>
void SpaceSearch<Space>::scan_outliers(const From& from, Verdict& verdict) const {
  for (const std::uint32_t i : state_.outliers()) {
    const double d = from(i);
    if (d < state_.distance(i)) take(i, d, verdict);
  }
  verdict.inspected += state_.outliers().size();
}

// Examines facilities from the begin-th open one on: their clients, if they are cells, and their
// closure.
template <class Space>
void SpaceSearch<Space>::scan_facilities(std::uint32_t candidate, const From& from,
                                         std::size_t begin, std::size_t end,
                                         Verdict& verdict) const {
  const bool triangles = space_.has_triangles();
  for (std::size_t k = begin; k < end; ++k) {
    const std::uint32_t j = state_.open()[k];
    if (j == candidate) continue;
    bool takes = !tree_;
    bool closes = true;
    if (triangles && strategy_ != FacilityStrategy::full_scan) {
      const Cluster& cluster = state_.cluster(j);
      const double d = kBelieved * from(j);
      ++verdict.inspected;
      // By the triangle inequality, if a client of j is nearer to the candidate than to j, the
      // candidate is within twice the longest connection of j.
      takes = takes && d < 2.0 * cluster.longest;
      // And every client i loses at least d - 2 d(i, j), or price - d(i, j).
      closes = cluster.weight * std::min(d, kBelieved * state_.outlier_price()) <
               state_.facility_cost() + 2.0 * cluster.cost;
    }
    if (takes) {
      inspect(j, from, true, verdict);
    } else if (closes) {
      inspect(j, from, false, verdict);
    }
  }
}

// Examines the clients of one facility: all if the candidate may take some, otherwise until they
// pay for the facility.
template <class Space>
void SpaceSearch<Space>::inspect(std::uint32_t facility, const From& from, bool takes,
                                 Verdict& verdict) const {
  const Cluster& cluster = state_.cluster(facility);
  double losses = 0.0;
  std::size_t inspected = 0;
  for (const std::uint32_t i : cluster.clients) {
    const double d = from(i);
    ++inspected;
    if (d < state_.distance(i)) {
      if (takes) take(i, d, verdict);
    } else {
      losses += loss(i, d);
      if (!takes && losses >= state_.facility_cost()) break;
    }
  }
  verdict.inspected += inspected;
  const double spared = state_.facility_cost() - losses;
  if (spared > 0.0) verdict.closed.push_back({facility, spared});
}

}  // namespace terrace::cluster
