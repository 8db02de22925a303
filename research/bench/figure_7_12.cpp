// SPDX-License-Identifier: GPL-3.0-or-later
// Figure 7.12: points that are not connected to their nearest facility.
#include <cmath>
#include <random>

#include "facility/points/local_search.hpp"
#include "inputs.hpp"
#include "setting.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::research {

using namespace cluster;

namespace {

constexpr std::size_t kPoints = 1640;
constexpr std::uint64_t kSeeds = 20;

/// Makes points of which half are uniform in a rectangle and half are in twelve clumps there.
std::vector<Point3> make_points() {
  std::mt19937_64 random(12);
  std::vector<Point3> heaps(12);
  for (Point3& p : heaps) p = {1.5 * inputs::uniform(random), inputs::uniform(random), 0.0};
  std::vector<Point3> points;
  while (points.size() < kPoints) {
    Point3 p{1.5 * inputs::uniform(random), inputs::uniform(random), 0.0};
    if (points.size() % 2 == 1) {
      const Point3& heap = heaps[random() % heaps.size()];
      p = {heap[0] + 0.06 * inputs::bell(random), heap[1] + 0.06 * inputs::bell(random), 0.0};
    }
    if (p[0] >= 0.0 && p[0] <= 1.5 && p[1] >= 0.0 && p[1] <= 1.0) points.push_back(p);
  }
  return points;
}

Plot scatter(const std::string& title, const std::vector<Point3>& points,
             const FacilitySolution& solution) {
  Series right{.name = "", .mark = Series::Mark::dots, .size = 2.0, .colour = "#9ec5e5"};
  Series wrong{.name = "", .mark = Series::Mark::dots, .size = 2.6, .colour = "#000"};
  Series open{.name = "", .mark = Series::Mark::dots, .size = 4.5, .colour = "#d55e00"};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto to = [&](std::uint32_t facility) {
      return distance(Euclidean{}, points[facility], points[i]);
    };
    const double own = to(solution.facilities[solution.assignment[i]]);
    bool nearest = true;
    for (const std::uint32_t facility : solution.facilities) nearest &= own <= to(facility);
    Series& series = nearest ? right : wrong;
    series.x.push_back(points[i][0]);
    series.y.push_back(points[i][1]);
  }
  for (const std::uint32_t facility : solution.facilities) {
    open.x.push_back(points[facility][0]);
    open.y.push_back(points[facility][1]);
  }
  return {.title = title,
          .x = {.label = "facilities orange, wrongly assigned points black",
                .low = -0.02,
                .high = 1.52},
          .y = {.label = "", .low = -0.02, .high = 1.02},
          .series = {right, wrong, open},
          .equal_scales = true};
}

}  // namespace

void figure_7_12(Setting& setting) {
  const std::vector<Point3> points = make_points();
  Table table{"figure-7.12",
              "Figure 7.12: " + grouped(kPoints) +
                  " points in one block, facility cost 1 x diagonal; means of " +
                  std::to_string(kSeeds) +
                  " seeds. Wrongly assigned: some open facility is "
                  "nearer.\n[..]: the thesis, one run on other points.",
              {"candidates", "facilities", "cost", "[cost]", "more", "[more]", "wrongly assigned",
               "share"}};
  double full_cost = 0.0;
  for (const Effort effort : {Effort::fine, Effort::standard}) {
    const bool full = effort == Effort::fine;
    double cost = 0.0;
    double facilities = 0.0;
    double wrong = 0.0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      FacilityReport report;
      const FacilitySolution solution =
          solve(FacilityPoints{.points = points}, {.effort = effort, .seed = seed}, &report);
      cost += solution.cost() / static_cast<double>(kSeeds);
      facilities += static_cast<double>(solution.facilities.size()) / static_cast<double>(kSeeds);
      wrong += static_cast<double>(report.search.wrongly_assigned) / static_cast<double>(kSeeds);
      if (seed > 1) continue;
      const std::size_t candidates = candidate_count(effort, kPoints);
      setting.report.plot(
          full ? "figure-7.12a" : "figure-7.12b",
          scatter("After " + std::to_string(candidates) + " candidates: cost " +
                      fixed(solution.cost(), 1) + ", " +
                      std::to_string(report.search.wrongly_assigned) + " points wrongly assigned",
                  points, solution));
    }
    if (full) full_cost = cost;
    table.add({std::to_string(candidate_count(effort, kPoints)), fixed(facilities, 1),
               fixed(cost, 1), full ? "[187]" : "[194.6]",
               full ? "-" : percent(cost / full_cost - 1.0), full ? "[-]" : "[4 %]",
               fixed(wrong, 1), percent(wrong / static_cast<double>(kPoints), 2)});
  }
  setting.report.table(table);
}

}  // namespace terrace::research
