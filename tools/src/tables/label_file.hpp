// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/atomic_file.hpp"

namespace terrace::tools {

/// One cluster number per line, in the order of the points; -1 for outliers (cluster::kOutlier).
/// "-" is standard output. Throws: stream::Error; ClosedPipe.
void write_labels(const std::string& path, std::span<const std::uint32_t> labels,
                  const stream::Naming& replace);

/// Reads such a file. Points in no cluster all get one number of their own.
/// Throws: stream::Error on a line that is not such a number (the line is named), and unless there
/// are as many as points.
std::vector<std::uint32_t> read_labels(const std::string& path, std::size_t points);

}  // namespace terrace::tools
