// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/cluster_methods.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <variant>

#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;

using cluster::FacilityPoints;
using cluster::FacilitySolution;
using cluster::Point3;

void take(ClusterOutcome& outcome, FacilitySolution&& solution) {
  outcome.opening_cost = solution.opening_cost;
  outcome.connection_cost = solution.connection_cost;
  outcome.outlier_cost = solution.outlier_cost;
  if (solution.lower_bound > 0.0) outcome.lower_bound = solution.lower_bound;
  outcome.representatives = std::move(solution.facilities);
  outcome.labels = std::move(solution.assignment);
}

std::optional<std::vector<Point3>> mapped(const FacilityPoints& problem) {
  cluster::LinearMap m = cluster::kIdentityMap;
  if (const auto* elliptical = std::get_if<cluster::Elliptical>(&problem.metric)) {
    m = elliptical->map();
  } else if (const auto* field = std::get_if<cluster::EllipticalField>(&problem.metric)) {
    const auto uniform = field->uniform_in(cluster::bounds_of(problem.points));
    if (!uniform) return std::nullopt;
    m = *uniform;
  } else if (!std::holds_alternative<cluster::Euclidean>(problem.metric)) {
    return std::nullopt;
  }
  std::vector<Point3> points(problem.points.begin(), problem.points.end());
  if (m == cluster::kIdentityMap) return points;
  for (Point3& p : points) {
    p = {m[0] * p[0] + m[1] * p[1] + m[2] * p[2], m[3] * p[0] + m[4] * p[1] + m[5] * p[2],
         m[6] * p[0] + m[7] * p[1] + m[8] * p[2]};
  }
  return points;
}

std::vector<std::uint32_t> nearest_to_means(std::span<const Point3> points,
                                            std::span<const std::uint32_t> labels,
                                            std::size_t clusters) {
  std::vector<Point3> mean(clusters, Point3{});
  std::vector<double> count(clusters, 0.0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) mean[labels[i]][axis] += points[i][axis];
    count[labels[i]] += 1.0;
  }
  for (std::size_t c = 0; c < clusters; ++c) {
    for (double& v : mean[c]) v /= std::max(count[c], 1.0);
  }
  std::vector<std::uint32_t> representative(clusters, 0);
  std::vector<double> least(clusters, std::numeric_limits<double>::infinity());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const std::uint32_t c = labels[i];
    const double d = cluster::distance(cluster::Euclidean{}, mean[c], points[i]);
    if (d < least[c]) {
      least[c] = d;
      representative[c] = i;
    }
  }
  return representative;
}

void no_channels(const FacilityPoints& problem, const char* method) {
  if (problem.channels.size() > 0) {
    throw UsageError(std::string("--channel is for the methods facility, primal-dual and k-median, "
                                 "not for ") +
                     method);
  }
}

}  // namespace terrace::tools
