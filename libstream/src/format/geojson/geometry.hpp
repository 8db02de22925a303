// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::stream {

/// A member of a feature's properties whose value is a number.
struct GeoJsonProperty {
  std::string name;
  double value = 0;
};

/// The positions of some GeoJSON, in the order of the text.
struct GeoJsonGeometry {
  /// Consecutive positions: a LineString, a part of a MultiLineString, a ring of a Polygon or
  /// MultiPolygon with its first position repeated at the end.
  struct Line {
    std::size_t begin = 0, end = 0;  ///< in `positions`; two or more
    std::uint8_t dimensions = 2;     ///< 3 if one of them has a height
  };

  std::vector<Point3> positions;  ///< missing heights are 0
  std::vector<Line> lines;        ///< positions outside lines are single points
  /// The numeric properties, if the text is one feature. Of equal names the last one counts.
  std::vector<GeoJsonProperty> properties;

  void clear() {
    positions.clear();
    lines.clear();
    properties.clear();
  }
};

/// Appends the geometries of a GeoJSON object, including those in nested collections, and its
/// numeric properties. Other properties, and numbers beyond the third of a position, are ignored.
/// item: the object's text, which begins at byte `offset` of `file`, for messages. Throws: Error.
void append_geometry(std::string_view item, const std::string& file, std::uint64_t offset,
                     GeoJsonGeometry& geometry);

}  // namespace terrace::stream
