// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "terrace/terrain/region.hpp"

namespace terrace::tools {

using namespace terrain;

/// "x1,y1,x2,y2[,...]", or a GeoJSON file with one LineString (plain, in a Feature, or in a
/// FeatureCollection of one). At least two places. Throws: UsageError, stream::Error.
std::vector<Point2> parse_line(const std::string& text);

}  // namespace terrace::tools
