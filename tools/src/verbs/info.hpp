// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "cli/cli.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::tools {

/// What a file of points or cells holds, found by streaming it once. Throws: stream::Error.
Summary info_of_file(const std::string& path, stream::HeightsOfColour colours,
                     const CommonOptions& common);

/// What a store holds; reads manifest and indices. Throws: stream::Error.
Summary info_of_store(const std::string& path);

}  // namespace terrace::tools
