// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The files that open_source() means by these names: folders, lists and patterns by what they
/// stand for, folders of EPT by their ept.json. format: as SourceOptions has it. Throws: Error for
/// one that stands for nothing.
std::vector<std::string> input_files(std::span<const std::string> names, const std::string& format);

}  // namespace terrace::stream
