// SPDX-License-Identifier: Apache-2.0
// Figure 7.21: running time of the Kuhn-Munkres algorithm.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "figures.hpp"
#include "terrace/matching/assignment.hpp"

namespace terrace::matching::thesis {
namespace {

/// Returns distances from n uniform points to n others, as in one iteration of the Monte Carlo
/// method.
std::vector<double> distances(std::size_t n) {
  const std::vector<Point3> points = uniform_points(2 * n, 21);
  std::vector<double> costs;
  costs.reserve(n * n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = n; j < 2 * n; ++j) {
      const double x = points[i][0] - points[j][0], y = points[i][1] - points[j][1];
      costs.push_back(std::sqrt(x * x + y * y));
    }
  }
  return costs;
}

/// Returns cost(i, j) = i * j, from R. E. Machol and M. Wien, "A hard assignment problem", 1976:
/// nearly every row has to examine all rows assigned before it.
std::vector<double> products(std::size_t n) {
  std::vector<double> costs;
  costs.reserve(n * n);
  for (std::size_t i = 1; i <= n; ++i) {
    for (std::size_t j = 1; j <= n; ++j) costs.push_back(static_cast<double>(i * j));
  }
  return costs;
}

/// Returns the median of three runs, or of more if these are short.
double seconds_of(const std::vector<double>& costs, std::size_t n, bool once) {
  std::vector<double> times;
  double sum = 0.0;
  while (times.empty() || (!once && (times.size() < 3 || (sum < 0.1 && times.size() < 1001)))) {
    const auto start = std::chrono::steady_clock::now();
    const Assignment assignment = assign(costs, n, n);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    if (!(assignment.cost > 0.0)) throw std::logic_error("the assignment costs 0");
    times.push_back(taken.count());
    sum += taken.count();
  }
  std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
  return times[times.size() / 2];
}

struct Time {
  std::size_t n;
  double seconds;
};

/// Returns the exponent k of seconds = c * n^k, by least squares on the logarithms.
double exponent(const std::vector<Time>& times) {
  const auto count = static_cast<double>(times.size());
  double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const Time& time : times) {
    const double u = std::log(static_cast<double>(time.n)), v = std::log(time.seconds);
    x += u;
    y += v;
    xx += u * u;
    xy += u * v;
  }
  return (count * xy - x * y) / (count * xx - x * x);
}

}  // namespace

void figure_7_21(Setting& setting) {
  std::printf("\nFigure 7.21: seconds of an assignment of n rows to n columns, one thread.\n");
  // Times of one or two microseconds say nothing about growth.
  std::vector<std::size_t> sizes{50, 100, 200, 400, 800, 1600};
  if (setting.is_small()) {
    sizes = {20, 40};
  } else {
    sizes.push_back(3200);
    if (setting.size == Setting::Size::full) sizes.push_back(6400);
  }
  Csv csv(setting, "figure_7_21.csv", "matrix,n,seconds,fitted_exponent,cubic_seconds,machine");
  for (const bool hard : {false, true}) {
    const std::string name = hard ? "product" : "euclidean";
    std::vector<Time> times;
    for (const std::size_t n : sizes) {
      // These take half a minute or more and show nothing new.
      if (hard && n > (setting.size == Setting::Size::full ? 3200u : 1600u)) continue;
      times.push_back({n, seconds_of(hard ? products(n) : distances(n), n, setting.is_small())});
      std::printf("%-10s n = %4zu  %.6f s\n", name.c_str(), n, times.back().seconds);
      std::fflush(stdout);
    }
    const double fitted = exponent(times);
    std::printf("%-10s grows as n^%.2f [the thesis: n^3]\n", name.c_str(), fitted);
    for (const Time& time : times) {
      const double ratio = static_cast<double>(time.n) / static_cast<double>(times.back().n);
      csv.row({name, std::uint64_t{time.n}, time.seconds, fitted,
               times.back().seconds * ratio * ratio * ratio, machine()});
    }
  }
  csv.close();
}

}  // namespace terrace::matching::thesis
