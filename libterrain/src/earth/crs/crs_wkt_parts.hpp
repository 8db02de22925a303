// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/wkt.hpp"

/// What the readers of the kinds of systems in WKT share.

namespace terrace::terrain {

/// Throws: CrsError with that cause; the remedy is to name the system by its code.
[[noreturn]] void fail_wkt(const std::string& cause);

/// Degrees in the unit of a system, a parameter or a meridian: its own, else that of its first
/// axis, else `otherwise`.
double wkt_angle_unit(const WktNode& node, double otherwise);
/// Metres, likewise.
double wkt_length_unit(const WktNode& node, double otherwise);

/// A geographic system: datum, ellipsoid, prime meridian, unit and shift. Throws: CrsError.
void read_wkt_geographic(const WktNode& node, CrsDefinition& definition);
/// A projected one, with the geographic one below it. Throws: CrsError.
void read_wkt_projected(const WktNode& node, CrsDefinition& definition);

}  // namespace terrace::terrain
