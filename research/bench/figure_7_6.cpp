// SPDX-License-Identifier: GPL-3.0-or-later
// Figure 7.6: memory as a function of block size.
#include <array>
#include <cmath>

#include "allocation.hpp"
#include "setting.hpp"
#include "stream.hpp"

namespace terrace::research {

using namespace cluster;

namespace {

constexpr std::array kBlocks{250,  375,  500,  625,  750,  875,  1000, 1250, 1500, 1750,
                             2000, 2500, 3000, 4000, 5000, 6000, 7500, 9000, 10000};

struct Measured {
  std::size_t bytes = 0;
  std::vector<std::uint64_t> level_points;
};

// Memory does not depend on the length of the search, so the short one suffices.
Measured measure(std::uint64_t points, std::size_t block) {
  const auto set = large_sets()[3].make(points);
  Measured measured;
  const PeakMemory memory;
  {
    StreamOptions options;
    options.block = block;
    StreamClustering stream(options);
    run(*set, {&stream, 1});
    measured.level_points = stream.level_points();
  }
  measured.bytes = memory.bytes();
  return measured;
}

/// Returns points per cluster (m / k) for any block size, interpolated between the measured ones.
double ratio_at(const Series& ratios, double m) {
  std::size_t i = 1;
  while (i + 1 < ratios.x.size() && ratios.x[i] < m) ++i;
  const double share = (m - ratios.x[i - 1]) / (ratios.x[i] - ratios.x[i - 1]);
  return ratios.y[i - 1] + share * (ratios.y[i] - ratios.y[i - 1]);
}

/// Returns the factor that fits `model` to `measured` by least squares.
double fit(const std::vector<double>& model, const std::vector<double>& measured) {
  double both = 0.0;
  double square = 0.0;
  for (std::size_t i = 0; i < model.size(); ++i) {
    both += model[i] * measured[i];
    square += model[i] * model[i];
  }
  return both / square;
}

}  // namespace

void figure_7_6(Setting& setting) {
  const std::uint64_t points = setting.points(1'000'000);
  Table table{"figure-7.6",
              "Figure 7.6: memory. " + grouped(points) + " points (" + large_sets()[3].name() +
                  "), facility cost 1 x diagonal, peak of live heap. m log10(N / m) is equation "
                  "7.5; m l is 7.4 with l, the number of\nlevels above the input, rounded up. (A "
                  "point on a level that waits takes less memory here than one in the search, so "
                  "more levels weigh less than in the thesis.)",
              {"block m", "memory KB", "bytes / m", "levels", "m / k", "m log10(N/m)", "m l"}};
  Series heap{.name = "measured", .mark = Series::Mark::dashes, .colour = "#d55e00"};
  Series ratios;
  std::vector<double> equation, whole;
  const auto smooth_at = [&](double m) { return m * std::log10(static_cast<double>(points) / m); };
  const auto whole_at = [&](double m, double ratio) {
    return m * std::ceil(std::log(static_cast<double>(points) / m) / std::log(ratio));
  };
  for (const int size : kBlocks) {
    const std::size_t block = setting.block(static_cast<std::size_t>(size));
    const Measured measured = measure(points, block);
    const auto& counts = measured.level_points;
    const auto bytes = static_cast<double>(measured.bytes);
    const auto m = static_cast<double>(block);
    heap.x.push_back(m);
    heap.y.push_back(bytes / 1e6);
    ratios.x.push_back(m);
    ratios.y.push_back(static_cast<double>(points) / static_cast<double>(counts[1]));
    equation.push_back(smooth_at(m));
    whole.push_back(whole_at(m, ratios.y.back()));
    table.add({std::to_string(block), fixed(bytes / 1e3, 0), fixed(bytes / m, 0),
               std::to_string(counts.size() - 1), fixed(ratios.y.back(), 1),
               fixed(equation.back(), 0), fixed(whole.back(), 0)});
  }
  setting.report.table(table);

  // The equations give values to which memory is proportional.
  Series smooth{.name = "m log(N / m), fitted", .colour = "#222"};
  Series steps{.name = "m l, whole levels, fitted", .colour = "#0072b2"};
  const double smooth_unit = fit(equation, heap.y);
  const double steps_unit = fit(whole, heap.y);
  const double step = heap.x.back() / 2000;
  for (double m = heap.x.front(); m <= heap.x.back(); m += step) {
    smooth.x.push_back(m);
    smooth.y.push_back(smooth_unit * smooth_at(m));
    steps.x.push_back(m);
    steps.y.push_back(steps_unit * whole_at(m, ratio_at(ratios, m)));
  }
  setting.report.plot("figure-7.6",
                      {.title = "Memory over block size, N = " + grouped(points) + " (figure 7.6)",
                       .x = {.label = "block size m, points", .low = 0.0},
                       .y = {.label = "MB", .low = 0.0},
                       .series = {smooth, steps, heap},
                       .legend_left = true});
}

}  // namespace terrace::research
