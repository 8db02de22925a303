// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>
#include <terrace/base/thread_team.hpp>

#include "k_means/tree.hpp"

namespace terrace::cluster {

/// Assigns the points of a tree to the nearest of k centres. It descends from the root and keeps,
/// for each node, the centres that may be nearest to some point of its box. If only one remains,
/// the whole node is assigned to it. A centre is excluded only if another one is nearer to the
/// whole box by more than rounding. So the assignment equals that of comparing all computed
/// distances, where the lowest number wins ties.
class KMeansFilter {
 public:
  struct Sum {
    Point3 sum{};  ///< sum of weight times position
    double weight = 0;
  };

  /// tree, team and check_stop must outlive this object.
  KMeansFilter(const KMeansTree& tree, std::size_t clusters, base::ThreadTeam& team,
               const base::StopCheck& check_stop);

  /// Assigns all points. Returns whether any point changed its cluster.
  bool assign(std::span<const Point3> centres);

  /// Returns the sums of the clusters. The order of the additions does not depend on threads.
  [[nodiscard]] std::span<Sum> sums() { return sums_; }
  /// Returns the cluster of the point at a position.
  [[nodiscard]] std::uint32_t cluster(std::size_t position) const { return cluster_[position]; }
  /// Overrides the last assignment of one point.
  void move_point(std::size_t position, std::uint32_t cluster);

 private:
  // Centres that may be nearest to a point of a node, in ascending order.
  struct Candidates {
    double* x;
    double* y;
    double* z;
    std::uint32_t* number;
    std::size_t count;
  };
  struct Scratch {
    explicit Scratch(const base::StopCheck& check_stop) : ticks(check_stop) {}
    base::StopTicks ticks;
    std::vector<double> x, y, z;  // room for k candidates on each level
    std::vector<std::uint32_t> number;
    std::vector<Sum> sums;  // sums of the current chunk
    bool changed = false;
  };

  template <int D>
  void visit(std::size_t level, std::size_t node, const Candidates& candidates, Scratch& scratch,
             std::span<Sum> sums);
  template <int D>
  void assign_block(std::size_t block, const Candidates& candidates, Scratch& scratch,
                    std::span<Sum> sums);
  /// Assigns all points of a node to one cluster.
  void assign_node(std::size_t level, std::size_t node, std::uint32_t cluster, Scratch& scratch,
                   std::span<Sum> sums);
  /// Returns an empty list for the candidates of a level, in the scratch memory.
  [[nodiscard]] Candidates candidate_buffer(Scratch& scratch, std::size_t level) const;

  static constexpr std::uint32_t kMixed = UINT32_MAX;

  const KMeansTree& tree_;
  const std::size_t clusters_;
  base::ThreadTeam& team_;
  std::size_t chunk_level_ = 0;         // threads divide the nodes of this level among them
  std::vector<std::uint32_t> cluster_;  // by position, padded
  std::vector<std::uint32_t> owner_;    // by block: the cluster of all its points, or kMixed
  std::vector<Sum> sums_;
  std::vector<Sum> chunk_sums_;
  std::vector<Scratch> scratch_;  // by thread
};

}  // namespace terrace::cluster
