// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "terrace/matching/point_matching.hpp"

namespace terrace::matching::windows {

/// The duals of points that were matched window by window, as lengths: each point is the centre of
/// a disc, and each blossom has a moat of some width around the discs and moats inside. Two points
/// of different windows are as far apart as their duals demand where the sum of their radii, moats
/// included, is not above their distance.
class Discs {
 public:
  explicit Discs(std::size_t points) : radius_(points, 0.0), moat_(points, kNobody) {}

  /// Forgets all windows; there will be so many.
  void start(std::size_t windows);
  /// Takes the duals of window `w`, whose points these are. May be called for several windows at
  /// once.
  void take(std::size_t w, std::span<const std::uint32_t> points, const PointMatching& matching);

  /// Lowers discs and moats until no pair from different windows is too near. The windows are used
  /// up by it.
  ///
  /// points: positions, in which radii are lengths. metric: as given to match_points() for them.
  /// Returns: a bound below the cost of every perfect matching; of an odd number of points, of
  /// every matching that leaves one over.
  /// Cost: O(n log n) where radii are of the size of the distances between neighbours.
  template <std::size_t D>
  double bound(std::span<const std::array<double, D>> points, const PointMetric& metric,
               unsigned threads);

 private:
  struct Moat {
    double width;
    std::uint32_t parent;  // the next one outward
  };
  struct Window {
    double sum = 0.0;         // of all discs and moats, the vertex for nobody left out
    std::vector<Moat> moats;  // parents first
  };

  void give_way(const std::vector<double>& excess);

  std::vector<double> radius_;       // of each point, moats included
  std::vector<std::uint32_t> moat_;  // of each point: the innermost around it, in its window
  std::vector<std::uint32_t> window_;
  std::vector<Window> windows_;
};

}  // namespace terrace::matching::windows
