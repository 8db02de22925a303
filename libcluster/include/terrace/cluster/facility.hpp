// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "terrace/cluster/metric.hpp"
#include "terrace/cluster/point.hpp"

/// The facility location problem in its two forms, and its solutions: the vocabulary that all
/// strategies share. Open facilities are paid for, each client is connected to one:
///     Q = sum of opening costs + sum of connection costs
/// is to be small. Source: J. Skála, Algorithms for manipulating large geometric data, 4.2.3.

namespace terrace::cluster {

/// A client that is connected to no facility, because leaving it out was cheaper.
inline constexpr std::uint32_t kOutlier = 0xffffffff;

/// The general uncapacitated problem: any costs, metric or not.
struct FacilityMatrix {
  std::size_t facilities = 0, clients = 0;
  std::span<const double> opening;     ///< one per facility; not negative, finite
  std::span<const double> connection;  ///< [facility * clients + client]; not negative, finite

  [[nodiscard]] double cost(std::size_t facility, std::size_t client) const {
    return connection[facility * clients + client];
  }
};

/// Points under a metric: every point is a client and a place for a facility, all facilities cost
/// the same, connecting client i costs weights[i] times its distance from the facility.
struct FacilityPoints {
  std::span<const Point3> points = {};   ///< finite
  std::span<const double> weights = {};  ///< positive and finite, or empty for 1 each
  Metric metric = Euclidean{};
  Channels channels = {};  ///< none: position alone
  /// Positive; times the diagonal of the bounding box in the metric, channels being further axes.
  double facility_cost = 1.0;
  /// What leaving a client of weight 1 out costs, as a multiple of the same diagonal; infinite:
  /// every client is connected. (7.1.3, figure 7.3)
  double outlier_price = std::numeric_limits<double>::infinity();
};

/// A solution. Clusters are numbered by ascending facility.
struct FacilitySolution {
  std::vector<std::uint32_t> facilities;  ///< open ones, ascending
  std::vector<std::uint32_t> assignment;  ///< per client: position in `facilities`, or kOutlier
  double opening_cost = 0.0;
  double connection_cost = 0.0;
  double outlier_cost = 0.0;
  /// No solution of the problem costs less; 0 if nobody has worked one out.
  double lower_bound = 0.0;

  [[nodiscard]] double cost() const { return opening_cost + connection_cost + outlier_cost; }
  /// By which share the cost may exceed the optimum: 0.01 is one per cent; infinite without a
  /// bound.
  [[nodiscard]] double gap() const {
    if (cost() <= lower_bound) return 0.0;
    return lower_bound > 0.0 ? cost() / lower_bound - 1.0 : std::numeric_limits<double>::infinity();
  }
};

/// Throws: std::invalid_argument on sizes that do not fit together, none of either, more than 2^32
/// - 2, and on a cost that is negative, infinite or missing (NaN), naming its facility and client.
void check(const FacilityMatrix& problem);

/// Throws: std::invalid_argument on no points, sizes that do not fit together, coordinates, weights
/// or channels that are not finite, weights or costs out of range, naming the index.
void check(const FacilityPoints& problem);

}  // namespace terrace::cluster
