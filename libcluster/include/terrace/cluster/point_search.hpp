// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <random>

#include "terrace/cluster/facility.hpp"
#include "terrace/cluster/local_search.hpp"

/// Facility location of points under a metric by local search: Meyerson's start, then random
/// candidates, each of which is opened if that spares anything. How the saving (the gain) of a
/// candidate is computed is the caller's choice of strategy; all but `fast` give the same gains to
/// the last bit, hence the same solution.
/// Sources: M. Charikar, S. Guha, Improved combinatorial algorithms for the facility location and
/// k-median problems, FOCS 1999; A. Meyerson, Online facility location, FOCS 2001; J. Skála,
/// Algorithms for manipulating large geometric data, 4.2.3 and 7.3. Departs from the last in:
/// longest connections are unweighted distances (weighted ones exclude too much where weights are
/// below 1); a bound excludes facilities from closing before their clients are looked at;
/// clients may be left out at a price.

namespace terrace::cluster {

/// How a gain is computed (7.3.2). N clients, k open facilities.
enum class GainStrategy : std::uint8_t {
  automatic,   ///< the best that the metric admits: facilities, else kd_tree, else full_scan
  full_scan,   ///< all clients: N distances
  quadtree,    ///< cells of a quadtree over x and y, with their longest connections
  octree,      ///< of an octree
  kd_tree,     ///< of a kd-tree
  facilities,  ///< clusters as cells; the metric must be symmetric, with triangle inequality
  fast,        ///< not this search but BlockClusterer: see search_points()
};

/// "automatic", "full scan", "quadtree", "octree", "kd-tree", "facilities", "fast".
[[nodiscard]] const char* name_of(GainStrategy strategy);

struct PointSearchOptions {
  GainStrategy strategy = GainStrategy::automatic;
  SearchLength length = SearchLength::tenth;
  /// Candidates to try, in place of what `length` says.
  std::optional<std::size_t> iterations = std::nullopt;
  std::uint64_t seed = 1;
  /// Threads that compute one gain together, or those of a batch; the caller's included. Any
  /// number gives the same solution.
  unsigned threads = 1;
  /// Candidates judged at once, on the same solution (7.3.3): the one with the greatest positive
  /// gain is opened, those without gain count as tried, other positive ones are discarded and do
  /// not count. Another batch is another search; 1 is the plain one.
  std::size_t batch = 1;
  /// At the end each client goes to its nearest open facility.
  bool assign_nearest = false;
  /// Where the search starts instead of Meyerson's solution. Clients may have any facility of its
  /// list; a facility always serves itself; costs are not read.
  const FacilitySolution* start = nullptr;
  /// Called now and then in the caller's thread with the candidates done and to do. False stops the
  /// search: the solution so far is the result.
  std::function<bool(std::size_t done, std::size_t total)> progress = {};
};

/// What a search did, for the figures 7.12 to 7.14.
struct PointSearchStatistics {
  std::size_t candidates = 0;        ///< gains computed, discarded ones included
  std::size_t positive = 0;          ///< of these positive
  std::size_t opened = 0;            ///< of these carried out
  std::uint64_t inspected = 0;       ///< distances from a candidate to a client or facility
  std::uint64_t vertices = 0;        ///< clients and open facilities, summed over the candidates
  std::size_t wrongly_assigned = 0;  ///< clients with a nearer open facility, before assign_nearest

  [[nodiscard]] double positive_share() const {
    return candidates > 0 ? static_cast<double>(positive) / static_cast<double>(candidates) : 0.0;
  }
  /// Above 1 where distances were computed twice.
  [[nodiscard]] double inspected_share() const {
    return vertices > 0 ? static_cast<double>(inspected) / static_cast<double>(vertices) : 0.0;
  }
};

/// Starts, searches and sums up. At least one facility is open in the result, even where leaving
/// all clients out would be cheaper.
///
/// The diagonal that facility_cost and outlier_price multiply is that of the bounding box in the
/// metric, channels included as further axes. A custom metric is called by several threads at once
/// if there are several.
///
/// Strategy `fast` is BlockClusterer on linearly mapped points: orders of magnitude faster, within
/// a few per cent of the search's cost, and every client at its nearest facility. It takes metrics
/// that are linear on the box of the points (Euclidean, elliptical, a field uniform there), without
/// channels, outliers or a start, and fewer than 2^24 points; `length` chooses Effort::standard,
/// fine or full; threads, batch, iterations and progress are not read.
///
/// Throws: std::invalid_argument as check(problem); on a strategy that the metric or the problem
/// does not admit, with the reason; on a batch of 0; on a start that is no solution of the problem;
/// on a custom distance that is negative or not a number, naming facility and client.
/// Cost: iterations times a gain, which is O(N) for full_scan, and O(N k) for the start.
/// Memory: about 150 bytes per point.
[[nodiscard]] FacilitySolution search_points(const FacilityPoints& problem,
                                             const PointSearchOptions& options = {},
                                             PointSearchStatistics* statistics = nullptr);

/// The strategy that `automatic` takes for a problem.
[[nodiscard]] GainStrategy best_strategy(const FacilityPoints& problem);

class SearchEngine;

/// The same search step by step. Costs and gains are in the unit of the metric.
/// Law: cost() before open(p) minus cost() after is gain(p), whatever the sign, up to rounding.
class PointSearch {
 public:
  /// The problem's arrays are copied. One facility, point 0, is open at first.
  /// Throws: as search_points(); strategy `fast` is none of this class.
  explicit PointSearch(const FacilityPoints& problem,
                       GainStrategy strategy = GainStrategy::automatic, unsigned threads = 1);
  ~PointSearch();
  PointSearch(PointSearch&&) noexcept;
  PointSearch& operator=(PointSearch&&) noexcept;

  /// Meyerson's initial solution (4.2.3): the points in random order, each of which opens a
  /// facility with probability w d / fc, d being the distance from the nearest facility so far,
  /// and joins that facility otherwise (or is left out if that is cheaper). O(points * facilities).
  void start(std::mt19937_64& random);
  /// Throws: std::invalid_argument if it is no solution of the problem.
  void start(const FacilitySolution& solution);

  /// What opening `candidate` would spare: it takes the clients that are nearer to it than to their
  /// facility, and all clients of the facilities that are not worth keeping then. An open facility
  /// is a candidate as well; it costs nothing to open.
  [[nodiscard]] double gain(std::uint32_t candidate);
  /// Carries out what gain() judged.
  void open(std::uint32_t candidate);

  /// Tries random candidates as PointSearchOptions::batch and ::progress say. False if stopped.
  bool improve(std::size_t candidates, std::mt19937_64& random, std::size_t batch = 1,
               const std::function<bool(std::size_t, std::size_t)>& progress = {});

  /// Connects each client to its nearest open facility; of equally near ones to the present one or
  /// else the lowest number. Leaves out whom that price suits better. The cost does not rise.
  void assign_nearest();
  /// Clients that some open facility, or the price of an outlier, would suit better. O(N k).
  [[nodiscard]] std::size_t wrongly_assigned() const;

  [[nodiscard]] double cost() const;
  [[nodiscard]] std::size_t facility_count() const;
  [[nodiscard]] FacilitySolution solution() const;
  /// Since the construction; wrongly_assigned is left at 0.
  [[nodiscard]] PointSearchStatistics statistics() const;

 private:
  std::unique_ptr<SearchEngine> engine_;
};

}  // namespace terrace::cluster
