// SPDX-License-Identifier: Apache-2.0
#include "base/stored_entities.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/unit_words.hpp>

#include "base/units.hpp"

namespace terrace::terrain {
stream::Entities entities_of(const stream::StoreSchema& schema) {
  for (const auto& [name, value] : schema.parameters) {
    if (name != kEntitiesParameter) continue;
    if (const auto entities = stream::entities_named(value)) return *entities;
  }
  return stream::Entities::points;
}

stream::Point3 exact_world_point(const stream::Placement& placement, const stream::Point3& stored) {
  const stream::Channel& z = placement.coordinates[2];
  const bool as_stored =
      placement.world == stream::WorldTransform{} && z.scale == 1.0 && z.offset == 0.0;
  return as_stored ? stored : stream::world_point(placement, stored);
}

CornerReader::CornerReader(const stream::Schema& schema, stream::Entities entities,
                           std::string file)
    : file_(std::move(file)) {
  assert(entities != stream::Entities::points);
  const std::size_t corners = entities == stream::Entities::triangles  ? 3
                              : entities == stream::Entities::segments ? 2
                                                                       : stream::kPolylineVertices;
  for (std::size_t corner = 2; corner <= corners; ++corner) {
    for (const char* const axis : {"x", "y", "z"}) {
      other_corners_.push_back(column(schema, fmt::format("{}{}", axis, corner)));
    }
  }
  if (entities == stream::Entities::polylines) vertices_ = column(schema, "vertices");
}

CornerReader::Column CornerReader::column(const stream::Schema& schema,
                                          const std::string& name) const {
  const auto attribute =
      std::find_if(schema.attributes.begin(), schema.attributes.end(),
                   [&](const stream::Channel& channel) { return channel.name == name; });
  if (attribute == schema.attributes.end()) {
    throw stream::Error(file_, fmt::format("the column \"{}\" of the corners is missing", name))
        .remedy(stream::message("keep all columns: leave {keep} and {drop} out"));
  }
  return {attribute->type,
          schema.attribute_offset(static_cast<std::size_t>(attribute - schema.attributes.begin()))};
}

std::size_t CornerReader::operator()(std::span<const std::byte> record,
                                     std::span<stream::Point3> corners) const {
  assert(corners.size() == max_corners());
  const auto value = [&](const Column& column) {
    return stream::to_double(column.type, record.data() + column.offset);
  };
  std::size_t count = max_corners();
  if (vertices_) {
    const double vertices = value(*vertices_);
    if (!(vertices >= 2 && vertices <= static_cast<double>(count))) {
      throw stream::Error(file_, "an entity of " + plain_number(vertices) + ' ' +
                                     stream::noun_for(vertices == 1, "vertex"))
          .remedy("the store is damaged; build it again");
    }
    count = static_cast<std::size_t>(vertices);
  }
  for (std::size_t i = 0; i < 3 * (count - 1); ++i)
    corners[1 + i / 3][i % 3] = value(other_corners_[i]);
  return count;
}

}  // namespace terrace::terrain
