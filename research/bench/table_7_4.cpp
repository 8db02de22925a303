// SPDX-License-Identifier: GPL-3.0-or-later
// Table 7.4: where the plain search spends its time.
#include <array>
#include <chrono>
#include <random>
#include <vector>

#include "facility/points/local_search.hpp"
#include "sets.hpp"
#include "setting.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::research {

using namespace cluster;

namespace {

struct Times {
  double start = 0.0, gains = 0.0, reassignments = 0.0, total = 0.0;
};

Times search(std::span<const Point3> points) {
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::duration d) { return std::chrono::duration<double>(d).count(); };
  const auto begin = Clock::now();
  Times times;
  std::mt19937_64 random(1);
  const auto search = make_search(FacilityPoints{.points = points}, FacilityStrategy::full_scan);
  search->start(random);
  auto last = Clock::now();
  times.start = seconds(last - begin);
  const std::size_t candidates = candidate_count(Effort::standard, points.size());
  for (std::size_t k = 0; k < candidates; ++k) {
    const auto candidate = static_cast<std::uint32_t>(random() % points.size());
    const bool better = search->gain(candidate) > 0.0;
    const auto judged = Clock::now();
    times.gains += seconds(judged - last);
    if (better) search->open(candidate);
    last = Clock::now();
    times.reassignments += seconds(last - judged);
  }
  times.total = seconds(Clock::now() - begin);
  return times;
}

struct ThesisRow {
  const char* total;
  const char* start;
  const char* gains;
  const char* reassignments;
};
constexpr std::array<ThesisRow, 4> kThesis{{{"23.1", "0.7", "21.5", "0.1"},
                                            {"113.5", "2.3", "107.7", "0.5"},
                                            {"175.1", "2.8", "167.9", "0.5"},
                                            {"524.3", "9.0", "515.1", "1.4"}}};

}  // namespace

void table_7_4(Setting& setting) {
  Table table{"table-7.4",
              "Table 7.4: parts of the plain search. One block, full scan, 0.1 N candidates, "
              "facility cost 1 x diagonal; seconds.\n[..]: the thesis.",
              {"set", "points", "total", "[total]", "initial", "[initial]", "gains", "[gains]",
               "reassignments", "[reass.]", "share of gains"}};
  for (std::size_t i = 0; i < kThesis.size(); ++i) {
    const NamedSet& named = single_sets()[i];
    const std::uint64_t count = named.thesis_points / (setting.is_small() ? 100 : 1);
    std::vector<Point3> points(static_cast<std::size_t>(count));
    named.make(count)->read(0, points);
    const Times times = search(points);
    table.add({named.name(), grouped(count), fixed(times.total, 2), cited(kThesis[i].total),
               fixed(times.start, 3), cited(kThesis[i].start), fixed(times.gains, 2),
               cited(kThesis[i].gains), fixed(times.reassignments, 3),
               cited(kThesis[i].reassignments), percent(times.gains / times.total)});
  }
  setting.report.table(table);
}

}  // namespace terrace::research
