// SPDX-License-Identifier: GPL-3.0-or-later
// Table 7.7: the time saved by threads.
#include <array>
#include <stdexcept>

#include "setting.hpp"
#include "stream.hpp"

namespace terrace::research {

using namespace cluster;

namespace {

struct ThesisRow {
  const char* facilities;
  const char* one_gain;
  const char* one_saved;
  const char* several_gains;
  const char* several_saved;
};
constexpr std::array<ThesisRow, 8> kThesis{{{"6:18", "4:04", "35 %", "3:06", "51 %"},
                                            {"3:11:13", "2:01:31", "37 %", "1:32:26", "52 %"},
                                            {"2:34:29", "1:56:06", "25 %", "1:20:43", "48 %"},
                                            {"7:30", "4:43", "37 %", "4:03", "46 %"},
                                            {"7:20", "4:51", "34 %", "3:57", "46 %"},
                                            {"15:23", "10:51", "30 %", "8:07", "47 %"},
                                            {"1:29:00", "1:05:28", "26 %", "46:07", "48 %"},
                                            {"3:41:52", "2:42:07", "27 %", "1:58:15", "47 %"}}};

}  // namespace

void table_7_7(Setting& setting) {
  const std::size_t block = setting.block(10'000);
  const unsigned threads = setting.threads;
  const std::size_t batch = 2 * std::size_t{threads};
  Table table{"table-7.7",
              "Table 7.7: threads (" + std::to_string(threads) + "). Blocks of " + grouped(block) +
                  ", facility cost 2 x diagonal, 0.1 m candidates, partition by facilities; "
                  "seconds in the clustering and time saved.\nSeveral gains: " +
                  std::to_string(batch) +
                  " candidates at once, a different search; the last column has its cost relative "
                  "to the plain one. [..]: the thesis, four threads.",
              {"set", "points", "one thread", "[one]", "one gain", "[one gain]", "saved", "[saved]",
               "several gains", "[several]", "saved", "[saved]", "cost"}};
  for (std::size_t i = 0; i < kThesis.size(); ++i) {
    const NamedSet& named = large_sets()[i];
    const ThesisRow& thesis = kThesis[i];
    const auto set = named.make(setting.points(named.thesis_points));
    StreamOptions options;
    options.block = block;
    options.facility_cost = 2.0;
    std::vector<StreamClustering> streams;
    streams.emplace_back(options);
    options.threads = threads;
    streams.emplace_back(options);
    options.batch = batch;
    streams.emplace_back(options);
    run(*set, streams);
    if (streams[1].cost() != streams[0].cost()) {
      throw std::runtime_error(named.name() + ": one thread and several give different solutions");
    }
    const double one = streams[0].seconds();
    table.add({named.name(), grouped(set->size()), fixed(one, 2), cited(thesis.facilities),
               fixed(streams[1].seconds(), 2), cited(thesis.one_gain),
               time_saved(one, streams[1].seconds()), cited(thesis.one_saved),
               fixed(streams[2].seconds(), 2), cited(thesis.several_gains),
               time_saved(one, streams[2].seconds()), cited(thesis.several_saved),
               percent(streams[2].cost() / streams[0].cost() - 1.0, 2)});
  }
  setting.report.table(table);
}

}  // namespace terrace::research
