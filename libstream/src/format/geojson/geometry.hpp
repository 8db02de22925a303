// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::stream {

/// The positions of some GeoJSON, in the order of the text.
struct GeoJsonGeometry {
  /// Positions that follow one another: a LineString, a part of a MultiLineString, a ring of a
  /// Polygon or MultiPolygon with its first position once more at the end.
  struct Line {
    std::size_t begin = 0, end = 0;  ///< of `positions`; two or more
    std::uint8_t dimensions = 2;     ///< 3 if one of them has a height
  };

  std::vector<Point3> positions;  ///< 0 where there is no height
  std::vector<Line> lines;        ///< positions that are in none are single points

  void clear() {
    positions.clear();
    lines.clear();
  }
};

/// Appends what the geometries of an object of GeoJSON hold, whatever collections they are in.
/// Properties, and numbers beyond the third of a position, are left out. item: the object's text,
/// from byte `offset` of `file` on, for messages. Throws: Error.
void append_geometry(std::string_view item, const std::string& file, std::uint64_t offset,
                     GeoJsonGeometry& geometry);

}  // namespace terrace::stream
