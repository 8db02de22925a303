// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/stream/point.hpp>
#include <terrace/stream/schema.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/detail.hpp"

/// Lines of mixed levels of detail, from stores of segments or polylines.

namespace terrace::terrain {

/// Lines of two or more vertices each.
struct LineSet {
  struct Line {
    std::size_t begin = 0, end = 0;  ///< range in `vertices`
    std::uint32_t number = 0;        ///< position in the order in which lines were read, from 0
    std::uint8_t dimensions = 3;     ///< 2 if it was read without heights
  };
  std::vector<stream::Point3> vertices;
  std::vector<Line> lines;
  std::vector<std::string> property_names;  ///< numeric properties that every line has
  std::vector<double> properties;           ///< lines x property_names, row by row; NaN: no value
};

/// True for a store of segments or polylines (see stream::Entities).
[[nodiscard]] bool holds_lines(const stream::StoreSchema& schema);

/// Returns the lines that `detail` selects, in the store's CRS, with coordinates exactly as they
/// were read. A piece is selected by its first vertex. Consecutive pieces are joined, so level 0
/// without a region returns all lines in the order in which they were read. A line that is wanted
/// only in part is returned as several consecutive lines.
///
/// Uses half of the available memory unless the context sets another bound. Throws: stream::Error
/// on a damaged store, or if the lines do not fit in memory (the message says how much they need);
/// UsageError if the store holds something else; stream::Stopped.
[[nodiscard]] LineSet detail_lines(const stream::Store& store, const Detail& detail,
                                   const Context& context = {});

/// Writes lines as GeoJSON, each as a Feature with its number as the property "line", followed by
/// its other properties (null if NaN). Numbers have enough digits to read back exactly. crs: the
/// CRS of the lines. Unless it is longitude and latitude of WGS 84, the member "crs" (GeoJSON of
/// 2008, which GDAL and others read) names it by its EPSG code; the member is null if the CRS is
/// unknown. Throws: UsageError for a CRS without a code, and what `write` throws.
void write_geojson(const LineSet& lines, const stream::Crs& crs,
                   const std::function<void(std::string_view)>& write);

}  // namespace terrace::terrain
