// SPDX-License-Identifier: Apache-2.0
// Figure 7.6: memory over the size of blocks.
#include <array>
#include <cmath>

#include "allocation.hpp"
#include "stream.hpp"
#include "tables.hpp"

namespace terrace::cluster::thesis {
namespace {

constexpr std::array kBlocks{250,  375,  500,  625,  750,  875,  1000, 1250, 1500, 1750,
                             2000, 2500, 3000, 4000, 5000, 6000, 7500, 9000, 10000};

struct Measured {
  std::size_t bytes = 0;
  std::vector<std::uint64_t> level_points;
};

// Memory does not depend on the length of the search, so the short one does.
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

}  // namespace

void figure_7_6(Setting& setting) {
  const std::uint64_t points = setting.points(1'000'000);
  Table table{"figure-7.6",
              "Figure 7.6: memory. " + grouped(points) + " points (" + large_sets()[3].name() +
                  "), facility cost 1 x diagonal, peak of live heap. Equation 7.4 is m log(N / m) "
                  "/ log(m / k), with k the mean number of clusters in a block of level 0.",
              {"block", "memory KB", "levels", "m / k", "equation", "whole levels"}};
  Series smooth{.name = "m log(N/m) / log(m/k)", .colour = "#222"};
  Series whole{.name = "whole levels", .colour = "#0072b2"};
  Series heap{.name = "measured", .mark = Series::Mark::dashes, .colour = "#d55e00"};
  double ratio = 0.0;  // points per cluster, of the largest blocks
  std::vector<Measured> all;
  for (const int size : kBlocks) {
    const std::size_t block = setting.block(static_cast<std::size_t>(size));
    all.push_back(measure(points, block));
    ratio = static_cast<double>(points) / static_cast<double>(all.back().level_points[1]);
  }
  const auto levels = [&](double m) {
    return std::log(static_cast<double>(points) / m) / std::log(ratio);
  };
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t block = setting.block(static_cast<std::size_t>(kBlocks[i]));
    const auto m = static_cast<double>(block);
    const auto& counts = all[i].level_points;
    table.add({std::to_string(block), fixed(static_cast<double>(all[i].bytes) / 1e3, 0),
               std::to_string(counts.size() - 1),
               fixed(static_cast<double>(points) / static_cast<double>(counts[1]), 1),
               fixed(m * levels(m), 0), fixed(m * std::ceil(levels(m)), 0)});
    heap.x.push_back(m);
    heap.y.push_back(static_cast<double>(all[i].bytes) / 1e6);
  }
  // The equations count points; what a point takes is what makes them fit the largest block.
  const double last = heap.x.back();
  const double unit = heap.y.back() / (last * std::ceil(levels(last)));
  const double step = last / 1000;
  for (double m = heap.x.front(); m <= last; m += step) {
    smooth.x.push_back(m);
    smooth.y.push_back(unit * m * levels(m));
    whole.x.push_back(m);
    whole.y.push_back(unit * m * std::ceil(levels(m)));
  }
  setting.report.table(table);
  setting.report.plot("figure-7.6", {.title = "Memory over block size, N = " + grouped(points) +
                                              " (figure 7.6); equations at " +
                                              fixed(unit * 1e6, 0) + " bytes a point",
                                     .x = {.label = "block size m, points", .low = 0.0},
                                     .y = {.label = "MB", .low = 0.0},
                                     .series = {smooth, whole, heap}});
}

}  // namespace terrace::cluster::thesis
