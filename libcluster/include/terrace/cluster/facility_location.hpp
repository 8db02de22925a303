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

/// Uncapacitated facility location: open facilities are paid for, each client is connected to one,
/// and
///     Q = sum of opening costs + sum of connection costs
/// is minimised. A problem is given as points under a metric, as entities with a distance function,
/// or as a matrix of costs; solve() accepts each of them, and lower_bound() bounds the distance of
/// the result from the optimum. Source: J. Skála, Algorithms for manipulating large geometric data,
/// 4.2.3, 7.1 and 7.3; the sources of each strategy are listed there.

namespace terrace::cluster {

/// Points under a metric: every point is a client and a possible facility, all facilities cost the
/// same, and connecting client i costs weights[i] times its distance from the facility.
struct FacilityPoints {
  std::span<const Point3> points = {};   ///< finite
  std::span<const double> weights = {};  ///< positive and finite, or empty for 1 each
  Metric metric = Euclidean{};           ///< a custom one may be called by several threads at once
  Channels channels = {};                ///< empty: position only
  /// Positive; multiplied by the diagonal of the bounding box in the metric, with channels as
  /// further axes.
  double facility_cost = 1.0;
  /// The cost of leaving out a client of weight 1, as a multiple of the same diagonal; infinite:
  /// every client is connected. (7.1.3, figure 7.3)
  double outlier_price = std::numeric_limits<double>::infinity();
};

/// Anything with distances (triangles, segments, words), by number: every entity is a client and a
/// possible facility. (chapter 9)
struct FacilityEntities {
  std::size_t count = 0;
  /// From a facility to a client: finite, not negative, 0 from an entity to itself. Called by
  /// several threads at once if the search uses several.
  std::function<double(std::uint32_t facility, std::uint32_t client)> distance = {};
  bool symmetric = false;            ///< distance(a, b) == distance(b, a) always
  bool triangle_inequality = false;  ///< distance(a, c) <= distance(a, b) + distance(b, c) always
  std::span<const double> weights = {};  ///< positive and finite, or empty for 1 each
  double facility_cost = 1.0;            ///< positive, in the unit of the distances
  /// The cost of leaving out an entity of weight 1, in that unit; infinite: every entity is
  /// connected.
  double outlier_price = std::numeric_limits<double>::infinity();
};

/// The general problem: any costs, metric or not.
struct FacilityMatrix {
  std::size_t facilities = 0, clients = 0;
  std::span<const double> opening = {};     ///< one per facility; not negative, finite
  std::span<const double> connection = {};  ///< [facility * clients + client]; likewise

  [[nodiscard]] double cost(std::size_t facility, std::size_t client) const {
    return connection[facility * clients + client];
  }
};

/// Throws: std::invalid_argument for sizes that do not match, no facilities or clients, more than
/// 2^32 - 2 of either, coordinates, weights or channels that are not finite, weights or costs out
/// of range, a missing function; the message names the index.
void check(const FacilityPoints& problem);
void check(const FacilityEntities& problem);
void check(const FacilityMatrix& problem);

/// A client that is connected to no facility because leaving it out was cheaper.
inline constexpr std::uint32_t kOutlier = 0xffffffff;

/// A solution. Clusters are numbered by ascending facility.
struct FacilitySolution {
  std::vector<std::uint32_t> facilities;  ///< open ones, ascending
  std::vector<std::uint32_t> assignment;  ///< per client: position in `facilities`, or kOutlier
  double opening_cost = 0.0;
  double connection_cost = 0.0;
  double outlier_cost = 0.0;
  double lower_bound = 0.0;  ///< no solution of the problem costs less; 0: not computed

