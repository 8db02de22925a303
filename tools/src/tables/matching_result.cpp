// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/matching_result.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/core.h>

#include "base/units.hpp"
#include "cli/output.hpp"
#include "tables/csv_rows.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// One row of the file.
struct Row {
  std::uint32_t a = 0, b = 0;
  double distance = 0;
  std::uint32_t size = 2, level = 1;
};

bool parse(std::string_view text, bool tree, Row& row) {
  return take_cell(text, row.a) && take_cell(text, row.b) && take_cell(text, row.distance, !tree) &&
         (!tree || (take_cell(text, row.size) && take_cell(text, row.level, true)));
}

/// Checks the rows of a result, in the order of the file.
class RowChecker {
 public:
  RowChecker(std::size_t points, bool tree)
      : points_(points), tree_(tree), joined_(tree ? 2 * points : points, false) {
    if (tree) nodes_.assign(2 * points, {1, 0});
  }

  /// Returns the fault of the next row, which follows `rows_before` rows; empty if it is valid.
  std::string fault(const Row& row, std::size_t rows_before) {
    const std::size_t nodes = tree_ ? points_ + rows_before : points_;
    for (const std::uint32_t node : {row.a, row.b}) {
      if (node < nodes) continue;
      if (tree_ && node >= points_ && node < 2 * points_ - 1) {
        return fmt::format("names node {} before the row that creates it", node);
      }
      return fmt::format("names {}{}, but there are {}", tree_ ? "node " : "point ", node,
                         counted(points_, "point"));
    }
    if (row.a == row.b) return fmt::format("joins {} with itself", row.a);
    for (const std::uint32_t node : {row.a, row.b}) {
      if (joined_[node]) return fmt::format("joins {}, which an earlier row has joined", node);
    }
    if (!(row.distance >= 0 && std::isfinite(row.distance))) {
      return "has the distance " + plain_number(row.distance);
    }
    joined_[row.a] = joined_[row.b] = true;
    if (!tree_) return {};
    const Node &a = nodes_[row.a], &b = nodes_[row.b];
    if (row.size != a.size + b.size) {
      return fmt::format("says that its node has {} below; it has {}", counted(row.size, "point"),
                         a.size + b.size);
    }
    if (row.level <= std::max(a.level, b.level)) {
      return fmt::format("is of level {}, not above the nodes that it joins", row.level);
    }
    nodes_[nodes] = {row.size, row.level};
    return {};
  }

 private:
  struct Node {
    std::uint32_t size, level;
  };
  std::size_t points_;
  bool tree_;
  std::vector<bool> joined_;
  std::vector<Node> nodes_;
};

}  // namespace

bool is_matching_result(const std::string& path) {
  return CsvRows::open(path, kPairsHead) || CsvRows::open(path, kTreeHead);
}

MatchingResult read_matching_result(const std::string& path, std::size_t points) {
  const auto format_error = [&](const std::string& cause) {
    return stream::Error(path, cause)
        .remedy(
            "pass the unchanged result of 'terrace match', and with --points the file that it was "
            "made from");
  };
  std::optional<CsvRows> rows = CsvRows::open(path, kPairsHead);
  MatchingResult result{.points = points, .tree = !rows, .lines = {}};
  if (result.tree) rows = CsvRows::open(path, kTreeHead);
  if (!rows) throw format_error("is not a result of 'terrace match'");
  // Tree nodes have 32-bit numbers.
  if (points > std::numeric_limits<std::uint32_t>::max() / 2)
    throw format_error("has too many points");
  const std::size_t max_rows = result.tree ? points - std::min<std::size_t>(points, 1) : points / 2;
  RowChecker row_checker(points, result.tree);
  for (std::string_view line; rows->next(line);) {
    Row row;
    if (!parse(line, result.tree, row)) {
      throw format_error(fmt::format("is not a row {}", result.tree ? kTreeHead : kPairsHead))
          .at(rows->where());
    }
    if (result.lines.size() == max_rows) {
      throw format_error(fmt::format("is one row too many for {}", counted(points, "point")))
          .at(rows->where());
    }
    const std::string fault = row_checker.fault(row, result.lines.size());
    if (!fault.empty()) throw format_error(fault).at(rows->where());
    result.lines.push_back({row.a, row.b, row.level});
    result.top = std::max(result.top, row.level);
  }
  if (result.tree && result.lines.size() < max_rows) {
    throw format_error(fmt::format("has {}; a tree of {} has {}",
                                   counted(result.lines.size(), "row"), counted(points, "point"),
                                   with_commas(max_rows)));
  }
  return result;
}

void MatchingPicture::keep_levels(const std::string& level) {
  if (level.empty() || level == "top") return;
  std::uint32_t highest = 0;
  std::string_view text = level;
  if (!take_cell(text, highest, true) || highest > result.top) {
    throw UsageError(fmt::format(
        "'--level {}': the lines are of the levels 1 to {} (0: points only)", level, result.top));
  }
  std::erase_if(result.lines, [&](const MatchingLine& line) { return line.level > highest; });
}

MatchingPicture read_matching_picture(const std::string& path, const std::string& points_file,
                                      const CommonOptions& common,
                                      const std::function<void(std::uint64_t)>& check_memory) {
  const PointTable table = read_point_table(points_file, "", common.memory_or(0), common);
  // Peak until the picture is drawn, measured.
  const std::uint64_t bytes_per_point = CsvRows::open(path, kTreeHead) ? 120 : 64;
  if (check_memory) check_memory(table.payload.size() + table.size() * bytes_per_point);
  const GroundFrame ground = GroundFrame::of(table, 1.0);
  MatchingPicture picture{.result = read_matching_result(path, table.size()),
                          .positions = {},
                          .assumption = ground.assumption};
  std::vector<stream::Point3>& positions = picture.positions;
  positions.reserve(picture.result.tree ? 2 * table.size() : table.size());
  for (const stream::Point3& p : table.positions) {
    positions.push_back(ground(p));
    for (const double x : positions.back()) {
      if (std::isfinite(x)) continue;
      throw stream::Error(points_file, "has a coordinate that is not finite")
          .at(fmt::format("point {}", positions.size() - 1))
          .remedy("match and draw the points without it");
    }
  }
  if (!picture.result.tree) return picture;
  std::vector<std::uint32_t> sizes(table.size(), 1);
  sizes.reserve(2 * table.size());
  for (const MatchingLine& line : picture.result.lines) {
    const stream::Point3 &a = positions[line.a], &b = positions[line.b];
    const std::uint32_t size = sizes[line.a] + sizes[line.b];
    const double weight_b = static_cast<double>(sizes[line.b]) / size;
    const stream::Point3 mean{(1 - weight_b) * a[0] + weight_b * b[0],
                              (1 - weight_b) * a[1] + weight_b * b[1],
                              (1 - weight_b) * a[2] + weight_b * b[2]};
    positions.push_back(mean);
    sizes.push_back(size);
  }
  return picture;
}

}  // namespace terrace::tools
