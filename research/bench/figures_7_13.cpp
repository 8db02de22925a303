// SPDX-License-Identifier: GPL-3.0-or-later
// Figures 7.13 and 7.14: how often a gain is positive, and how much of the problem is inspected,
// over the course of a search and for several facility costs.
#include <algorithm>
#include <array>
#include <random>

#include "facility/points/local_search.hpp"
#include "sets.hpp"
#include "setting.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::research {

using namespace cluster;

namespace {

constexpr std::array kCosts{0.25, 0.5, 1.0, 2.0, 4.0};
constexpr std::size_t kBins = 50;

/// Sums over the blocks, per bin of candidates.
struct Course {
  std::array<SearchStatistics, kBins> bins{};
};

struct Blocks {
  std::vector<std::vector<Point3>> blocks;
  std::size_t per_bin;  // candidates per bin

  explicit Blocks(const Setting& setting)
      : blocks(setting.is_small() ? 2 : 20), per_bin(setting.is_small() ? 2 : 20) {
    const std::uint64_t points = setting.points(1'000'000);
    const auto set = large_sets()[3].make(points);
    const std::size_t size = setting.block(10'000);
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      blocks[b].resize(size);
      set->read(b * ((points - size) / blocks.size()), blocks[b]);
    }
  }
};

Course follow(const Blocks& blocks, double facility_cost, FacilityStrategy strategy) {
  Course course;
  std::uint64_t seed = 0;
  for (const auto& points : blocks.blocks) {
    std::mt19937_64 random(++seed);
    const auto search =
        make_search(FacilityPoints{.points = points, .facility_cost = facility_cost}, strategy);
    search->start(random);
    SearchStatistics before = search->statistics();
    for (SearchStatistics& bin : course.bins) {
      (void)search->improve(blocks.per_bin, random);
      const SearchStatistics now = search->statistics();
      bin.candidates += now.candidates - before.candidates;
      bin.positive += now.positive - before.positive;
      bin.inspected += now.inspected - before.inspected;
      bin.vertices += now.vertices - before.vertices;
      before = now;
    }
  }
  return course;
}

using Share = double (SearchStatistics::*)() const;

/// Reports one curve per facility cost: a table of five stages and, for the plot, all bins.
void report_courses(Setting& setting, const std::string& name, const std::string& title,
                    const std::string& label, const std::array<Course, kCosts.size()>& courses,
                    std::size_t per_bin, Share share) {
  Table table{name, title, {"candidates"}};
  Table data{name + "-course", "", {"candidates"}};
  Plot plot{
      .title = label,
      .x = {.label = "candidates tried", .low = 0.0, .high = static_cast<double>(kBins * per_bin)},
      .y = {.label = "share", .low = 0.0}};
  for (std::size_t c = 0; c < kCosts.size(); ++c) {
    const std::string cost = "fc = " + fixed(kCosts[c], kCosts[c] < 0.5 ? 2
                                                        : kCosts[c] < 1 ? 1
                                                                        : 0);
    table.columns.push_back(cost);
    data.columns.push_back(cost);
    Series series{.name = cost};
    for (std::size_t bin = 0; bin < kBins; ++bin) {
      series.x.push_back((static_cast<double>(bin) + 0.5) * static_cast<double>(per_bin));
      series.y.push_back((courses[c].bins[bin].*share)());
    }
    plot.series.push_back(std::move(series));
  }
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const std::string last = std::to_string((bin + 1) * per_bin);
    std::vector<std::string> row{std::to_string(bin * per_bin) + "-" + last};
    for (const Course& course : courses) row.push_back(fixed((course.bins[bin].*share)(), 4));
    data.add(row);
    if (bin == 0 || bin % 12 == 1 || bin + 1 == kBins) table.add(row);
  }
  setting.report.table(table);
  setting.report.data(data);
  setting.report.plot(name, plot);
}

std::array<Course, kCosts.size()> all_courses(const Blocks& blocks, FacilityStrategy strategy) {
  std::array<Course, kCosts.size()> courses;
  for (std::size_t c = 0; c < kCosts.size(); ++c) courses[c] = follow(blocks, kCosts[c], strategy);
  return courses;
}

std::string sample(const Blocks& blocks) {
  return std::to_string(blocks.blocks.size()) + " blocks of " +
         grouped(blocks.blocks.front().size()) + " points (" + large_sets()[3].name() +
         "), facility costs in diagonals";
}

}  // namespace

void figure_7_13(Setting& setting) {
  const Blocks blocks(setting);
  report_courses(setting, "figure-7.13",
                 "Figure 7.13: share of positive gains. " + sample(blocks) +
                     ".\nThe thesis: all positive at first, fewer later, especially for great "
                     "facility costs.",
                 "Share of positive gains (figure 7.13)",
                 all_courses(blocks, FacilityStrategy::facilities), blocks.per_bin,
                 &SearchStatistics::positive_share);
}

void figure_7_14(Setting& setting) {
  const Blocks blocks(setting);
  for (const FacilityStrategy strategy :
       {FacilityStrategy::facilities, FacilityStrategy::kd_tree}) {
    const std::string name = name_of(strategy);
    report_courses(
        setting, "figure-7.14-" + name,
        "Figure 7.14, " + name + ": share of clients and facilities inspected. " + sample(blocks) +
            ".\nThe thesis: more at first, less for small facility costs.",
        "Share of vertices inspected, " + name + " (figure 7.14)", all_courses(blocks, strategy),
        blocks.per_bin, &SearchStatistics::inspected_share);
  }
}

}  // namespace terrace::research