  [[nodiscard]] double cost() const { return opening_cost + connection_cost + outlier_cost; }
  /// The share by which the cost may exceed the optimum: 0.01 is one per cent; infinite without a
  /// bound.
  [[nodiscard]] double gap() const {
    if (cost() <= lower_bound) return 0.0;
    return lower_bound > 0.0 ? cost() / lower_bound - 1.0 : std::numeric_limits<double>::infinity();
  }
};

/// Strategies of three kinds.
///
/// Local search over points and entities: Meyerson's start, then random candidates, each of which
/// is opened if its gain (the cost this saves) is positive. The strategies from full_scan to
/// facilities differ in how they compute a gain (7.3.2; n clients); they give the same gains to the
/// last bit, hence the same solution. One facility stays open, even if leaving all clients out
/// would be cheaper. Sources: M. Charikar, S. Guha, Improved combinatorial algorithms for the
/// facility location and k-median problems, FOCS 1999; A. Meyerson, Online facility location, FOCS
/// 2001.
/// It differs from the thesis in: longest connections are unweighted distances (weighted ones
/// exclude too much if weights are below 1); a bound excludes facilities from closing before their
/// clients are examined; clients may be left out at a price.
///
/// Block clustering: `fast`.
///
/// Strategies on a matrix. For points and entities the matrix, of 8 n^2 bytes, is made; a client
/// whose connection would cost more than its outlier price is left out at the end.
/// whose connection would cost more than its outlier price is left out at the end.
enum class FacilityStrategy : std::uint8_t {
  /// Points and entities: the first of facilities, kd_tree and full_scan that the distances admit.
  /// Matrix: interchange.
  automatic,
  full_scan,   ///< examines all clients: n distances
  quadtree,    ///< cells of a quadtree over x and y, with their longest connections; not custom
  octree,      ///< cells of an octree; likewise
  kd_tree,     ///< cells of a kd-tree; likewise
  facilities,  ///< clusters as cells; distances must be symmetric, with triangle inequality
  /// BlockClusterer (block.hpp) on linearly mapped points: orders of magnitude faster, within a few
  /// per cent of the local search's cost, and every client at its nearest facility. Requires a
  /// metric that is linear on the bounding box of the points (Euclidean, elliptical, a field
  /// uniform there), no channels, outliers or start, and fewer than 2^24 points.
  fast,
  /// Local search with restarts. The solution is a local optimum: no opening, closing or exchange
  /// of one facility for another improves it (by more than rounding), nor does opening any facility
  /// while closing those whose clients are better off there. O(facilities * clients) per round
  /// through the candidates, some rounds per perturbation; memory O(facilities + clients) per
  /// thread, and a copy of the matrix if its costs exceed 2^900.
  /// Sources: R. Whitaker, A fast algorithm for the greedy interchange, INFOR 1983; M. Resende, R.
  /// Werneck, A fast swap-based local search procedure for location problems, Annals of Operations
  /// Research 2007 (nearest and second nearest open facility).
  interchange,
  /// Primal-dual growth: as time passes, every client not yet connected offers an amount equal to
  /// the time, first for its connection and, with the rest, for opening; a facility opens when
  /// offers reach its opening cost. Offers remain after a client is connected; of facilities that
  /// share a client who paid for both, only the first to open stays open. At the end clients go to
  /// the cheapest open facility, and facilities without clients close. Deterministic: at equal
  /// times the lower number comes first. The duals are feasible; on metric costs the solution costs
  /// at most 3 times their sum, its lower bound. O(facilities * clients * log(facilities *
  /// clients)), 12 bytes per entry of the matrix.
  /// Source: K. Jain, V. Vazirani, Approximation algorithms for metric facility location and
  /// k-median problems using the primal-dual schema and Lagrangian relaxation, J. ACM 2001.
  jain_vazirani,
  /// The same growth, but a client withdraws its other offers when it is connected (as the thesis
  /// describes it). The duals sum to the cost before clients go to the cheapest facility, and are
  /// feasible only after division: by at most 1.861 on metric costs, by at most the harmonic number
  /// of the clients on any. The least divisor that makes them feasible gives the lower bound.
  /// O(facilities * clients * log(clients)), more with many ties; 4 bytes per entry.
  /// Source: M. Mahdian et al., A greedy facility location algorithm analyzed using dual fitting,
  /// APPROX 2001.
  greedy_stars,
  /// Rounds the linear relaxation (programs 4.12 to 4.16 with fractions allowed): in the order of
  /// their duals, each client whose fractional facilities are all still free opens the cheapest of
  /// them and blocks the rest. On metric costs the solution costs at most 4 times the relaxation,
  /// which is its lower bound. For small problems: constraints x <= y are added as they are
  /// violated; 50 by 50 takes hundredths of a second, 100 by 100 tenths. Not thread-safe. Needs
  /// GLPK, see has_lp_rounding().
  /// Sources: D. Shmoys, É. Tardos, K. Aardal, Approximation algorithms for facility location
  /// problems, STOC 1997; F. Chudak, D. Shmoys, Improved approximation algorithms for the
  /// uncapacitated facility location problem, SIAM J. Computing 2003 (clusters by duals).
  lp_rounding,
};

/// "automatic", "full scan", "quadtree", "octree", "kd-tree", "facilities", "fast", "interchange",
/// "Jain-Vazirani", "greedy stars", "LP rounding".
[[nodiscard]] const char* name_of(FacilityStrategy strategy);

/// Whether the library was built with GLPK (-Dterrace_glpk=enabled). GLPK's licence,
/// GPL-3.0-or-later, then applies to the library too.
[[nodiscard]] bool has_lp_rounding();

/// Called at intervals in the caller's thread with the steps done and their total. False ends the
/// work: the result is what has been found so far.
using FacilityProgress = std::function<bool(std::size_t done, std::size_t total)>;

struct FacilityOptions {
  FacilityStrategy strategy = FacilityStrategy::automatic;
  Effort effort = Effort::standard;
  /// Interchange: independent searches, at least 1; overrides `effort`.
  std::optional<std::uint32_t> restarts = {};
  /// The exact length; overrides `effort`. Local search: candidates. Interchange: perturbations per
  /// restart. Other strategies ignore it.
  std::optional<std::size_t> steps = {};
  /// Interchange: after this many seconds no further perturbation is begun; the result then depends
  /// on the machine.
  double seconds = std::numeric_limits<double>::infinity();
  std::uint64_t seed = 1;
  /// Includes the caller's; 0: one per core. Does not change the result. Growth, LP rounding and
  /// `fast` use one.
  unsigned threads = 1;
  /// Local search: number of candidates evaluated at once, on the same solution (7.3.3): the one
  /// with the greatest positive gain is opened, those without gain count as tried, other positive
  /// ones are discarded and do not count. Another batch size is another search; 1 is the plain one.
  std::size_t batch = 1;
  /// Local search: finally each client goes to its nearest open facility.
  bool assign_nearest = false;
  /// Local search: a solution to start from instead of Meyerson's. A client may have any facility
  /// in its list; a facility always serves itself; costs are ignored.
  const FacilitySolution* start = nullptr;
  /// Bytes that a matrix made from points or entities may take; 0: no limit.
  std::uint64_t memory_limit = 0;
  /// Local search: progress in candidates.
  FacilityProgress progress = {};
  /// Heard by every strategy except LP rounding.
  base::StopCheck check_stop = {};
};

/// Statistics of a local search, for figures 7.12 to 7.14.
struct SearchStatistics {
  std::size_t candidates = 0;        ///< gains computed, including discarded ones
  std::size_t positive = 0;          ///< candidates with a positive gain
  std::size_t opened = 0;            ///< candidates that were opened
  std::uint64_t inspected = 0;       ///< distances from a candidate to a client or facility
  std::uint64_t vertices = 0;        ///< clients and open facilities, summed over the candidates
  std::size_t wrongly_assigned = 0;  ///< clients with a nearer open facility, before assign_nearest

