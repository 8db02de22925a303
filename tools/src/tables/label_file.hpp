// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/atomic_file.hpp"

namespace terrace::tools {

/// Writes one cluster number per line, in the order of the points; -1 for outliers
/// (cluster::kOutlier). "-" is standard output. Throws stream::Error and ClosedPipe.
void write_labels(const std::string& path, std::span<const std::uint32_t> labels,
                  const stream::Naming& replace);

/// Reads such a file. All points without a cluster share one separate number. Throws stream::Error,
/// which names the line, if a line is not a valid number, and if the number of lines differs from
/// `points`.
std::vector<std::uint32_t> read_labels(const std::string& path, std::size_t points);

}  // namespace terrace::tools
