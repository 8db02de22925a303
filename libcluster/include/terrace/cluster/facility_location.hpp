// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/cluster/effort.hpp"
#include "terrace/cluster/metric.hpp"
#include "terrace/cluster/point.hpp"

/// Uncapacitated facility location: each open facility costs its opening cost, each client is
/// connected to one open facility, and
///     Q = sum of opening costs + sum of connection costs
/// is minimised. A problem consists of points under a metric, of entities with a distance function,
/// or of a matrix of costs. solve() accepts each of them, and lower_bound() bounds how far a result
/// is from the optimum. Source: J. Skála, Algorithms for manipulating large geometric data, 4.2.3,
/// 7.1 and 7.3, called the thesis below. Each strategy lists its own sources.

namespace terrace::cluster {

/// Points under a metric. Every point is a client and a possible facility, all facilities cost the
/// same, and connecting client i costs weights[i] times its distance from the facility.
struct FacilityPoints {
  std::span<const Point3> points = {};   ///< finite
  std::span<const double> weights = {};  ///< positive and finite, or empty for 1 each
  Metric metric = Euclidean{};           ///< several threads may call a custom metric at once
  Channels channels = {};                ///< empty: position only
  /// Positive; a multiple of the diagonal of the bounding box in the metric, with channels as
  /// further axes.
  double facility_cost = 1.0;
  /// The cost of leaving out a client of weight 1, as a multiple of the same diagonal. If infinite,
  /// every client is connected (thesis 7.1.3, figure 7.3).
  double outlier_price = std::numeric_limits<double>::infinity();
};

/// Anything with distances (triangles, segments, words), numbered from 0. Every entity is a client
/// and a possible facility (thesis, chapter 9).
struct FacilityEntities {
  std::size_t count = 0;
  /// Distance from a facility to a client: finite, not negative, and 0 from an entity to itself.
  /// Several threads call it at once if the search uses several.
  std::function<double(std::uint32_t facility, std::uint32_t client)> distance = {};
  bool symmetric = false;            ///< distance(a, b) == distance(b, a) always
  bool triangle_inequality = false;  ///< distance(a, c) <= distance(a, b) + distance(b, c) always
  std::span<const double> weights = {};  ///< positive and finite, or empty for 1 each
  double facility_cost = 1.0;            ///< positive, in the unit of the distances
  /// The cost of leaving out an entity of weight 1, in the same unit. If infinite, every entity is
  /// connected.
  double outlier_price = std::numeric_limits<double>::infinity();
};

/// The general problem with arbitrary costs, metric or not.
struct FacilityMatrix {
  std::size_t facilities = 0, clients = 0;
  std::span<const double> opening = {};     ///< one per facility; not negative, finite
  std::span<const double> connection = {};  ///< [facility * clients + client]; same requirements

  [[nodiscard]] double cost(std::size_t facility, std::size_t client) const {
    return connection[facility * clients + client];
  }
};

/// Checks a problem. Throws std::invalid_argument, with the index in the message, for
/// - sizes that do not match;
/// - no facilities or clients, or more than 2^32 - 2 of either;
/// - coordinates, weights or channels that are not finite;
/// - weights or costs out of range;
/// - a missing function.
/// Also throws whatever check_stop throws.
void check(const FacilityPoints& problem);
void check(const FacilityEntities& problem);
void check(const FacilityMatrix& problem, const base::StopCheck& check_stop = {});

/// Assignment of a client that is left out.
inline constexpr std::uint32_t kOutlier = 0xffffffff;

/// A solution. Clusters are numbered by ascending facility.
struct FacilitySolution {
  std::vector<std::uint32_t> facilities;  ///< the open facilities, ascending
  std::vector<std::uint32_t> assignment;  ///< per client: position in `facilities`, or kOutlier
  double opening_cost = 0.0;
  double connection_cost = 0.0;
  double outlier_cost = 0.0;
  double lower_bound = 0.0;  ///< no solution costs less; 0 if not computed