  [[nodiscard]] double positive_share() const {
    return candidates > 0 ? static_cast<double>(positive) / static_cast<double>(candidates) : 0.0;
  }
  /// Above 1 if distances were computed twice.
  [[nodiscard]] double inspected_share() const {
    return vertices > 0 ? static_cast<double>(inspected) / static_cast<double>(vertices) : 0.0;
  }
};

/// Additional results of a strategy.
struct FacilityReport {
  FacilityStrategy strategy = FacilityStrategy::automatic;  ///< the one chosen by `automatic`
  SearchStatistics search;
  /// Per client. Growth: when it was connected. LP rounding: what it pays in the relaxation.
  std::vector<double> duals;
  /// The lower bound is that of the duals divided by this: the least divisor (to 1e-9) for which no
  /// facility is paid more than it costs. 1 except for greedy_stars.
  double divisor = 1.0;
  /// LP rounding: the fraction to which each facility is open in the relaxation, and its value.
  std::vector<double> fractions;
  double relaxation = 0.0;
};

/// Solves the problem by the strategy of the options, and fills in `report` if given
/// (wrongly_assigned takes O(n * facilities)).
/// The result depends on the problem and the options, but not on threads.
/// Throws: std::invalid_argument as check(problem); for a strategy that the problem does not admit,
/// with the reason; a batch of 0, no restarts, `seconds` that is NaN; a start that is not a
/// solution of the problem, or that the strategy does not accept; a caller's distance that is
/// negative or NaN, naming facility and client; if the matrix of points or entities exceeds the
/// limit or the memory of a strategy cannot be allocated, naming the bytes needed.
/// std::runtime_error if LP rounding is not built in, naming the option, or GLPK fails.
/// Cost of a local search: candidates times a gain, at most O(n), and O(n * facilities) for the
/// start; about 150 bytes per point.
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
  std::vector<double> duals;  ///< the v below, per client
  double lower_bound = 0.0;   ///< L(v) rounded down; not negative
};

