// SPDX-License-Identifier: Apache-2.0
#include "facility/points/point_space.hpp"

#include <terrace/base/portable_math.hpp>

namespace terrace::cluster {
namespace {

double length(const Point3& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

double greatest(const LinearMap& map) {
  double result = 0.0;
  for (const double m : map) result = std::max(result, std::abs(m));
  return result;
}

// Returns how many times longer the products that add up to a mapped vector may be than the
// diagonal of the mapped box.
double stretch_of(LinearMap map, const Box3& box) {
  const double largest = greatest(map);
  for (double& m : map) m /= largest;
  // Halves are used, because the sides of a box may be infinite.
  Point3 half{};
  double longest = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    half[axis] = 0.5 * box.max[axis] - 0.5 * box.min[axis];
    longest = std::max(longest, half[axis]);
  }
  if (longest == 0.0) return 1.0;
  for (double& h : half) h /= longest;
  double diagonal = 0.0;
  for (unsigned corner = 0; corner < 4; ++corner) {
    Point3 v = half;
    if (corner & 1u) v[0] = -v[0];
    if (corner & 2u) v[1] = -v[1];
    Point3 mapped{};
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) mapped[r] += map[3 * r + c] * v[c];
    }
    diagonal = std::max(diagonal, length(mapped));
  }
  return diagonal > 0.0 ? 3.0 * length(half) / diagonal : 1.0;
}

}  // namespace

double rounding_of_frame(const FacilityPoints& problem, const SearchFrame& frame) {
  const double diagonal = frame.facility_cost / problem.facility_cost;  // for weight 1
  double weight = 0.0;
  for (const double w : frame.weights) weight += w;
  double unit = 16.0 * std::numeric_limits<double>::epsilon();
  if (const auto* minkowski = std::get_if<Minkowski>(&problem.metric)) {
    unit = base::pow(unit, std::min(1.0, minkowski->p));
  }
  const Box3 box = base::box_of(problem.points);
  double stretch = 1.0;
  if (const std::optional<LinearMap> map = linear_map(problem.metric, box)) {
    stretch = std::max(stretch, stretch_of(*map, box));
  } else if (const auto* field = std::get_if<EllipticalField>(&problem.metric)) {
    for (const auto& region : field->regions()) {
      stretch = std::max(stretch, 3.0 * greatest(region.metric.map()));
    }
  }
  return weight * diagonal * unit * stretch;
}

}  // namespace terrace::cluster
