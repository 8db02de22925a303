// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <terrace/stream/store.hpp>

/// Stores of triangles: every "point" is the first corner of one, with the others as attributes.

namespace terrace::terrain {

/// The parameter in a store's manifest, and what it says there.
inline constexpr std::string_view kEntitiesParameter = "entities", kTrianglesValue = "triangles";

[[nodiscard]] bool holds_triangles(const stream::StoreSchema& schema);

/// Throws: stream::Error if the store holds triangles; `what` needs points.
void need_points(const stream::Store& store, const std::string& what);

/// Reads the second and third corner of a triangle from its record, in stored coordinates.
class CornerReader {
 public:
  /// Throws: stream::Error, about `file`, if the columns are not there.
  CornerReader(const stream::Schema& schema, const std::string& file);

  void operator()(std::span<const std::byte> record, std::span<stream::Point3> corners) const;

 private:
  struct Column {
    stream::ScalarType type;
    std::size_t offset;
  };
  std::array<Column, 6> columns_{};
};

}  // namespace terrace::terrain
