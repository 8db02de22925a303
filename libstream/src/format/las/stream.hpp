// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "format/las/header.hpp"
#include "format/record_source.hpp"

namespace terrace::stream {

/// What the header says of the points: their lattice, their attributes and where these lie in the
/// records. `comments` go to the stream's. Throws: Error naming `name` for too many extra bytes.
RecordStream las_stream(const LasHeader& header, const std::string& name,
                        std::vector<std::string> comments);

}  // namespace terrace::stream
