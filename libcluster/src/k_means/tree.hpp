// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "scaling.hpp"
#include "terrace/cluster/point.hpp"

namespace terrace::cluster {

/// Returns the squared distance of two points.
inline double squared(const Point3& a, const Point3& b) {
  const double x = a[0] - b[0];
  const double y = a[1] - b[1];
  const double z = a[2] - b[2];
  return x * x + y * y + z * z;
}

/// Points in Z-order and a tree over them. A leaf is a block of kBlock points, and an inner node
/// has up to kFan consecutive children. Each node has a box and sums over its points.
struct KMeansTree {
  static constexpr std::size_t kBlock = 32;
  static constexpr std::size_t kFan = 4;

  struct Node {
    Box3 box;
    double diagonal2 = 0;  ///< squared diagonal of the box
    Point3 sum{};          ///< sum of weight times position
    double weight = 0;
  };

  /// weights: scaled to at most 1, or empty.
  KMeansTree(std::span<const Point3> points, std::span<const double> weights,
             const Scaling& scaling, const base::StopCheck& check_stop);

  /// Returns the number of blocks.
  [[nodiscard]] std::size_t block_count() const { return levels.front().size(); }
  /// Returns the first block below a node.
  [[nodiscard]] std::size_t first_block(std::size_t level, std::size_t node) const;
  [[nodiscard]] Point3 point(std::size_t position) const {
    return {x[position], y[position], z[position]};
  }

  std::size_t count = 0;
  // Scaled columns, padded to whole blocks with copies of the last point at weight 0.
  std::vector<double> x, y, z, w;
  std::vector<std::uint32_t> original;    ///< index in the input; not padded
  std::vector<std::vector<Node>> levels;  ///< levels[0] is the blocks; the last level is one node
};

}  // namespace terrace::cluster
