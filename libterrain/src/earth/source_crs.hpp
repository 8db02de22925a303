// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "terrace/stream/message.hpp"
#include "terrace/stream/source.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// The known facts about a source's CRS.
struct SourceCrs {
  stream::Crs crs;  ///< as a store records it
  Heights heights = Heights::unknown;
  std::optional<CoordinateSystem> system;  ///< nullopt: no CRS, or an unknown one
  stream::Message note;                    ///< what the user should know; may be empty
};

/// Returns the CRS that the source states or, failing that, the file NAME.prj next to it (if there
/// are several, they must agree). An unknown CRS with a known unit is accepted with a note:
/// distances can be measured then, places cannot be converted.
/// shift: the value of --towgs84, for a datum other than WGS 84's.
/// Throws: stream::Error for a CRS that contradicts itself, its .prj file or the unit that the
/// columns of x and y name, for an unknown one without a unit, and for a shift that does not apply.
SourceCrs crs_of_source(const stream::SourceInfo& info,
                        const std::optional<DatumShift>& shift = std::nullopt);

}  // namespace terrace::terrain
