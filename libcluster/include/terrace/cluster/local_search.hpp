// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "terrace/cluster/block.hpp"
#include "terrace/cluster/point.hpp"

/// Facility location by local search as the literature states it: random candidates, each judged
/// by a scan of all points in double precision. It is the reference that BlockClusterer is
/// measured against, and slow: O(points) per candidate.
/// Sources: M. Charikar, S. Guha, Improved combinatorial algorithms for the facility location and
/// k-median problems, FOCS 1999; A. Meyerson, Online facility location, FOCS 2001; J. Skála,
/// Algorithms for manipulating large geometric data, 4.2.3 and 7.3.1.

namespace terrace::cluster {

/// Number of candidates that a local search over m points tries.
enum class SearchLength : std::uint8_t {
  tenth,       ///< 0.1 m, at least 1
  log10_full,  ///< m ceil(log10 m), what the thesis calls the full search
  log2_full,   ///< m ceil(log2 m)
};

/// The candidates of a search of that length, at least one for a block that is not empty.
[[nodiscard]] std::size_t candidate_count(SearchLength length, std::size_t points);

/// A solution under improvement. All costs are in the unit of the points.
/// Law: cost() before open(p) minus cost() after is gain(p), whatever the sign.
class LocalSearch {
 public:
  /// points: finite. weights: positive and finite, or empty for 1 each; they multiply distances.
  /// facility_cost: positive, times the diagonal of the bounding box. Requires at least one point.
  LocalSearch(std::span<const Point3> points, std::span<const double> weights,
              double facility_cost);

  /// Meyerson's initial solution, replacing the present one: the points in random order, each of
  /// which opens a facility with probability w d / fc, d being the distance to the nearest
  /// facility so far, and joins that facility otherwise. O(points * facilities).
  void start(std::mt19937_64& random);

  /// What opening `candidate` would spare: it takes the points that are nearer to it than to
  /// their facility, and all points of the facilities that are not worth keeping then. An open
  /// facility is a candidate as well; it costs nothing to open. O(points).
  [[nodiscard]] double gain(std::uint32_t candidate);

  /// Carries out what gain() judged. O(points).
  void open(std::uint32_t candidate);

  /// Tries `candidates` random points and opens those with a positive gain.
  void improve(std::size_t candidates, std::mt19937_64& random);

  /// The present solution. Points may be connected to a facility that is not the nearest, as a
  /// facility is judged only when it is a candidate.
  [[nodiscard]] double cost() const;
  [[nodiscard]] std::size_t facility_count() const { return facility_count_; }

  /// Clusters in ascending order of their facilities.
  void result(BlockClustering& clustering) const;

 private:
  [[nodiscard]] double distance(std::uint32_t a, std::uint32_t b) const;
  double judge(std::uint32_t candidate);

  std::vector<Point3> points_;  // scaled to the unit box
  std::vector<double> weights_;
  int unit_exponent_ = 0;       // 2 to this power is what scaled lengths are multiplied by
  double facility_cost_ = 0.0;  // scaled
  std::vector<std::uint32_t> facility_;
  std::vector<double> distance_;
  std::vector<double> closing_;  // by facility: what its remaining points would lose
  std::vector<bool> is_open_;
  std::size_t facility_count_ = 0;
};

/// Meyerson's start and a search of the given length.
/// weights as in BlockClusterer::run. An empty block gives an empty result.
void local_search(std::span<const Point3> points, std::span<const double> weights,
                  double facility_cost, SearchLength length, std::uint64_t seed,
                  BlockClustering& clustering);

}  // namespace terrace::cluster
