// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/cli.hpp"
#include "terrace/stream/point.hpp"

namespace terrace::tools {

/// A line of a matching between two nodes. A node is a point (0 to n - 1) or an earlier row (row r
/// is node n + r). A pair is a row of level 1.
struct MatchingLine {
  std::uint32_t a = 0, b = 0;
  std::uint32_t level = 1;
};

/// The result that `match` writes: pairs (rows a,b,distance) or a tree (rows
/// a,b,distance,size,level).
struct MatchingResult {
  std::size_t points = 0;
  bool tree = false;
  std::vector<MatchingLine> lines;  ///< children before parents
  std::uint32_t top = 0;            ///< the highest level; 0 without lines
};

/// Returns whether the first line of a file is one that `match` writes.
bool is_matching_result(const std::string& path);

/// Reads such a file for `points` points. Throws stream::Error, which names the line, if a row is
/// malformed, contradicts itself, or names a node that does not exist yet or that another row has
/// joined. Also throws if the number of rows does not match the points. Memory: 12 bytes per row.
MatchingResult read_matching_result(const std::string& path, std::size_t points);

/// A result with the positions of its nodes, ready to be drawn.
struct MatchingPicture {
  MatchingResult result;
  /// Metres on the ground around the centre: the points, then the nodes of a tree's rows, each at
  /// the mean of all points below it.
  std::vector<stream::Point3> positions;
  std::string assumption;  ///< an assumption about units; may be empty

  /// Removes the lines above a level. Throws UsageError if there is no such level.
  void keep_levels(const std::string& level);
};

/// Reads the result and the file of its points. Before it allocates the nodes, it calls
/// check_memory, if set, with the bytes that the points and the picture take; check_memory may
/// throw. Throws: stream::Error, stream::Stopped.
MatchingPicture read_matching_picture(const std::string& path, const std::string& points_file,
                                      const CommonOptions& common,
                                      const std::function<void(std::uint64_t)>& check_memory = {});

}  // namespace terrace::tools
