// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/las/fields.hpp"
#include "terrace/stream/point.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// The positions of a stream's attributes in the point records of a file.
struct LasLayout {
  unsigned point_format = 6;
  std::size_t record_bytes = 0;
  std::vector<LasField> fields{};  ///< for each attribute, in order, as stored in the file
  std::string extra_bytes{};       ///< data of the VLR that describes the extra bytes
};

/// The point formats to choose from. newer: only 6 to 8.
enum class LasFormats : std::uint8_t { all, newer };

/// Assigns attributes to the fields of the same name, and other attributes to extra bytes. The
/// point format is the smallest suitable one of 6, 7 and 8, or of 0 to 3 if the angles are ranks as
/// in LAS 1.0 to 1.3. Either way, records that were read are reproduced exactly. If only newer
/// formats are allowed, ranks become scan angles. Wave packets become extra bytes too, because the
/// waveforms are not copied. Throws: Error naming `file` for more attributes than fit.
LasLayout las_layout(std::span<const Channel> attributes, const std::string& file,
                     LasFormats formats = LasFormats::all);

/// Chooses a lattice for coordinates that have none. Its steps are powers of ten, at least 1e-9,
/// and the same for x and y. They are 0.001 (1e-7 for degrees) or smaller if `points` need it;
/// points with fewer decimals do not make them larger, because later ones may have more. Steps are
/// larger where 32 bits would not cover `bounds`. Without bounds, 32 bits must cover twenty times
/// the extent of the points, or a thousand times if the steps are smaller than usual.
Lattice decimal_lattice(std::span<const Point3> points, const std::optional<Box3>& bounds,
                        bool degrees);

}  // namespace terrace::stream
