// SPDX-License-Identifier: Apache-2.0
// Figures 7.22 to 7.24: how the cost of the Monte Carlo method falls, compared with our monotone
// method and the optimum.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "figures.hpp"
#include "terrace/matching/point_matching.hpp"

namespace terrace::matching::thesis {
namespace {

double percent_above(double cost, double optimum) { return 100.0 * (cost / optimum - 1.0); }

/// Returns the lag-1 autocorrelation of the costs, which is 0 for independent costs.
double correlation_of_neighbours(const std::vector<double>& costs, double mean) {
  double both = 0.0, own = 0.0;
  for (std::size_t i = 0; i < costs.size(); ++i) {
    own += (costs[i] - mean) * (costs[i] - mean);
    if (i > 0) both += (costs[i - 1] - mean) * (costs[i] - mean);
  }
  return own > 0.0 ? both / own : 0.0;
}

SearchRun search(const Setting& setting, const std::string& set, std::size_t points,
                 std::uint64_t iterations, std::uint64_t set_seed) {
  const std::vector<Point3> places = uniform_points(points, set_seed);
  // With a hundred points an iteration takes less time than starting a thread.
  const HalvingOptions options{.method = Halving::monte_carlo,
                               .iterations = iterations,
                               .threads = points < 300 ? 1 : setting.threads};
  HalvingOptions monotone = options;
  monotone.method = Halving::monotone;
  return {set,
          points,
          iterations,
          match_points(std::span<const Point3>(places)).cost,
          match_by_halving(places, options),
          match_by_halving(places, monotone)};
}

/// Returns searches on the thesis's three sets of 100 points and one of 500, with as many
/// iterations as in the thesis. For 500 points it is two fifths of them unless --full is given.
const std::vector<SearchRun>& search_runs(Setting& setting) {
  if (!setting.runs.empty()) return setting.runs;
  const bool small = setting.is_small();
  const std::uint64_t few = small ? 50 : 10'000;
  const std::uint64_t many = small ? 20 : setting.size == Setting::Size::full ? 50'000 : 20'000;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const std::string set = std::string("100") + "abc"[seed - 1];
    setting.runs.push_back(search(setting, set, small ? 20 : 100, few, seed));
  }
  setting.runs.push_back(search(setting, "500", small ? 50 : 500, many, 4));
  return setting.runs;
}

struct Method {
  const char* name;
  HalvingMatching SearchRun::*result;
};
constexpr Method kMethods[]{{"monte_carlo", &SearchRun::monte_carlo},
                            {"monotone", &SearchRun::monotone}};

/// Prints means over more sets than a plot can show.
void print_means(const Setting& setting, std::size_t points, std::uint64_t sets,
                 std::uint64_t iterations) {
  double sums[2][3]{};
  for (std::uint64_t seed = 1; seed <= sets; ++seed) {
    const SearchRun run = search(setting, "", points, iterations, 100 + seed);
    for (std::size_t m = 0; m < 2; ++m) {
      const HalvingMatching& result = run.*kMethods[m].result;
      sums[m][0] += run.gap_after(10, result);
      sums[m][1] += run.gap_after(points, result);
      sums[m][2] += run.gap_after(iterations, result);
    }
  }
  for (std::size_t m = 0; m < 2; ++m) {
    std::printf("mean of %d sets of %zu points, %-11s:", static_cast<int>(sets), points,
                kMethods[m].name);
    for (const double sum : sums[m]) std::printf("%8.2f", sum / static_cast<double>(sets));
    std::printf("  after 10, %zu, %d iterations\n", points, static_cast<int>(iterations));
  }
}

}  // namespace

double SearchRun::gap_after(std::uint64_t iterations_done, const HalvingMatching& of) const {
  double cost = of.steps.front().cost;
  for (const auto& step : of.steps) {
    if (step.iteration <= iterations_done) cost = step.cost;
  }
  return percent_above(cost, optimum);
}