  [[nodiscard]] double cost() const { return opening_cost + connection_cost + outlier_cost; }
  /// Fraction by which the cost may exceed the optimum: 0.01 is one per cent. Infinite without a
  /// bound.
  [[nodiscard]] double gap() const {
    if (cost() <= lower_bound) return 0.0;
    return lower_bound > 0.0 ? cost() / lower_bound - 1.0 : std::numeric_limits<double>::infinity();
  }
};

/// Strategies of solve(), of three kinds.
///
/// Local search over points and entities: starts with Meyerson's online algorithm and continues
/// with random candidates. Each is opened if its gain (the cost that this saves) is positive. The
/// strategies from full_scan to facilities differ in how they compute a gain (thesis 7.3.2; n
/// clients). They give the same gains to the last bit, hence the same solution. One facility stays
/// open, even if leaving all clients out would be cheaper. Sources: M. Charikar, S. Guha, Improved
/// combinatorial algorithms for the facility location and k-median problems, FOCS 1999; A.
/// Meyerson, Online facility location, FOCS 2001.
///
/// There are three differences from the thesis. Longest connections are unweighted distances,
/// because weighted ones prune too much if weights are below 1. A bound keeps facilities from
/// closing before their clients are examined. Clients may be left out at a price.
///
/// Block clustering: `fast`.
///
/// Strategies on a matrix: interchange, jain_vazirani, greedy_stars. For points and entities the
/// matrix of 8 n^2 bytes is built first. A client whose connection would cost more than its outlier
/// price is left out at the end.
enum class FacilityStrategy : std::uint8_t {
  /// For points and entities `facilities`, else `kd_tree`, else `full_scan`: the first that
  /// supports the distances. For a matrix, `interchange`.
  automatic,
  full_scan,  ///< examines all clients: n distances
  quadtree,  ///< cells of a quadtree over x and y, with their longest connections; no custom metric
  octree,    ///< cells of an octree; no custom metric
  kd_tree,   ///< cells of a kd-tree; no custom metric
  facilities,  ///< clusters as cells; distances must be symmetric, with triangle inequality
  /// BlockClusterer (block.hpp) on linearly mapped points. Orders of magnitude faster, and within a
  /// few per cent of the local search's cost. Every client gets its nearest facility. Requires a
  /// metric that is linear on the bounding box of the points (Euclidean, elliptical, or a field
  /// that is uniform there), no channels, outliers or start, and fewer than 2^24 points.
  fast,
  /// Local search with restarts. The solution is a local optimum: it is not improved (by more than
  /// rounding) by opening one facility, closing one, swapping one for another, or opening one and
  /// closing those whose clients are better off there. Takes O(facilities * clients) per round
  /// through the candidates and some rounds per perturbation. Memory is O(facilities + clients) per
  /// thread, plus a copy of the matrix if its costs exceed 2^900. Sources: R. Whitaker, A fast
  /// algorithm for the greedy interchange, INFOR 1983; M. Resende, R. Werneck, A fast swap-based
  /// local search procedure for location problems, Annals of Operations Research 2007 (nearest and
  /// second nearest open facility).
  interchange,
  /// Primal-dual growth. As time passes, every client that is not yet connected offers an amount
  /// equal to the time, first for its connection and, with the rest, for opening a facility. A
  /// facility opens when the offers reach its opening cost. Offers remain after a client is
  /// connected. Of facilities that share a client who paid for both, only the first to open stays
  /// open. At the end clients go to the cheapest open facility, and facilities without clients
  /// close. Deterministic: at equal times the lower number comes first. The duals are feasible, so
  /// their sum is a lower bound; on metric costs the solution costs at most 3 times that bound.
  /// Takes O(facilities * clients * log(facilities * clients)) time and 12 bytes per entry of the
  /// matrix.
  /// Source: K. Jain, V. Vazirani, Approximation algorithms for metric facility location and
  /// k-median problems using the primal-dual schema and Lagrangian relaxation, J. ACM 2001.
  jain_vazirani,
  /// The same growth, except that a client withdraws its other offers when it is connected (as the
  /// thesis describes it). The duals sum to the cost before clients go to the cheapest facility.
  /// They become feasible only after division by at most 1.861 on metric costs, or by at most the
  /// harmonic number of the clients on any costs. The least divisor that makes them feasible gives
  /// the lower bound. Takes O(facilities * clients * log(clients)) time, more with many ties, and 4
  /// bytes per entry.
  /// Source: M. Mahdian et al., A greedy facility location algorithm analyzed using dual fitting,
  /// APPROX 2001.
  greedy_stars,
};

/// Returns "automatic", "full scan", "quadtree", "octree", "kd-tree", "facilities", "fast",
/// "interchange", "Jain-Vazirani" or "greedy stars".
[[nodiscard]] const char* name_of(FacilityStrategy strategy);

/// Called on the caller's thread at intervals with the number of steps done and their total.
/// Returning false ends the work with the best result so far.
using FacilityProgress = std::function<bool(std::size_t done, std::size_t total)>;

struct FacilityOptions {
  FacilityStrategy strategy = FacilityStrategy::automatic;
  Effort effort = Effort::standard;
  /// Number of independent searches of `interchange`, at least 1. Overrides `effort`.
  std::optional<std::uint32_t> restarts = {};
  /// Exact length of the search: candidates for local search, perturbations per restart for
  /// interchange. Overrides `effort`. Other strategies ignore it.
  std::optional<std::size_t> steps = {};
  /// Interchange starts no perturbation after this many seconds. The result then depends on the
  /// machine.
  double seconds = std::numeric_limits<double>::infinity();
  std::uint64_t seed = 1;
  /// Number of threads, including the caller's; 0: one per core. Does not change the result.
  /// `jain_vazirani`, `greedy_stars` and `fast` use one thread.
  unsigned threads = 1;
  /// Number of candidates that a local search evaluates at once, on the same solution
  /// (thesis 7.3.3). The one with the greatest positive gain is opened, those without gain count as
  /// tried, and the others are discarded and do not count. Different batch sizes make different
  /// searches; 1 is the sequential algorithm.
  std::size_t batch = 1;
  /// Whether a local search finally moves each client to its nearest open facility.
  bool assign_nearest = false;
  /// A solution from which a local search starts, instead of Meyerson's. A client may have any
  /// facility of its list, but a facility always serves itself. Costs are ignored.
  const FacilitySolution* start = nullptr;
  /// Limit for a matrix made from points or entities, in bytes; 0: none.
  std::uint64_t memory_limit = 0;
  /// Reports the progress of a local search in candidates.
  FacilityProgress progress = {};
  base::StopCheck check_stop = {};
};

/// Statistics of a local search, for figures 7.12 to 7.14 of the thesis.
struct SearchStatistics {
  std::size_t candidates = 0;        ///< gains computed, including discarded ones
  std::size_t positive = 0;          ///< candidates with a positive gain
  std::size_t opened = 0;            ///< candidates that were opened
  std::uint64_t inspected = 0;       ///< distances from a candidate to a client or facility
  std::uint64_t vertices = 0;        ///< clients and open facilities, over all candidates
  std::size_t wrongly_assigned = 0;  ///< clients with a nearer open facility, before assign_nearest

