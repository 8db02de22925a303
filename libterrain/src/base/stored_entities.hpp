// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/stream/source.hpp>
#include <terrace/stream/store.hpp>

/// Stores of triangles, segments or polylines: each "point" is the first corner of an entity, and
/// its attributes are the other corners.

namespace terrace::terrain {

/// The parameter in a store's manifest that names its entities, unless they are points.
inline constexpr std::string_view kEntitiesParameter = "entities";

[[nodiscard]] stream::Entities entities_of(const stream::StoreSchema& schema);

/// Returns the place in the CRS exactly as it was read. Skips identity transforms, because sums
/// would lose the sign of zeros.
[[nodiscard]] stream::Point3 exact_world_point(const stream::Placement& placement,
                                               const stream::Point3& stored);

/// Reads the corners of an entity from its record, in stored coordinates.
class CornerReader {
 public:
  /// entities: not points. Throws: stream::Error, about `file`, if the columns are missing.
  CornerReader(const stream::Schema& schema, stream::Entities entities, std::string file);

  /// The most corners that an entity can have, at most stream::kPolylineVertices.
  [[nodiscard]] std::size_t max_corners() const { return other_corners_.size() / 3 + 1; }
  /// Reads all corners except the first into corners[1], corners[2], and so on. Returns the number
  /// of corners, including the first. corners: has max_corners() elements. Throws: stream::Error on
  /// an impossible number of vertices.
  std::size_t operator()(std::span<const std::byte> record,
                         std::span<stream::Point3> corners) const;

 private:
  struct Column {
    stream::ScalarType type;
    std::size_t offset;
  };
  [[nodiscard]] Column column(const stream::Schema& schema, const std::string& name) const;

  std::string file_;
  std::vector<Column> other_corners_;  ///< x, y, z of the second corner, then of the third, ...
  std::optional<Column> vertices_;
};

}  // namespace terrace::terrain
