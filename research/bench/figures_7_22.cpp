// SPDX-License-Identifier: GPL-3.0-or-later
// Figures 7.22 to 7.24 (section 7.5.2): how the cost of the Monte Carlo method falls, compared with
// our monotone method and the optimum.
#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include <terrace/matching/halving.hpp>
#include <terrace/matching/point_matching.hpp>

#include "sets.hpp"
#include "setting.hpp"

namespace terrace::research {

using namespace matching;

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

/// One search shown in figures 7.23 and 7.24.
struct SearchRun {
  std::string set;  ///< "100a"
  std::size_t points = 0;
  std::uint64_t iterations = 0;
  double optimum = 0.0;
  HalvingMatching monte_carlo, monotone;

  /// Returns how many per cent the cost is above the optimum after this many iterations.
  [[nodiscard]] double gap_after(std::uint64_t iterations_done, const HalvingMatching& of) const {
    double cost = of.steps.front().cost;
    for (const auto& step : of.steps) {
      if (step.iteration <= iterations_done) cost = step.cost;
    }
    return percent_above(cost, optimum);
  }
};

SearchRun search(const Setting& setting, const std::string& set, std::size_t points,
                 std::uint64_t iterations, std::uint64_t set_seed) {
  const std::vector<matching::Point3> places = uniform_points(points, set_seed);
  // With a hundred points an iteration takes less time than starting a thread.
  const HalvingOptions options{.method = Halving::monte_carlo,
                               .iterations = iterations,
                               .threads = points < 300 ? 1 : setting.threads};
  HalvingOptions monotone = options;
  monotone.method = Halving::monotone;
  return {set,
          points,
          iterations,
          match_points(std::span<const matching::Point3>(places)).cost,
          match_by_halving(places, options),
          match_by_halving(places, monotone)};
}

/// Returns searches on the thesis's three sets of 100 points and one of 500, with as many
/// iterations as in the thesis. For 500 points it is two fifths of them unless --full is given.
const std::vector<SearchRun>& search_runs(const Setting& setting) {
  static const std::vector<SearchRun> runs = [&] {
    const bool small = setting.is_small();
    const std::uint64_t few = small ? 50 : 10'000;
    const std::uint64_t iterations = small ? 20 : setting.is_full() ? 50'000 : 20'000;
    std::vector<SearchRun> results;
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      const std::string set = std::string("100") + "abc"[seed - 1];
      results.push_back(search(setting, set, small ? 20 : 100, few, seed));
    }
    results.push_back(search(setting, "500", small ? 50 : 500, iterations, 4));
    return results;
  }();
  return runs;
}

struct Method {
  const char* name;
  const char* title;
  HalvingMatching SearchRun::*result;
};
constexpr Method kMethods[]{{"monte_carlo", "Monte Carlo, as published", &SearchRun::monte_carlo},
                            {"monotone", "monotone, our extension", &SearchRun::monotone}};

/// Colours of the sets: blue, purple and brown for those of 100 points, green for the one of 500,
/// as in the thesis.
constexpr const char* kColours[]{"#2563b0", "#8e3fa8", "#96602a", "#1f8a4c"};

/// Adds means over more sets than a plot can show.
void add_means(const Setting& setting, std::size_t points, std::uint64_t sets,
               std::uint64_t iterations, Table& table) {
  double sums[2][4]{};
  for (std::uint64_t seed = 1; seed <= sets; ++seed) {
    const SearchRun run = search(setting, "", points, iterations, 100 + seed);
    for (std::size_t m = 0; m < 2; ++m) {
      const HalvingMatching& result = run.*kMethods[m].result;
      sums[m][0] += run.gap_after(10, result);
      sums[m][1] += run.gap_after(points, result);
      sums[m][2] += run.gap_after(2 * points, result);
      sums[m][3] += run.gap_after(iterations, result);
    }
  }
  for (std::size_t m = 0; m < 2; ++m) {
    std::vector<std::string> row{
        "mean of " + std::to_string(sets) + " of " + std::to_string(points), kMethods[m].name};
    for (const double sum : sums[m]) row.push_back(fixed(sum / static_cast<double>(sets), 2));
    row.insert(row.end(), {"-", std::to_string(iterations)});
    table.add(row);
  }
}

