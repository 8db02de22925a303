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

/// All points of a file in memory, in the order of reading. Except for rasters, that is the order
/// of the file.
struct PointTable {
  stream::SourceInfo info;
  std::vector<stream::Point3> positions;  ///< in CRS coordinates
  std::vector<std::byte> payload;         ///< packed records, see stream::StoreSchema
  std::uint64_t nodata = 0;               ///< points left out, see stream::Progress

  [[nodiscard]] std::size_t size() const { return positions.size(); }
  /// Returns the attribute of that name as doubles, with scale and offset applied. Throws
  /// UsageError, which names the existing columns.
  [[nodiscard]] std::vector<double> column(const std::string& name) const;
};

/// Reads a source to its end and shows the progress. Throws stream::Error, stream::Stopped and what
/// `take` throws.
void for_each_block(stream::PointSource& source, const CommonOptions& common,
                    const std::function<void(stream::PointBlock&)>& take);

/// Returns the memory needed for reading the source, in bytes. Throws stream::Error, which states
/// it, if that is more than memory_bytes.
std::uint64_t reading_within_memory(const stream::PointSource& source, std::uint64_t memory_bytes);

/// Checks the memory needed for writing to `file`, in addition to `reading` bytes for reading.
/// Throws stream::Error, which states it, if the total is more than memory_bytes.
void writing_within_memory(const stream::PointWriter& writer, const std::string& file,
                           std::uint64_t memory_bytes, std::uint64_t reading = 0);

/// Reads a point file. Throws stream::Error for invalid data, for a file without points, and if the
/// points take more than memory_bytes; throws stream::Stopped.
PointTable read_point_table(const std::string& file, const std::string& format,
                            std::uint64_t memory_bytes, const CommonOptions& common,
                            stream::Entities entities = stream::Entities::points);

/// Converts the points of a table to metres on the ground: ground = scale * (position - origin).
struct GroundFrame {
  stream::Point3 origin{}, scale{1, 1, 1};
  std::string assumption;  ///< an assumption about units; may be empty

  /// Returns a frame centred on the table's points, with heights multiplied by `z_weight` too.
  static GroundFrame of(const PointTable& table, double z_weight);
  [[nodiscard]] stream::Point3 operator()(const stream::Point3& position) const {
    return {scale[0] * (position[0] - origin[0]), scale[1] * (position[1] - origin[1]),
            scale[2] * (position[2] - origin[2])};
  }
};

}  // namespace terrace::tools
