// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/schema.hpp"

namespace terrace::stream {

inline constexpr unsigned kLastLasPointFormat = 10;
/// Bytes per entry of the VLR that describes extra bytes.
inline constexpr std::size_t kLasExtraBytesDescription = 192;

/// Units of GPS time; a bit of the header selects one.
inline constexpr char kGpsWeekTime[] = "second of the GPS week";
inline constexpr char kAdjustedGpsTime[] = "GPS second less 1e9";

/// The position of an attribute in a point record.
struct LasField {
  Channel channel;
  std::size_t offset = 0;        ///< offset of its first byte in the record
  unsigned shift = 0, bits = 0;  ///< of a part of a byte; bits 0: a complete value

  friend bool operator==(const LasField&, const LasField&) = default;
};

/// Bytes of a record of a point format, without extra bytes.
std::size_t las_record_bytes(unsigned point_format);

/// Returns the fields of a point format after the coordinates, in the order of the record. Bit
/// fields are separate numbers. Names are those of laspy. The scale of `scan_angle` converts it to
/// degrees. adjusted_time: from the header.
std::vector<LasField> las_fields(unsigned point_format, bool adjusted_time = false);

/// Returns the fields in the extra bytes: those described by `descriptions` (the data of the VLR,
/// 192 bytes each), then each remaining byte as uint8. Names are made distinct from each other and
/// from those in `other_fields`. Nodata values are listed in `comments`.
std::vector<LasField> las_extra_fields(const std::string& descriptions, std::size_t first,
                                       std::size_t record_bytes,
                                       std::span<const LasField> other_fields,
                                       std::vector<std::string>& comments);

}  // namespace terrace::stream