/// Appends a stretch of constant cost up to an iteration, and the cost from there on.
void extend(Series& curve, std::uint64_t iteration, double cost) {
  const auto x = static_cast<double>(iteration);
  if (!curve.x.empty()) {
    curve.x.push_back(x);
    curve.y.push_back(curve.y.back());
  }
  curve.x.push_back(x);
  curve.y.push_back(cost);
}

}  // namespace

void figure_7_22(Setting& setting) {
  const std::size_t count = setting.is_small() ? 20 : 100;
  const std::uint64_t iterations = setting.is_small() ? 10 : 100;
  const std::vector<matching::Point3> points = uniform_points(count, 1);
  const double optimum = match_points(std::span<const matching::Point3>(points)).cost;
  Table data{
      "figure-7.22-iterations", "", {"iteration", "cost", "least so far", "above optimum %"}};
  Series each{.name = "cost of the iteration"}, best{.name = "least so far"};
  double sum = 0.0, least = 0.0;
  for (std::uint64_t i = 1; i <= iterations; ++i) {
    // Each iteration depends only on the points and its random halves. Run one by one, each with
    // its own seed, the iterations show costs that the search does not report.
    const double cost =
        match_by_halving(points, {.method = Halving::monte_carlo, .iterations = 1, .seed = i}).cost;
    sum += cost;
    least = i == 1 ? cost : std::min(least, cost);
    each.x.push_back(static_cast<double>(i));
    each.y.push_back(cost);
    extend(best, i, least);
    data.add({std::to_string(i), exact(cost), exact(least), exact(percent_above(cost, optimum))});
  }
  const double mean = sum / static_cast<double>(iterations);
  Table table{"figure-7.22",
              "Figure 7.22: " + std::to_string(count) +
                  " points, the first iterations of the Monte Carlo method, each alone; cost above "
                  "the optimum.\n[the thesis: \"a rather random cost\"]",
              {"iterations", "least", "mean", "most", "correlation with the next"}};
  const double most = *std::max_element(each.y.begin(), each.y.end());
  table.add({std::to_string(iterations), fixed(percent_above(least, optimum), 1) + " %",
             fixed(percent_above(mean, optimum), 1) + " %",
             fixed(percent_above(most, optimum), 1) + " %",
             fixed(correlation_of_neighbours(each.y, mean), 2)});
  setting.report.table(table);
  setting.report.data(data);
  const Series optimum_line{.name = "the optimum",
                            .x = {1.0, static_cast<double>(iterations)},
                            .y = {optimum, optimum},
                            .mark = Series::Mark::dashes};
  setting.report.plot("figure-7.22",
                      {.title = "Iterations of the Monte Carlo method (figure 7.22)",
                       .x = {.label = "iteration, " + std::to_string(count) + " points"},
                       .y = {.label = "sum of distances", .low = 0.0, .high = 1.35 * most},
                       .series = {each, best, optimum_line}});
}

