// SPDX-License-Identifier: Apache-2.0
#include "facility/points/search_frame.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include <terrace/base/portable_math.hpp>

#include "facility/points/channel_axis.hpp"
#include "facility/points/search_norms.hpp"
#include "ground.hpp"
#include "scaling.hpp"

namespace terrace::cluster {
namespace {

void multiply(std::vector<Point3>& points, int exponent) {
  if (exponent == 0) return;
  for (Point3& p : points) {
    for (double& x : p) x = std::ldexp(x, exponent);
  }
}

std::vector<Point3> scaled(std::span<const Point3> points, const Scaling& scaling) {
  std::vector<Point3> result(points.size());
  std::transform(points.begin(), points.end(), result.begin(),
                 [&](const Point3& p) { return scaling.scaled(p); });
  return result;
}

// Returns the longest diagonal of a box with one corner at the origin.
double mapped_diagonal(const LinearMap& map, const Point3& extent) {
  double longest = 0.0;
  for (unsigned corner = 0; corner < 4; ++corner) {
    Point3 v = extent;
    if (corner & 1u) v[0] = -v[0];
    if (corner & 2u) v[1] = -v[1];
    longest = std::max(longest, std::sqrt(squared_length(mapped(map, v))));
  }
  return longest;
}

// Combines the positions' diagonal and the channels, as the metric measures the box.
double combined_diagonal(const Metric& metric, const Point3& extent, double positions,
                         const std::vector<double>& ranges) {
  const std::vector<double> origin(ranges.size(), 0.0);
  const auto length = [&](auto norm) {
    return norm(extent[0], extent[1], extent[2], ranges.data(), origin.data(), ranges.size());
  };
  if (std::holds_alternative<SquaredEuclidean>(metric)) return length(SquaredNorm{});
  if (const auto* minkowski = std::get_if<Minkowski>(&metric)) {
    if (std::isinf(minkowski->p)) return length(MaximumNorm{});
    if (minkowski->p == 1.0) return length(CityBlockNorm{});
    return length(PowerNorm{minkowski->p});
  }
  double longest = positions;
  for (const double range : ranges) longest = base::hypot(longest, range);
  return longest;
}

// Brings weights and costs into range. unit_exponent is that of a distance of weight 1.
void set_costs(SearchFrame& frame, double facility_cost, double outlier_price, int unit_exponent) {
  const double heaviest = *std::max_element(frame.weights.begin(), frame.weights.end());
  int weight_exponent = 0;
  std::frexp(heaviest, &weight_exponent);
  for (double& w : frame.weights) w = std::ldexp(w, -weight_exponent);
  frame.true_facility_cost = std::ldexp(facility_cost, unit_exponent);
  // Any cost above all distances leads to one facility.
  frame.facility_cost = std::min(std::ldexp(facility_cost, -weight_exponent), 0x1p1000);
  frame.outlier_price = outlier_price;
  frame.cost_exponent = unit_exponent + weight_exponent;
}

}  // namespace

SearchFrame make_frame(const FacilityPoints& problem) {
  SearchFrame frame;
  const std::size_t count = problem.points.size();
  const Scaling scaling(problem.points);
  int exponent = 0;
  double positions = 0.0;  // the diagonal without channels, in units of 2^exponent
  Point3 extent = scaling.extent;
  const Box3 box = base::box_of(problem.points);
  if (std::holds_alternative<CustomMetric>(problem.metric)) {
    positions = diagonal(problem.metric, box);
    extent = {positions, 0, 0};
  } else {
    frame.points = scaled(problem.points, scaling);
    exponent = scaling.exponent;
    positions = scaling.diagonal;
    const std::optional<LinearMap> linear = linear_map(problem.metric, box);
    if (linear && *linear != kIdentityMap) {
      LinearMap map = *linear;
      int map_exponent = std::numeric_limits<int>::min();
      for (const double m : map) {
        int exponent_of_m = 0;
        std::frexp(m, &exponent_of_m);
        if (m != 0.0) map_exponent = std::max(map_exponent, exponent_of_m);
      }
      for (double& m : map) m = std::ldexp(m, -map_exponent);
      for (Point3& p : frame.points) p = mapped(map, p);
      // Along the longest semi-axis the points may have become tiny.
      const Scaling rescaling(frame.points);
      frame.points = scaled(frame.points, rescaling);
      const int change = map_exponent + rescaling.exponent;
      positions = std::holds_alternative<Elliptical>(problem.metric)
                      ? std::ldexp(mapped_diagonal(map, extent), -rescaling.exponent)
                      : std::ldexp(positions, -change);
      exponent += change;
    }
  }

  frame.channel_count = problem.channels.size();
  std::vector<ChannelAxis> channels;
  int greatest = scaling.diagonal > 0.0 ? exponent : std::numeric_limits<int>::min();
  for (std::size_t c = 0; c < frame.channel_count; ++c) {
    channels.emplace_back(problem.channels, c, count);
    greatest = std::max(greatest, channels.back().exponent);
  }
  // The caller's function needs the original points, hence the original unit.
  if (frame.points.empty() || greatest == std::numeric_limits<int>::min()) greatest = exponent;
  multiply(frame.points, exponent - greatest);
  positions = std::ldexp(positions, exponent - greatest);
  for (double& x : extent) x = std::ldexp(x, exponent - greatest);
  std::vector<double> ranges;
  frame.channels.resize(count * frame.channel_count);
  for (std::size_t c = 0; c < frame.channel_count; ++c) {
    const ChannelAxis& channel = channels[c];
    if (channel.weight == 0.0) continue;  // all its values are zeros
    const int shift = channel.exponent - greatest;
    ranges.push_back(std::ldexp(channel.range, shift));
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t k = i * frame.channel_count + c;
      frame.channels[k] = std::ldexp(channel.value(problem.channels.values[k]), shift);
    }
  }

  const double full_diagonal = combined_diagonal(problem.metric, extent, positions, ranges);
  frame.weights.assign(problem.weights.begin(), problem.weights.end());
  if (frame.weights.empty()) frame.weights.assign(count, 1.0);
  const bool squared = std::holds_alternative<SquaredEuclidean>(problem.metric);
  // If all points are equal there are no outliers, so infinity times zero must not matter.
  const double price = full_diagonal > 0.0 ? problem.outlier_price * full_diagonal
                                           : std::numeric_limits<double>::infinity();
  set_costs(frame, problem.facility_cost * full_diagonal, price, squared ? 2 * greatest : greatest);
  return frame;
}

SearchFrame make_frame(const FacilityEntities& problem) {
  SearchFrame frame;
  frame.weights.assign(problem.weights.begin(), problem.weights.end());
  if (frame.weights.empty()) frame.weights.assign(problem.count, 1.0);
  set_costs(frame, problem.facility_cost, problem.outlier_price, 0);
  return frame;
}

}  // namespace terrace::cluster
