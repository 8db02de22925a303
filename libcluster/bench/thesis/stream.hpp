// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "sets.hpp"
#include "terrace/cluster/facility_location.hpp"

/// The thesis's clustering of data streams (4.3, 7.1) as it stands there, on one block at a time;
/// HierarchyBuilder is what this library makes of it.

namespace terrace::cluster::thesis {

struct StreamOptions {
  std::size_t block = 10'000;  ///< points clustered together (m)
  double facility_cost = 1.0;  ///< times the diagonal of the block
  FacilityStrategy strategy = FacilityStrategy::facilities;
  Effort effort = Effort::standard;
  std::size_t batch = 1;
  unsigned threads = 1;
};

/// A clustered block of level 0.
struct StreamBlock {
  std::span<const Point3> points;
  const FacilitySolution& solution;
};

/// Points come to level 0. A full block is clustered, its facilities go one level up with the
/// weights of their clients; weights are divided by their mean in each block's own copy. At the end
/// the rest of each level is clustered, up to the first level that has fitted one block: the top.
class StreamClustering {
 public:
  using OnBlock = std::function<void(const StreamBlock&)>;
  explicit StreamClustering(const StreamOptions& options, OnBlock on_block = {});

  void push(std::span<const Point3> points);
  /// Throws: std::runtime_error if the clustering does not reduce a level, or has lost weight.
  void finish();

  /// Time of the search alone.
  [[nodiscard]] double seconds() const { return seconds_; }
  /// The sum over all blocks of level 0, in their order.
  [[nodiscard]] double cost() const { return cost_; }
  /// Points that came to each level; [0] is the input.
  [[nodiscard]] std::vector<std::uint64_t> level_points() const;

 private:
  struct Level {
    std::vector<Point3> points;
    std::vector<double> weights;
    std::uint64_t all = 0, blocks = 0;
  };
  void add(std::size_t level, const Point3& point, double weight);
  void cluster(std::size_t level);

  StreamOptions options_;
  OnBlock on_block_;
  std::vector<Level> levels_;
  std::vector<double> weights_;
  double seconds_ = 0.0;
  double cost_ = 0.0;
};

/// Reads a set to its end, some points at a time, and gives all of it to each of the streams, so
/// that a disturbance of the machine hits all of them.
void run(PointSet& set, std::span<StreamClustering> streams);

}  // namespace terrace::cluster::thesis
