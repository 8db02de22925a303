// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <terrace/cluster/hierarchy.hpp>

#include "sets.hpp"

/// Runs libcluster's HierarchyBuilder with the searches of the thesis (4.3, 7.1), one block at a
/// time, and measures time and cost.

namespace terrace::research {

struct StreamOptions {
  std::size_t block = 10'000;  ///< points clustered together (m)
  double facility_cost = 1.0;  ///< times the diagonal of the block's bounding box
  cluster::FacilityStrategy strategy =
      cluster::FacilityStrategy::facilities;  ///< or `fast`, the library's own engine
  cluster::Effort effort = cluster::Effort::standard;
  std::size_t batch = 1;
  unsigned threads = 1;
};

/// A clustered block of level 0.
struct StreamBlock {
  const cluster::ClusteredBlock& block;
  double facility_cost = 0.0;  ///< cost of one facility
  double cost = 0.0;           ///< cost of all facilities and connections
};

/// Clusters a stream of points and adds up the cost of its blocks.
class StreamClustering {
 public:
  using OnBlock = std::function<void(const StreamBlock&)>;
  explicit StreamClustering(const StreamOptions& options, OnBlock on_block = {});
  ~StreamClustering();
  StreamClustering(StreamClustering&&) noexcept;

  void push(std::span<const Point3> points);
  void finish();

  /// Returns the time spent in the library.
  [[nodiscard]] double seconds() const { return seconds_; }
  /// Returns the sum over all blocks of level 0, in their order.
  [[nodiscard]] double cost() const;
  /// Returns the number of points that reached each level; [0] is the input.
  [[nodiscard]] std::vector<std::uint64_t> level_points() const { return result_.level_points; }

 private:
  class Weighing;

  std::size_t block_, pending_ = 0;  ///< points per block, and in the current one
  std::unique_ptr<Weighing> sink_;
  std::unique_ptr<cluster::HierarchyBuilder> builder_;
  cluster::HierarchyResult result_;
  double seconds_ = 0.0;
};

/// Reads a set to its end, a few points at a time, and pushes all points into each of the streams.
/// So disturbances of the machine affect all streams alike.
void run(PointSet& set, std::span<StreamClustering> streams);

}  // namespace terrace::research
