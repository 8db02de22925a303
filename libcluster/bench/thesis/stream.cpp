// SPDX-License-Identifier: Apache-2.0
#include "stream.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <stdexcept>
#include <string>
#include <utility>

namespace terrace::cluster::thesis {

StreamClustering::StreamClustering(const StreamOptions& options, OnBlock on_block)
    : options_(options), on_block_(std::move(on_block)), levels_(1) {}

void StreamClustering::push(std::span<const Point3> points) {
  for (const Point3& p : points) add(0, p, 1.0);
}

void StreamClustering::finish() {
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    if (level > 0 && levels_[level].all <= options_.block) {  // the top
      double weight = 0.0;
      for (const double w : levels_[level].weights) weight += w;
      if (weight != static_cast<double>(levels_[0].all)) {
        throw std::runtime_error("the top weighs " + std::to_string(weight) + ", the input " +
                                 std::to_string(levels_[0].all));
      }
      return;
    }
    if (level > 0 && levels_[level].all >= levels_[level - 1].all) {
      throw std::runtime_error("level " + std::to_string(level) + " is not smaller than the one " +
                               "below: the facility cost is too low for this stream");
    }
    if (!levels_[level].points.empty()) cluster(level);
  }
}

std::vector<std::uint64_t> StreamClustering::level_points() const {
  std::vector<std::uint64_t> counts;
  for (const Level& level : levels_) counts.push_back(level.all);
  return counts;
}

void StreamClustering::add(std::size_t level, const Point3& point, double weight) {
  if (level == levels_.size()) levels_.emplace_back();
  // A full block waits for the next point: if none comes, the level may be the top.
  if (levels_[level].points.size() == options_.block) cluster(level);
  Level& to = levels_[level];
  if (to.points.capacity() == 0) {
    to.points.reserve(options_.block);
    to.weights.reserve(options_.block);
  }
  to.points.push_back(point);
  to.weights.push_back(weight);
  ++to.all;
}

void StreamClustering::cluster(std::size_t level) {
  FacilityPoints problem{.points = levels_[level].points, .facility_cost = options_.facility_cost};
  if (level > 0) {  // below all weights are 1
    weights_ = levels_[level].weights;
    double sum = 0.0;
    for (const double w : weights_) sum += w;
    for (double& w : weights_) w *= static_cast<double>(weights_.size()) / sum;
    problem.weights = weights_;
  }
  FacilityOptions search;
  search.strategy = options_.strategy;
  search.effort = options_.effort;
  search.seed = (levels_[level].blocks++ << 8) + level + 1;
  search.batch = options_.batch;
  search.threads = options_.threads;

  const auto start = std::chrono::steady_clock::now();
  const FacilitySolution solution = solve(problem, search);
  seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  if (level == 0) {
    cost_ += solution.cost();
    if (on_block_) on_block_({problem.points, solution});
  }
  std::vector<double> weights(solution.facilities.size(), 0.0);
  for (std::size_t i = 0; i < solution.assignment.size(); ++i) {
    weights[solution.assignment[i]] += levels_[level].weights[i];
  }
  for (std::size_t k = 0; k < weights.size(); ++k) {
    // By value: going up may move the levels.
    const Point3 facility = levels_[level].points[solution.facilities[k]];
    add(level + 1, facility, weights[k]);
  }
  levels_[level].points.clear();
  levels_[level].weights.clear();
}

void run(PointSet& set, std::span<StreamClustering> streams) {
  std::array<Point3, 500> buffer;  // not on the heap: it is no part of anybody's memory
  for (std::uint64_t first = 0; first < set.size(); first += buffer.size()) {
    const std::span points(
        buffer.data(), static_cast<std::size_t>(std::min<std::uint64_t>(500, set.size() - first)));
    set.read(first, points);
    for (StreamClustering& stream : streams) stream.push(points);
  }
  for (StreamClustering& stream : streams) stream.finish();
}

}  // namespace terrace::cluster::thesis
