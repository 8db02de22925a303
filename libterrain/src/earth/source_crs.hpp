// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "terrace/stream/source.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// What is known of the CRS of a source.
struct SourceCrs {
  stream::Crs crs;  ///< as a store records it
  Heights heights = Heights::unknown;
  std::optional<CoordinateSystem> system;  ///< none: no CRS, or one that is not known
  std::string note;                        ///< what the user should know; empty: nothing
};

/// What the source says, or else the file NAME.prj beside it (of several, all those that are there
/// must agree). A CRS that is not known is let through with a note if its unit is: distances can be
/// measured then, places cannot.
/// shift: of --towgs84, for a datum that is not WGS 84's.
/// Throws: stream::Error for a CRS that contradicts itself or its .prj file, for an unknown one
/// without a unit, and for a shift that has no use.
SourceCrs crs_of_source(const stream::SourceInfo& info,
                        const std::optional<DatumShift>& shift = std::nullopt);

}  // namespace terrace::terrain
