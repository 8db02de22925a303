// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Expands the names given to open_source(): folders, lists and patterns to their files, EPT
/// folders to their ept.json. format: as in SourceOptions. Throws: Error for a name without files.
std::vector<std::string> input_files(std::span<const std::string> names, const std::string& format);

}  // namespace terrace::stream
