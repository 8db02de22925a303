// SPDX-License-Identifier: Apache-2.0
#include "mesh/wanted_entities.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <string>

#include <terrace/stream/error.hpp>
#include <terrace/stream/source.hpp>

#include "base/stored_entities.hpp"

namespace terrace::terrain {

void for_each_wanted_entity(
    const stream::Store& store, const Detail& detail, std::uint64_t memory_bytes,
    std::size_t bytes_each,
    const std::function<void(std::span<const std::byte>, std::span<const stream::Point3>)>& visit) {
  const stream::StoreSchema& schema = store.schema();
  const stream::Entities entities = entities_of(schema);
  const CornerReader read(schema, entities, store.path().string());
  // Numbers of corners have 32 bits.
  const std::uint64_t limit =
      std::min<std::uint64_t>(memory_bytes / bytes_each,
                              std::numeric_limits<std::uint32_t>::max() / read.max_corners() - 1);
  const std::size_t record_bytes = schema.payload_size();
  std::array<stream::Point3, stream::kPolylineVertices> corners{};
  std::uint64_t visited = 0;
  for_each_wanted_point(
      store, detail,
      [&](stream::ClusterId, const stream::ClusterPoints& points, std::size_t i,
          const stream::Point3&) {
        if (visited++ >= limit) {
          throw stream::Error(
              store.path().string(),
              stream::message(
                  "the detail wants more than the {} {} that fit into {memory_bytes} {}M", limit,
                  stream::name_of(entities), memory_bytes >> 20))
              .remedy(stream::message("choose a coarser {level} or a smaller {region}"));
        }
        const auto record = std::span(points.payload).subspan(i * record_bytes, record_bytes);
        corners[0] = points.positions[i];
        const std::size_t count = read(record, std::span(corners).first(read.max_corners()));
        for (std::size_t c = 0; c < count; ++c) corners[c] = exact_world_point(schema, corners[c]);
        visit(record, std::span(corners).first(count));
      });
}

}  // namespace terrace::terrain
