// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace terrace::tools {

/// Reads one cluster number per line, as `cluster --labels` writes them: 0 and up, or -1 for points
/// in no cluster, which all get one number of their own.
/// Throws: stream::Error on a line that is no such number (the line is named), and where there are
/// not as many as points.
std::vector<std::uint32_t> read_labels(const std::string& path, std::size_t points);

}  // namespace terrace::tools