void figure_7_23(Setting& setting) {
  Table table{"figure-7.23",
              "Figure 7.23: the least cost after i iterations, N points, per cent above the "
              "optimum.\n[the thesis advises N or perhaps 10 N iterations]",
              {"set", "method", "i = 10", "N", "2 N", "10 N", "all", "of"}};
  Table data{"figure-7.23-course", "", {"set", "method", "iteration", "cost", "above optimum %"}};
  std::vector<Plot> plots;
  std::size_t colour = 0;
  for (const SearchRun& run : search_runs(setting)) {
    const std::uint64_t n = run.points;
    const std::string label = "iterations, " + std::to_string(n) + " points";
    if (plots.empty() || plots.back().x.label != label) {
      plots.push_back({.title = "The least cost after i iterations (figure 7.23)",
                       .x = {.label = label, .log = true},
                       .y = {.label = "sum of distances", .low = 0.0}});
    }
    for (const Method& method : kMethods) {
      const HalvingMatching& result = run.*method.result;
      const bool published = method.result == &SearchRun::monte_carlo;
      Series curve{.name = "set " + run.set + ", " + method.title,
                   .size = published ? 1.9 : 0.9,
                   .colour = kColours[colour]};
      const auto add = [&](std::uint64_t iteration, double cost) {
        extend(curve, iteration, cost);
        data.add({run.set, method.name, std::to_string(iteration), exact(cost),
                  exact(percent_above(cost, run.optimum))});
      };
      for (const auto& step : result.steps) add(step.iteration, step.cost);
      add(run.iterations, result.cost);  // extends the curve to the last iteration
      std::vector<std::string> row{run.set, method.name};
      for (const std::uint64_t i : {std::uint64_t{10}, n, 2 * n, 10 * n, run.iterations}) {
        row.push_back(i > run.iterations ? "-" : fixed(run.gap_after(i, result), 2));
      }
      row.push_back(std::to_string(run.iterations));
      table.add(row);
      plots.back().series.push_back(std::move(curve));
    }
    plots.back().series.push_back({.name = "",
                                   .x = {1.0, static_cast<double>(run.iterations)},
                                   .y = {run.optimum, run.optimum},
                                   .mark = Series::Mark::dashes,
                                   .colour = kColours[colour]});
    ++colour;
  }
  if (setting.is_small()) {
    add_means(setting, 20, 2, 40, table);
  } else {
    add_means(setting, 100, 20, 1000, table);
    add_means(setting, 500, 5, 5000, table);
  }
  setting.report.table(table);
  setting.report.data(data);
  setting.report.plot("figure-7.23-100", plots.front());
  setting.report.plot("figure-7.23-500", plots.back());
}

void figure_7_24(Setting& setting) {
  Table table{"figure-7.24",
              "Figure 7.24: decreases of the least cost in per cent of the one before.\n"
              "[the thesis: \"less significant\" later]",
              {"set", "method", "first", "second", "third", "last", "at iteration"}};
  Table data{"figure-7.24-decreases", "", {"set", "method", "iteration", "decrease %"}};
  for (const Method& method : kMethods) {
    Plot plot{
        .title = std::string("Decrease of the least cost, ") + method.title + " (figure 7.24)",
        .x = {.label = "iterations", .log = true},
        .y = {.label = "per cent of the cost before", .log = true}};
    std::size_t colour = 0;
    for (const SearchRun& run : search_runs(setting)) {
      const auto& steps = (run.*method.result).steps;
      Series series{.name = "set " + run.set, .size = 0.9, .colour = kColours[colour++]};
      for (std::size_t s = 1; s < steps.size(); ++s) {
        series.x.push_back(static_cast<double>(steps[s].iteration));
        series.y.push_back(100.0 * (1.0 - steps[s].cost / steps[s - 1].cost));
        data.add(
            {run.set, method.name, std::to_string(steps[s].iteration), exact(series.y.back())});
      }
      std::vector<std::string> row{run.set, method.name};
      for (std::size_t s = 0; s < 3; ++s) {
        row.push_back(s < series.y.size() ? fixed(series.y[s], 2) : "-");
      }
      row.push_back(series.y.empty() ? "-" : fixed(series.y.back(), 2));
      row.push_back(series.x.empty() ? "-" : fixed(series.x.back(), 0));
      table.add(row);
      plot.series.push_back(std::move(series));
    }
    setting.report.plot(std::string("figure-7.24-") + method.name, plot);
  }
  setting.report.table(table);
  setting.report.data(data);
}

}  // namespace terrace::research
