// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/matching/point_matching.hpp"

namespace terrace::matching::windows {

/// The duals of points that were matched window by window, as lengths. Each point is the centre of
/// a disc. Each blossom has a moat of some width around the discs and moats inside it. The duals of
/// two points of different windows are feasible if the sum of their radii, moats included, is at
/// most their distance.
class Discs {
 public:
  explicit Discs(std::size_t points) : radius_(points, 0.0), moat_(points, kNone) {}

  /// Discards all windows and prepares for this many.
  void start(std::size_t windows);
  /// Stores the duals of window `w`, which contains these points. Different windows may be stored
  /// concurrently.
  void store(std::size_t w, std::span<const std::uint32_t> points, const PointMatching& matching);

  /// Shrinks discs and moats until no pair from different windows is too close. Consumes the
  /// windows.
  ///
  /// points: positions, in the unit of the radii.
  /// metric: as given to match_points() for these points.
  /// Returns: a lower bound of the cost of every perfect matching or, if n is odd, of every
  /// matching that leaves one point over.
  /// Cost: O(n log n) if radii are of the order of the distances between neighbours.
  template <std::size_t D>
  double bound(std::span<const std::array<double, D>> points, const PointMetric& metric,
               unsigned threads, const base::StopCheck& check_stop);

 private:
  struct Moat {
    double width;
    std::uint32_t parent;  // the next moat outward
  };
  struct Window {
    double sum = 0.0;         // of all discs and moats except the disc of the dummy vertex
    std::vector<Moat> moats;  // parents first
  };

  void shrink(const std::vector<double>& excess);

  std::vector<double> radius_;       // of each point, including its moats
  std::vector<std::uint32_t> moat_;  // the innermost moat around each point, in its window
  std::vector<std::uint32_t> window_;
  std::vector<Window> windows_;
};

}  // namespace terrace::matching::windows
