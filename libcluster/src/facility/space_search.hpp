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

#include "draws.hpp"
#include "facility/box_tree.hpp"
#include "facility/search_engine.hpp"
#include "facility/search_space.hpp"

namespace terrace::cluster {

/// The local search over a space of search_space.hpp.
template <class Space>
class SpaceSearch final : public SearchEngine {
 public:
  /// strategy: one that the space admits, not automatic or fast.
  SpaceSearch(SearchFrame& frame, Space space, GainStrategy strategy, unsigned threads)
      : SearchEngine(frame, threads), space_(std::move(space)), strategy_(strategy) {
    if constexpr (Space::kHasBoxes) {
      if (strategy == GainStrategy::quadtree) tree_.emplace(BoxTree::Kind::quadtree, points());
      if (strategy == GainStrategy::octree) tree_.emplace(BoxTree::Kind::octree, points());
      if (strategy == GainStrategy::kd_tree) tree_.emplace(BoxTree::Kind::kd_tree, points());
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
      std::swap(order[i - 1], order[draw_below(i, random)]);
    }
    std::vector<std::uint32_t> facility(count), open;
    std::vector<double> distances(count);
    for (const std::uint32_t i : order) {
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
      if (open.empty() || draw_unit(random) * state_.facility_cost() < state_.weight(i) * least) {
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

  // Where an open facility is nearer than `distances` say. A facility stays its own client, at 0.
  void find_nearest(std::vector<std::uint32_t>& facility, std::vector<double>& distances) const {
    for (const std::uint32_t j : state_.open()) {
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

  // Parts of a gain. Each appends to a verdict.
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
  // What a client that is not taken loses when its facility closes.
  [[nodiscard]] double loss(std::uint32_t client, double d) const {
    return state_.weight(client) * (std::min(d, state_.outlier_price()) - state_.distance(client));
  }

  Space space_;
  GainStrategy strategy_;
  std::optional<BoxTree> tree_;
  std::vector<std::uint32_t> changed_;  // by the last verdict applied
  std::vector<Verdict> parts_;          // of a gain, by piece of work
};

}  // namespace terrace::cluster

#include "facility/space_search_gain.hpp"