void figure_7_22(Setting& setting) {
  const std::size_t count = setting.is_small() ? 20 : 100;
  const std::uint64_t iterations = setting.is_small() ? 10 : 100;
  const std::vector<Point3> points = uniform_points(count, 1);
  const double optimum = match_points(std::span<const Point3>(points)).cost;
  Csv csv(setting, "figure_7_22.csv", "iteration,cost,least_so_far,above_optimum_percent,optimum");
  std::vector<double> costs;
  double sum = 0.0, least = 0.0;
  for (std::uint64_t i = 1; i <= iterations; ++i) {
    // Each iteration depends only on the points and its random halves. Run one by one, each with
    // its own seed, the iterations show costs that the search does not report.
    costs.push_back(
        match_by_halving(points, {.method = Halving::monte_carlo, .iterations = 1, .seed = i})
            .cost);
    sum += costs.back();
    least = i == 1 ? costs.back() : std::min(least, costs.back());
    csv.row({i, costs.back(), least, percent_above(costs.back(), optimum), optimum});
  }
  csv.close();
  const double mean = sum / static_cast<double>(iterations);
  const double most = *std::max_element(costs.begin(), costs.end());
  std::printf(
      "\nFigure 7.22: %zu points, the first %d iterations, each alone. Above the optimum:\n"
      "least %.1f %%, mean %.1f %%, most %.1f %%; correlation of an iteration with the next "
      "%+.2f\n[the thesis: \"a rather random cost\"]\n",
      count, static_cast<int>(iterations), percent_above(least, optimum),
      percent_above(mean, optimum), percent_above(most, optimum),
      correlation_of_neighbours(costs, mean));
}

void figure_7_23(Setting& setting) {
  Csv csv(setting, "figure_7_23.csv", "set,points,method,iteration,cost,above_optimum_percent");
  std::printf(
      "\nFigure 7.23: the least cost after i iterations, N points, per cent above the optimum.\n"
      "%-5s%-13s%8s%8s%8s%8s%8s  of\n",
      "set", "method", "i = 10", "i = N", "2 N", "10 N", "all");
  for (const SearchRun& run : search_runs(setting)) {
    const std::uint64_t n = run.points;
    for (const Method& method : kMethods) {
      const HalvingMatching& result = run.*method.result;
      for (const auto& step : result.steps) {
        csv.row({run.set, n, std::string(method.name), step.iteration, step.cost,
                 percent_above(step.cost, run.optimum)});
      }
      // Extends the curve to the last iteration.
      csv.row({run.set, n, std::string(method.name), run.iterations, result.cost,
               percent_above(result.cost, run.optimum)});
      std::printf("%-5s%-13s", run.set.c_str(), method.name);
      for (const std::uint64_t i : {std::uint64_t{10}, n, 2 * n, 10 * n, run.iterations}) {
        std::printf("%8s", i > run.iterations ? "-" : fixed(run.gap_after(i, result), 2).c_str());
      }
      std::printf("  %d\n", static_cast<int>(run.iterations));
    }
    for (const std::uint64_t i : {std::uint64_t{1}, run.iterations}) {
      csv.row({run.set, n, std::string("optimum"), i, run.optimum, 0.0});
    }
  }
  csv.close();
  if (setting.is_small()) return print_means(setting, 20, 2, 40);
  print_means(setting, 100, 20, 1000);
  print_means(setting, 500, 5, 5000);
}

void figure_7_24(Setting& setting) {
  Csv csv(setting, "figure_7_24.csv", "set,points,method,iteration,decrease_percent");
  std::printf(
      "\nFigure 7.24: decreases of the least cost in per cent of the one before, first to last:\n");
  for (const SearchRun& run : search_runs(setting)) {
    for (const Method& method : kMethods) {
      const auto& steps = (run.*method.result).steps;
      std::printf("%-5s%-13s", run.set.c_str(), method.name);
      for (std::size_t s = 1; s < steps.size(); ++s) {
        const double decrease = 100.0 * (1.0 - steps[s].cost / steps[s - 1].cost);
        csv.row({run.set, std::uint64_t{run.points}, std::string(method.name), steps[s].iteration,
                 decrease});
        if (s <= 4 || s + 1 == steps.size()) {
          std::printf("%s %.2f (%d)", s + 1 == steps.size() && s > 5 ? " ..." : "", decrease,
                      static_cast<int>(steps[s].iteration));
        }
      }
      std::printf("\n");
    }
  }
  csv.close();
}

}  // namespace terrace::matching::thesis