struct LowerBoundOptions {
  std::size_t steps = 1000;  ///< subgradient steps; 0: only their starting point
  unsigned threads = 1;      ///< 0: one per core. Does not change the result.
  FacilityProgress progress = {};
  base::StopCheck check_stop = {};
};

/// A lower bound of the cost of every solution, so that a result can state its gap: a value of the
/// Lagrangian dual. Let every client i pay v_i for being connected; a facility is then worth
/// opening if the clients that it connects for less pay for it, and
///     L(v) = sum_i v_i + sum_j min(0, opening_j - sum_i max(0, v_i - c_ij))
/// does not exceed the cost of any solution, *whatever the v are*. So rounding in the search for
/// good v does no harm; only the evaluation matters, and a bound on its rounding errors is
/// subtracted: (terms + 8) epsilon times the sum of the absolute values.
/// Sources: D. Erlenkotter, A dual-based procedure for uncapacitated facility location, Operations
/// Research 1978; G. Cornuejols, M. Fisher, G. Nemhauser, Location of bank accounts to optimize
/// float, Management Science 1977; the thesis's dual program 4.17 to 4.21.
///
/// For a matrix: dual ascent with dual adjustment, then subgradient steps. `start` is a solution,
/// whose cost is the target of the steps (the better it is, the sooner the bound is good); if it
/// has no facilities, a greedy one is made. The bound cannot exceed the value of the linear
/// relaxation. 12 bytes per entry of the matrix, O(facilities * clients) per step.
/// Throws: std::invalid_argument as check(), for a start that is not a solution of the problem, or
/// if memory cannot be allocated, naming the bytes needed.
[[nodiscard]] LowerBound lower_bound(const FacilityMatrix& problem,
                                     const FacilitySolution& start = {},
                                     const LowerBoundOptions& options = {});

/// For points and entities, from a solution: initially its clusters pay for their own facilities.
/// Nothing is stored per pair. If distances to a box can be bounded (all metrics except custom
/// ones), a facility examines only the clients near it: some hundreds per step; a million points
/// take about a second per step on one core. Otherwise O(n^2) per step. Weights, channels and the
/// outlier price count. The bound holds for the distances as computed from the given coordinates;
/// the rounding from bringing them into range is subtracted too.
/// Throws: std::invalid_argument as check(), for a start that is not a solution of the problem, and
/// for a caller's distance that is negative or NaN.
[[nodiscard]] LowerBound lower_bound(const FacilityPoints& problem, const FacilitySolution& start,
                                     const LowerBoundOptions& options = {.steps = 100});
[[nodiscard]] LowerBound lower_bound(const FacilityEntities& problem, const FacilitySolution& start,
                                     const LowerBoundOptions& options = {.steps = 100});

using Segment = std::array<Point3, 2>;
using Triangle = std::array<Point3, 3>;

/// Distances for entities: the root mean square distance by which the corners of one must move to
/// coincide with those of the other, under the best of the correspondences: two for a segment, six
/// for a triangle; for a polyline, whose vertices keep their order, forward and backward. So
/// neither direction nor the first corner of a triangle matters, and moving an entity by v is a
/// distance of |v|.
///
/// These are metrics on entities without direction: for a renumbering g, |a - g b| is the Euclidean
/// distance of all coordinates, which renumbering both does not change; so with the best g and h
/// d(a, c) <= |a - g h c| <= |a - g b| + |g b - g h c| = d(a, b) + d(b, c). They are symmetric
/// likewise, and 0 only for equal entities. Coordinates must be finite; a result that overflows a
/// double is infinite.
[[nodiscard]] double segment_distance(const Segment& a, const Segment& b);
[[nodiscard]] double triangle_distance(const Triangle& a, const Triangle& b);
/// Both must have the same number of vertices, at least one.
[[nodiscard]] double polyline_distance(std::span<const Point3> a, std::span<const Point3> b);

}  // namespace terrace::cluster
