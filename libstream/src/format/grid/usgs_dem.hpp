// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// A digital elevation model of the USGS in its ASCII form: a record A of fixed columns, then one
/// profile (record B) per column of the grid, from south to north and west to east. In UTM, in arc
/// seconds, or in an unspecified plane; heights in feet or metres. Read once, front to back, into a
/// temporary file. Samples are the integers of the file, with its vertical resolution as scale.
///
/// Source: USGS, Standards for Digital Elevation Models, part 2, appendix 2-A and 2-B, 1998.
/// Throws: Error; Stopped if a wait for a pipe is ended.
std::unique_ptr<Raster> open_usgs_dem(const std::string& file, const std::stop_token& stop = {});

}  // namespace terrace::stream
