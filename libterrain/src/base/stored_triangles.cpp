// SPDX-License-Identifier: Apache-2.0
#include "base/stored_triangles.hpp"

#include <algorithm>
#include <cassert>

#include <terrace/stream/error.hpp>

namespace terrace::terrain {

bool holds_triangles(const stream::StoreSchema& schema) {
  return std::any_of(schema.parameters.begin(), schema.parameters.end(), [](const auto& parameter) {
    return parameter.first == kEntitiesParameter && parameter.second == kTrianglesValue;
  });
}

void need_points(const stream::Store& store, const std::string& what) {
  if (!holds_triangles(store.schema())) return;
  throw stream::Error({.file = store.path().string(),
                       .where = {},
                       .cause = "holds triangles, and " + what + " needs points",
                       .remedy = "build a store of the vertices: leave `entities` out"});
}

CornerReader::CornerReader(const stream::Schema& schema, const std::string& file) {
  constexpr std::array<std::string_view, 6> kNames{"x2", "y2", "z2", "x3", "y3", "z3"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const auto found =
        std::find_if(schema.attributes.begin(), schema.attributes.end(),
                     [&](const stream::Channel& channel) { return channel.name == kNames[i]; });
    if (found == schema.attributes.end()) {
      throw stream::Error({.file = file,
                           .where = {},
                           .cause = "its triangles have no column \"" + std::string(kNames[i]) +
                                    "\" for their corners",
                           .remedy = "keep all columns: leave `keep` and `drop` out"});
    }
    columns_[i] = {found->type, schema.attribute_offset(
                                    static_cast<std::size_t>(found - schema.attributes.begin()))};
  }
}

void CornerReader::operator()(std::span<const std::byte> record,
                              std::span<stream::Point3> corners) const {
  assert(corners.size() == 2);
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    corners[i / 3][i % 3] = stream::to_double(columns_[i].type, record.data() + columns_[i].offset);
  }
}

}  // namespace terrace::terrain
