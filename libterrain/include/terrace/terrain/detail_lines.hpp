// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include <terrace/stream/point.hpp>
#include <terrace/stream/schema.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/detail.hpp"

/// Lines of mixed levels of detail, from stores of segments or polylines.

namespace terrace::terrain {

/// Lines, each of two vertices or more.
struct LineSet {
  struct Line {
    std::size_t begin = 0, end = 0;  ///< of `vertices`
    std::uint32_t number = 0;        ///< in the order in which lines were read, from 0
    std::uint8_t dimensions = 3;     ///< 2 if it was read without heights
  };
  std::vector<stream::Point3> vertices;
  std::vector<Line> lines;
};

/// True for a store of segments or polylines (see stream::Entities).
[[nodiscard]] bool holds_lines(const stream::StoreSchema& schema);

/// What `detail` wants of a store of lines, in the store's CRS, to the last bit as it was read. A
/// piece is where its first vertex is. Pieces that follow one another are joined, so level 0
/// without a region gives all lines back in the order in which they were read; a line of which
/// something is not wanted comes in several, one after the other.
///
/// Takes half of the available memory unless the context gives another bound. Throws:
/// stream::Error on a damaged store, or when the lines would not fit, saying what they need;
/// UsageError if the store holds something else; stream::Stopped.
[[nodiscard]] LineSet detail_lines(const stream::Store& store, const Detail& detail,
                                   const Context& context = {});

/// Writes lines as GeoJSON, one Feature with the property "line", its number, for each; numbers
/// have as many digits as they need to be read back to the last bit. crs: where the lines lie;
/// unless that is longitude and latitude of WGS 84 it is named by its EPSG code in the member "crs"
/// (GeoJSON of 2008, which GDAL and others read); null where nothing is known of it. Throws:
/// UsageError for a CRS without a code, and what `write` throws.
void write_geojson(const LineSet& lines, const stream::Crs& crs,
                   const std::function<void(std::string_view)>& write);

}  // namespace terrace::terrain
