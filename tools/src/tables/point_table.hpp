// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "cli/cli.hpp"
#include "earth/ground.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::tools {

/// A whole file of points in memory, in the order of reading (that of the file, except for
/// rasters).
struct PointTable {
  stream::SourceInfo info;
  std::vector<stream::Point3> positions;  ///< in the coordinates of the CRS
  std::vector<std::byte> payload;         ///< packed records, see stream::StoreSchema
  std::uint64_t nodata = 0;               ///< left out: see stream::Progress

  [[nodiscard]] std::size_t size() const { return positions.size(); }
  /// The attribute of that name as doubles, scale and offset applied.
  /// Throws: UsageError naming the existing columns.
  [[nodiscard]] std::vector<double> column(const std::string& name) const;
};

/// Reads a source to its end and shows the progress. Throws: stream::Error, stream::Stopped, what
/// `take` throws.
void for_each_block(stream::PointSource& source, const CommonOptions& common,
                    const std::function<void(stream::PointBlock&)>& take);

/// The memory that reading the source takes. Throws: stream::Error if it is more than memory_bytes,
/// saying what it needs.
std::uint64_t reading_within_memory(const stream::PointSource& source, std::uint64_t memory_bytes);

/// Beside so many bytes of reading. Throws: stream::Error if writing to `file` would take more than
/// memory_bytes, saying what it needs.
void writing_within_memory(const stream::PointWriter& writer, const std::string& file,
                           std::uint64_t memory_bytes, std::uint64_t reading = 0);

/// Throws: stream::Error on bad data, on no points, and if the points take more than memory_bytes;
/// stream::Stopped.
PointTable read_point_table(const std::string& file, const std::string& format,
                            std::uint64_t memory_bytes, const CommonOptions& common,
                            stream::Entities entities = stream::Entities::points);

/// Metres on the ground for the points of a table: ground = scale * (position - origin).
struct GroundFrame {
  stream::Point3 origin{}, scale{1, 1, 1};
  std::string assumption;  ///< an assumption about units; may be empty

  /// About the middle of the table's points, with heights weighed besides.
  static GroundFrame of(const PointTable& table, double z_weight);
  [[nodiscard]] stream::Point3 operator()(const stream::Point3& position) const {
    return {scale[0] * (position[0] - origin[0]), scale[1] * (position[1] - origin[1]),
            scale[2] * (position[2] - origin[2])};
  }
};

}  // namespace terrace::tools
