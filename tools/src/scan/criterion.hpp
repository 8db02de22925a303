// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "terrace/terrain/metric_choice.hpp"
#include "terrace/terrain/scan_surface.hpp"

namespace terrace::tools {

/// Parses --criterion: poles, gabriel, edge[:FACTOR], advancing-front or alpha-wrap[:METRES].
/// Throws UsageError.
terrain::ScanSurfaceOptions parse_criterion(const std::string& text);

/// Sets the elliptical metric between positions in metres; a Euclidean one changes nothing. Throws
/// UsageError for another kind of metric, for one with boxes, or together with a CGAL method.
void set_metric(const terrain::MetricChoice& metric, terrain::ScanSurfaceOptions& options);

}  // namespace terrace::tools
