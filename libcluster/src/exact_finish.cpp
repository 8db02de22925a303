// SPDX-License-Identifier: Apache-2.0
#include "exact_finish.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace terrace::cluster {
namespace {

double distance(const Point3& a, const Point3& b) {
  const double x = a[0] - b[0];
  const double y = a[1] - b[1];
  const double z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

}  // namespace

double ExactFinish::run(std::span<const Point3> points, std::span<const double> weights,
                        const Scaling& scaling, double facility_cost, BlockClustering& clustering) {
  facilities_.clear();
  for (const std::uint32_t f : clustering.facilities) {
    facilities_.push_back(scaling.scaled(points[f]));
  }
  const auto connection = [&](std::size_t i) {
    const double d = distance(scaling.scaled(points[i]), facilities_[clustering.assignment[i]]);
    return weights.empty() ? d : weights[i] * d;
  };
  const auto sum = [&](double& greatest, std::size_t& where) {
    double total = 0.0;
    greatest = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double c = connection(i);
      total += c;
      if (c > greatest) {
        greatest = c;
        where = i;
      }
    }
    return total;
  };
  double greatest = 0.0;
  std::size_t where = 0;
  double total = sum(greatest, where);
  while (greatest > facility_cost) {
    // It joins behind the facility that it was nearest to, which keeps neighbours together.
    const std::uint32_t number = clustering.assignment[where] + 1;
    const Point3 place = scaling.scaled(points[where]);
    facilities_.insert(facilities_.begin() + number, place);
    clustering.facilities.insert(clustering.facilities.begin() + number,
                                 static_cast<std::uint32_t>(where));
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::uint32_t& a = clustering.assignment[i];
      if (a >= number) ++a;
      const Point3 p = scaling.scaled(points[i]);
      if (distance(p, place) < distance(p, facilities_[a])) a = number;
    }
    total = sum(greatest, where);
  }
  return total;
}

}  // namespace terrace::cluster
