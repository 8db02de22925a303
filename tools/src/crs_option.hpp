// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "terrace/stream/source.hpp"

namespace terrace::tools {

/// The CRS of "EPSG:n", as far as it can be told without a database: geographic for the usual codes
/// of longitude and latitude (degrees), else projected with its unit where that is known (metres
/// for UTM, Web Mercator and most others; feet for the American state planes that have them).
/// Throws: UsageError if the text is no such code.
stream::Crs parse_crs(const std::string& text);

}  // namespace terrace::tools
