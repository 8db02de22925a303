// SPDX-License-Identifier: GPL-3.0-or-later
// Table 7.6: the time saved by partitions of space.
#include <array>
#include <stdexcept>

#include "setting.hpp"
#include "stream.hpp"

namespace terrace::research {

using namespace cluster;

namespace {

constexpr std::array kStrategies{FacilityStrategy::full_scan,  FacilityStrategy::quadtree,
                                 FacilityStrategy::octree,     FacilityStrategy::kd_tree,
                                 FacilityStrategy::facilities, FacilityStrategy::fast};
constexpr std::size_t kExact = 5;  // all except the last give the same solution

struct ThesisRow {
  const char* time;
  std::array<const char*, 4> saved;
};
constexpr std::array<ThesisRow, 8> kThesis{{{"25:11", {"33 %", "31 %", "78 %", "75 %"}},
                                            {"13:22:55", {"33 %", "31 %", "79 %", "76 %"}},
                                            {"15:16:07", {"35 %", "32 %", "82 %", "83 %"}},
                                            {"30:36", {"32 %", "30 %", "77 %", "76 %"}},
                                            {"33:13", {"33 %", "32 %", "79 %", "78 %"}},
                                            {"1:24:12", {"33 %", "33 %", "81 %", "82 %"}},
                                            {"9:14:39", {"35 %", "33 %", "83 %", "84 %"}},
                                            {"23:12:01", {"35 %", "33 %", "83 %", "84 %"}}}};

}  // namespace

void table_7_6(Setting& setting) {
  const std::size_t block = setting.block(10'000);
  Table table{"table-7.6",
              "Table 7.6: partitions of space. Blocks of " + grouped(block) +
                  ", facility cost 2 x diagonal, 0.1 m candidates, one thread; seconds in the "
                  "clustering and time saved.\nAll except the last give the same solution to the "
                  "last bit; the last is BlockClusterer. [..]: the thesis.",
              {"set", "points", "full scan", "[full scan]", "quadtree", "saved", "[saved]",
               "octree", "saved", "[saved]", "kd-tree", "saved", "[saved]", "facilities", "saved",
               "[saved]", "fast", "saved", "cost"}};
  for (std::size_t i = 0; i < kThesis.size(); ++i) {
    const NamedSet& named = large_sets()[i];
    const auto set = named.make(setting.points(named.thesis_points));
    std::vector<StreamClustering> streams;
    for (const FacilityStrategy strategy : kStrategies) {
      StreamOptions options;
      options.block = block;
      options.facility_cost = 2.0;
      options.strategy = strategy;
      streams.emplace_back(options);
    }
    run(*set, streams);

    const double full = streams[0].seconds();
    std::vector<std::string> row{named.name(), grouped(set->size()), fixed(full, 2),
                                 cited(kThesis[i].time)};
    for (std::size_t s = 1; s < kStrategies.size(); ++s) {
      row.push_back(fixed(streams[s].seconds(), 2));
      row.push_back(time_saved(full, streams[s].seconds()));
      if (s >= kExact) continue;
      row.push_back(cited(kThesis[i].saved[s - 1]));
      if (streams[s].cost() != streams[0].cost() ||
          streams[s].level_points() != streams[0].level_points()) {
        throw std::runtime_error(named.name() + ": " + name_of(kStrategies[s]) +
                                 " and the full scan give different solutions");
      }
    }
    row.push_back(percent(streams[kExact].cost() / streams[0].cost() - 1.0));
    table.add(row);
  }
  setting.report.table(table);
}

}  // namespace terrace::research
