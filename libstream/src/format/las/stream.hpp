// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "format/las/header.hpp"
#include "format/record_source.hpp"

namespace terrace::stream {

/// The placement of the records' coordinates, without a CRS.
Placement las_placement(const LasHeader& header);

/// The header's description of the points: their lattice, attributes and the positions of these in
/// the records. Adds `comments` to the stream's. Throws: Error naming `name` for too many extra
/// bytes.
RecordStream las_stream(const LasHeader& header, const std::string& name,
                        std::vector<std::string> comments);

}  // namespace terrace::stream
