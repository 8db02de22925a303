// SPDX-License-Identifier: GPL-3.0-or-later
// Figure 7.21: running time of the Kuhn-Munkres algorithm.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include <terrace/matching/assignment.hpp>

#include "sets.hpp"
#include "setting.hpp"

namespace terrace::research {
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
    const matching::Assignment assignment = matching::assign(costs, n, n);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (!(assignment.cost > 0.0)) throw std::logic_error("the assignment costs 0");
    times.push_back(elapsed.count());
    sum += elapsed.count();
  }
  std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
  return times[times.size() / 2];
}

/// Returns the exponent k of seconds = c * n^k, by least squares on the logarithms.
double exponent(const Series& times) {
  const auto count = static_cast<double>(times.x.size());
  double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (std::size_t k = 0; k < times.x.size(); ++k) {
    const double u = std::log(times.x[k]), v = std::log(times.y[k]);
    x += u;
    y += v;
    xx += u * u;
    xy += u * v;
  }
  return (count * xy - x * y) / (count * xx - x * x);
}

}  // namespace

void figure_7_21(Setting& setting) {
  // Times of one or two microseconds say nothing about growth.
  std::vector<std::size_t> sizes{50, 100, 200, 400, 800, 1600};
  if (setting.is_small()) {
    sizes = {20, 40};
  } else {
    sizes.push_back(3200);
    if (setting.is_full()) sizes.push_back(6400);
  }
  Table table{"figure-7.21",
              "Figure 7.21: seconds of an assignment of n rows to n columns, one thread. Growth is "
              "fitted to all n.\n[..]: the thesis.",
              {"costs", "n", "seconds", "growth", "[growth]"}};
  Plot plot{.title = "Time of the Kuhn-Munkres algorithm (figure 7.21)",
            .x = {.label = "n rows, n columns; " + machine(), .log = true},
            .y = {.label = "seconds", .log = true},
            .legend_left = true};
  for (const bool hard : {false, true}) {
    Series measured{.name = hard ? "cost(i, j) = i j, a hard matrix" : "distances of points",
                    .colour = hard ? "#d55e00" : "#0072b2"};
    for (const std::size_t n : sizes) {
      // These take half a minute or more and show nothing new.
      if (hard && n > (setting.is_full() ? 3200u : 1600u)) continue;
      measured.x.push_back(static_cast<double>(n));
      measured.y.push_back(seconds_of(hard ? products(n) : distances(n), n, setting.is_small()));
    }
    const std::string growth = "n^" + fixed(exponent(measured), 2);
    Series cubic{.name = hard ? "n^3, as in the thesis" : "",
                 .x = measured.x,
                 .mark = Series::Mark::dashes,
                 .colour = measured.colour};
    for (std::size_t k = 0; k < measured.x.size(); ++k) {
      table.add({hard ? "product" : "euclidean", fixed(measured.x[k], 0), exact(measured.y[k]),
                 growth, cited("n^3")});
      cubic.y.push_back(measured.y.back() * std::pow(measured.x[k] / measured.x.back(), 3));
    }
    measured.name += ": " + growth;
    plot.series.push_back(std::move(measured));
    plot.series.push_back(std::move(cubic));
  }
  setting.report.table(table);
  setting.report.plot("figure-7.21", plot);
}

}  // namespace terrace::research
