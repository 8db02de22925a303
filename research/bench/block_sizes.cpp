// SPDX-License-Identifier: GPL-3.0-or-later
// Tables 7.1 and 7.5: the size of blocks.
#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "allocation.hpp"
#include "setting.hpp"
#include "stream.hpp"

namespace terrace::research {

using namespace cluster;

namespace {

struct ThesisRow {
  std::size_t block;
  std::array<const char*, 5> table_7_1;  // time, memory, clusters of levels 1, 2, 3
  std::array<const char*, 6> table_7_5;  // times, percent, errors
};
constexpr std::array<ThesisRow, 6> kThesis{
    {{500,
      {"0:20", "2.23", "35 126", "516", "15"},
      {"0:20:18", "0:01:33", "7.6 %", "0", "1.3 %", "29.9 %"}},
     {1250,
      {"1:01", "4.44", "29 047", "404", "-"},
      {"1:01:24", "0:02:41", "4.4 %", "0", "1.5 %", "14.8 %"}},
     {2500,
      {"1:58", "3.97", "28 400", "366", "-"},
      {"1:58:00", "0:04:29", "3.8 %", "0.2 %", "1.6 %", "5.0 %"}},
     {5000,
      {"3:51", "4.09", "28 298", "337", "-"},
      {"3:51:01", "0:07:45", "3.4 %", "0.5 %", "1.7 %", "4.9 %"}},
     {7500,
      {"5:43", "5.27", "28 270", "336", "-"},
      {"5:43:21", "0:11:09", "3.3 %", "0.5 %", "1.7 %", "3.5 %"}},
     {10000,
      {"7:36", "5.78", "28 062", "303", "-"},
      {"7:36:36", "0:14:32", "3.2 %", "0.8 %", "1.6 %", "3.2 %"}}}};

const NamedSet& lucy() { return large_sets()[3]; }

/// One pass over the scan that stands in for Lucy, with m ceil(log10 m) candidates per block and
/// the partition by facilities.
struct BlockSizeRun {
  std::size_t block = 0;
  double seconds = 0.0;
  std::size_t peak_bytes = 0;
  std::vector<std::uint64_t> level_points = {};
  std::vector<double> costs = {};  ///< costs of the blocks of level 0
};

BlockSizeRun run_once(std::uint64_t points, std::size_t block, Effort effort,
                      FacilityStrategy strategy) {
  const auto set = lucy().make(points);
  BlockSizeRun result{.block = block};
  result.costs.reserve(static_cast<std::size_t>(points / block + 1));
  const PeakMemory memory;
  {
    StreamOptions options;
    options.block = block;
    options.effort = effort;
    options.strategy = strategy;
    StreamClustering stream(options, [&](const StreamBlock& b) { result.costs.push_back(b.cost); });
    run(*set, {&stream, 1});
    result.seconds = stream.seconds();
    result.level_points = stream.level_points();
  }
  result.peak_bytes = memory.bytes();
  return result;
}

/// The increase of the cost of the blocks by the short search.
struct Errors {
  double low = std::numeric_limits<double>::infinity(), mean = 0.0, high = -low;
};
Errors errors_of(const BlockSizeRun& tenth, const BlockSizeRun& full) {
  Errors errors;
  for (std::size_t b = 0; b < full.costs.size(); ++b) {
    const double error = tenth.costs[b] / full.costs[b] - 1.0;
    errors.low = std::min(errors.low, error);
    errors.high = std::max(errors.high, error);
    errors.mean += error / static_cast<double>(full.costs.size());
  }
  return errors;
}

std::vector<std::string> row_7_5(const std::string& name, const BlockSizeRun& tenth,
                                 const BlockSizeRun& full) {
  const Errors errors = errors_of(tenth, full);
  return {name,
          fixed(full.seconds, 2),
          fixed(tenth.seconds, 2),
          percent(tenth.seconds / full.seconds),
          percent(errors.low),
          percent(errors.mean),
          percent(errors.high)};
}

/// Returns the runs for the six block sizes of both tables, which share them.
const std::vector<BlockSizeRun>& block_size_runs(const Setting& setting) {
  static const std::vector<BlockSizeRun> runs = [&] {
    std::vector<BlockSizeRun> results;
    for (const ThesisRow& row : kThesis) {
      results.push_back(run_once(setting.points(lucy().thesis_points), setting.block(row.block),
                                 Effort::fine, FacilityStrategy::facilities));
    }
    return results;
  }();
  return runs;
}

}  // namespace

void table_7_1(Setting& setting) {
  const std::uint64_t points = setting.points(lucy().thesis_points);
  Table table{"table-7.1",
              "Table 7.1: block size. " + grouped(points) + " points (" + lucy().name() +
                  "), facility cost 1 x diagonal, m ceil(log10 m) candidates, partition by "
                  "facilities, one thread.\n[..]: the thesis, 10 M points.",
              {"block", "time s", "[h:m]", "memory MB", "[MB]", "level 1", "[level 1]", "level 2",
               "[level 2]", "level 3", "[level 3]"}};
  const auto& runs = block_size_runs(setting);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const auto& thesis = kThesis[i].table_7_1;
    std::vector<std::string> row{
        std::to_string(runs[i].block), fixed(runs[i].seconds, 2), cited(thesis[0]),
        fixed(static_cast<double>(runs[i].peak_bytes) / 1e6, 2), cited(thesis[1])};
    for (std::size_t level = 1; level <= 3; ++level) {
      const auto& counts = runs[i].level_points;
      row.push_back(level < counts.size() ? grouped(counts[level]) : "-");
      row.push_back(cited(thesis[level + 1]));
    }
    table.add(row);
  }
  setting.report.table(table);
}

void table_7_5(Setting& setting) {
  const std::uint64_t points = setting.points(lucy().thesis_points);
  const std::size_t largest = setting.block(kThesis.back().block);
  const std::uint64_t subset = std::min<std::uint64_t>(points, 10 * largest);
  Table table{"table-7.5",
              "Table 7.5: 0.1 m against m ceil(log10 m) candidates. " + grouped(points) +
                  " points (" + lucy().name() +
                  "), partition by facilities, which gives the full scan's solution; last row: the "
                  "full scan on the first " +
                  grouped(subset) + " points.\n[..]: the thesis, 10 M points, full scan.",
              {"block", "m log m s", "0.1 m s", "time used", "min. error", "avg.", "max.",
               "[m log m]", "[0.1 m]", "[time used]", "[min.]", "[avg.]", "[max.]"}};
  const auto& runs = block_size_runs(setting);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const BlockSizeRun tenth =
        run_once(points, runs[i].block, Effort::standard, FacilityStrategy::facilities);
    auto row = row_7_5(std::to_string(runs[i].block), tenth, runs[i]);
    for (const char* figure : kThesis[i].table_7_5) row.push_back(cited(figure));
    table.add(row);
  }
  const BlockSizeRun tenth =
      run_once(subset, largest, Effort::standard, FacilityStrategy::full_scan);
  const BlockSizeRun full = run_once(subset, largest, Effort::fine, FacilityStrategy::full_scan);
  auto row = row_7_5(std::to_string(largest) + ", full scan", tenth, full);
  for (const char* figure : kThesis.back().table_7_5) row.push_back(cited(figure));
  table.add(row);
  setting.report.table(table);
}

}  // namespace terrace::research
