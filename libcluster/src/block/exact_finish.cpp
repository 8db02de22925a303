// SPDX-License-Identifier: Apache-2.0
#include "block/exact_finish.hpp"

#include <cmath>
#include <cstddef>

#include <terrace/base/stop_check.hpp>

namespace terrace::cluster {
namespace {

double distance(const Point3& a, const Point3& b) {
  const double x = a[0] - b[0];
  const double y = a[1] - b[1];
  const double z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

}  // namespace

ExactFinish::Costs ExactFinish::costs(std::span<const Point3> points,
                                      std::span<const double> weights, const Scaling& scaling,
                                      const BlockClustering& clustering) const {
  Costs costs;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double c = distance(scaling.scaled(points[i]), facilities_[clustering.assignment[i]]);
    if (!weights.empty()) c *= weights[i];
    costs.sum += c;
    if (c > costs.greatest) {
      costs.greatest = c;
      costs.where = static_cast<std::uint32_t>(i);
    }
  }
  return costs;
}

double ExactFinish::run(std::span<const Point3> points, std::span<const double> weights,
                        const Scaling& scaling, double facility_cost,
                        const base::StopCheck& check_stop, BlockClustering& clustering) {
  facilities_.clear();
  for (const std::uint32_t f : clustering.facilities) {
    facilities_.push_back(scaling.scaled(points[f]));
  }
  Costs present = costs(points, weights, scaling, clustering);
  while (present.greatest > facility_cost) {
    if (check_stop) check_stop();
    // The new cluster follows the one that it splits, which keeps neighbours together.
    const std::uint32_t number = clustering.assignment[present.where] + 1;
    const Point3 place = scaling.scaled(points[present.where]);
    facilities_.insert(facilities_.begin() + number, place);
    clustering.facilities.insert(clustering.facilities.begin() + number, present.where);
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::uint32_t& a = clustering.assignment[i];
      if (a >= number) ++a;
      const Point3 p = scaling.scaled(points[i]);
      if (distance(p, place) < distance(p, facilities_[a])) a = number;
    }
    present = costs(points, weights, scaling, clustering);
  }
  return present.sum;
}

}  // namespace terrace::cluster
