// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <terrace/tri/grid_tin.hpp>
#include <terrace/tri/interpolation.hpp>
#include <terrace/tri/point_tin.hpp>

#include "terrace/terrain/fill.hpp"
#include "terrace/terrain/height_reference.hpp"
#include "terrace/terrain/raster.hpp"

/// Options whose value is one of a few names. All throw UsageError for another one.

namespace terrace::tools {

using namespace terrain;

/// "none", "flat", "interpolate".
Fill parse_fill(const std::string& text);
/// "ellipsoidal", "orthometric", "ignore", or empty: what the store records.
HeightReference parse_height_reference(const std::string& text);
/// "greedy", "removal", "fitted".
tri::TinQuality parse_quality(const std::string& text);
/// "all", "min", "max", "mean", "first", "error".
tri::PointDuplicates parse_duplicates(const std::string& text);
/// "linear", "natural", "nearest".
tri::Interpolation parse_interpolation(const std::string& text);
/// "height", "slope", "aspect", "hillshade".
RasterValue parse_raster_value(const std::string& text);

}  // namespace terrace::tools