  [[nodiscard]] double positive_share() const {
    return candidates > 0 ? static_cast<double>(positive) / static_cast<double>(candidates) : 0.0;
  }
  /// Above 1 if some distances were computed twice.
  [[nodiscard]] double inspected_share() const {
    return vertices > 0 ? static_cast<double>(inspected) / static_cast<double>(vertices) : 0.0;
  }
};

/// Additional results of a strategy.
struct FacilityReport {
  FacilityStrategy strategy = FacilityStrategy::automatic;  ///< the one that was used
  SearchStatistics search;
  /// Duals per client: for jain_vazirani and greedy_stars, the time at which the client was
  /// connected.
  std::vector<double> duals;
  /// Divisor that makes the duals feasible: the least number (to 1e-9) for which no facility
  /// receives more than it costs. 1 except for greedy_stars.
  double divisor = 1.0;
};

/// Solves the problem by the strategy of the options. Fills in `report` if given; its
/// wrongly_assigned takes O(n * facilities).
///
/// The result depends on the problem and the options, but not on threads.
/// Throws: std::invalid_argument as check(problem) does, and
/// - for a strategy that the problem does not admit, with the reason;
/// - for a batch of 0, no restarts, or `seconds` that is NaN;
/// - for a start that is not a solution of the problem or that the strategy does not accept;
/// - for a caller's distance that is negative or NaN, with facility and client;
/// - if the matrix of points or entities exceeds the limit or memory cannot be allocated, with the
///   bytes needed.
/// Cost: a local search takes at most O(n) per candidate, O(n * facilities) for the start, and
/// about 150 bytes per point.
[[nodiscard]] FacilitySolution solve(const FacilityPoints& problem,
                                     const FacilityOptions& options = {},
                                     FacilityReport* report = nullptr);
[[nodiscard]] FacilitySolution solve(const FacilityEntities& problem,
                                     const FacilityOptions& options = {},
                                     FacilityReport* report = nullptr);
[[nodiscard]] FacilitySolution solve(const FacilityMatrix& problem,
                                     const FacilityOptions& options = {},
                                     FacilityReport* report = nullptr);

struct LowerBound {
  std::vector<double> duals;  ///< v_i below, per client
  double lower_bound = 0.0;   ///< L(v) rounded down; at least 0
};

struct LowerBoundOptions {
  std::size_t steps = 1000;  ///< subgradient steps; 0: only their starting point
  unsigned threads = 1;      ///< 0: one per core. Does not change the result.
  FacilityProgress progress = {};
  base::StopCheck check_stop = {};
};

/// Computes a lower bound of the cost of every solution, so that a result can state its gap. The
/// bound is a value of the Lagrangian dual. Let every client i pay v_i for being connected. A
/// facility is then worth opening if the clients that it connects for less pay for it, and
///     L(v) = sum_i v_i + sum_j min(0, opening_j - sum_i max(0, v_i - c_ij))
/// does not exceed the cost of any solution, *whatever the v_i are*. So rounding in the search for
/// good v does no harm. Only the evaluation of L matters, and a bound of its rounding error is
/// subtracted: (terms + 8) epsilon times the sum of the absolute values. Sources: D. Erlenkotter, A
/// dual-based procedure for uncapacitated facility location, Operations Research 1978; G.
/// Cornuejols, M. Fisher, G. Nemhauser, Location of bank accounts to optimize float, Management
/// Science 1977; dual program 4.17 to 4.21 of the thesis.
///
/// For a matrix: dual ascent with dual adjustment, then subgradient steps. `start` is a solution
/// whose cost is the target of the steps. The better it is, the sooner the bound is good. If it has
/// no facilities, a greedy solution is made. The bound cannot exceed the value of the linear
/// relaxation. Takes 12 bytes per entry of the matrix and O(facilities * clients) time per step.
/// Throws: std::invalid_argument as check() does, for a start that is not a solution of the
/// problem, and if memory cannot be allocated (the message gives the bytes needed).
[[nodiscard]] LowerBound lower_bound(const FacilityMatrix& problem,
                                     const FacilitySolution& start = {},
                                     const LowerBoundOptions& options = {});

/// For points and entities, from a solution whose clusters initially pay for their own facilities.
/// Nothing is stored per pair. If distances to a box can be bounded (all metrics except custom
/// ones), a facility examines only the clients near it, some hundreds per step; a million points
/// take about a second per step on one core. Otherwise a step takes O(n^2). Weights, channels and
/// the outlier price count. The bound holds for the distances as computed from the given
/// coordinates. The rounding error of bringing them into range is subtracted too.
/// Throws: std::invalid_argument as check() does, for a start that is not a solution of the
/// problem, and for a caller's distance that is negative or NaN.
[[nodiscard]] LowerBound lower_bound(const FacilityPoints& problem, const FacilitySolution& start,
                                     const LowerBoundOptions& options = {.steps = 100});
[[nodiscard]] LowerBound lower_bound(const FacilityEntities& problem, const FacilitySolution& start,
                                     const LowerBoundOptions& options = {.steps = 100});

using Segment = std::array<Point3, 2>;
using Triangle = std::array<Point3, 3>;

/// Distances for entities: the root mean square distance by which the corners of one entity must
/// move to coincide with those of the other, under the best correspondence of corners. There are
/// two correspondences for a segment, six for a triangle, and two for a polyline, whose vertices
/// keep their order (forward and backward). So neither direction nor the first corner of a triangle
/// matters, and moving an entity by v is a distance of |v|.
///
/// These are metrics on entities without direction. For a renumbering g, |a - g b| is the Euclidean
/// distance of all coordinates, which does not change if both are renumbered. So with the best g
/// and h d(a, c) <= |a - g h c| <= |a - g b| + |g b - g h c| = d(a, b) + d(b, c). They are
/// symmetric for the same reason, and 0 only for equal entities. Coordinates must be finite. A
/// result that overflows a double is infinite.
[[nodiscard]] double segment_distance(const Segment& a, const Segment& b);
[[nodiscard]] double triangle_distance(const Triangle& a, const Triangle& b);
/// Requires: both have the same number of vertices, at least one.
[[nodiscard]] double polyline_distance(std::span<const Point3> a, std::span<const Point3> b);

}  // namespace terrace::cluster
