// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/near_points.hpp"

#include <cmath>
#include <string>

#include <terrace/stream/schema.hpp>
#include <terrace/stream/store.hpp>

#include "base/store_checks.hpp"
#include "earth/ground.hpp"
#include "earth/whole_turns.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/latitudes.hpp"

namespace terrace::terrain {
namespace {

/// The place in stored coordinates, and the metric at it.
struct Local {
  stream::Point3 place{};
  stream::LinearMap metric{};
};

Local local(const stream::Store& store, const NearPlace& near, unsigned level) {
  need_level(store, level);
  if (!std::isfinite(near.xy[0]) || !std::isfinite(near.xy[1]) ||
      !std::isfinite(near.z.value_or(0))) {
    throw UsageError(stream::message("{near} needs finite coordinates"));
  }
  const stream::StoreSchema& schema = store.schema();
  check_latitudes({&near.xy, 1}, most_latitude(schema.crs), store.path().string());
  const std::array<double, 2> xy =
      stream::stored_place(schema, WholeTurns(schema, store.whole().bounds())(near.xy));
  const stream::Channel& height = schema.coordinates[2];
  Local result{.place = {xy[0], xy[1], 0.0}, .metric = {}};
  if (near.z) result.place[2] = (*near.z - height.offset) / height.scale;
  stream::Box3 frame;
  frame.include(result.place);
  result.metric = Ground(schema).map(frame);
  if (!near.z) {
    for (std::size_t row = 0; row < 3; ++row) result.metric[3 * row + 2] = 0.0;
  }
  return result;
}

}  // namespace

std::vector<stream::FoundPoint> nearest_points(stream::StoreQuery& query, const NearPlace& place,
                                               std::size_t count, unsigned level) {
  const Local frame = local(query.store(), place, level);
  return query.nearest(frame.place, count, frame.metric, level);
}

std::vector<stream::FoundPoint> points_within(stream::StoreQuery& query, const NearPlace& place,
                                              double radius, unsigned level) {
  if (!(radius >= 0.0) || !std::isfinite(radius)) {
    throw UsageError(stream::message("{radius} must be 0 or more"));
  }
  const Local frame = local(query.store(), place, level);
  return query.within(frame.place, radius, frame.metric, level);
}

void write_found_points(const stream::StoreQuery& query, std::span<const stream::FoundPoint> found,
                        stream::PointWriter& writer, const PlaceConversion& places) {
  const stream::StoreSchema& schema = query.store().schema();
  const std::size_t payload = schema.payload_size();
  const std::vector<std::byte> attributes = query.attributes(found);
  stream::PointBlock block;
  for (std::size_t i = 0; i < found.size(); ++i) {
    block.positions.push_back(world_point(schema, found[i].position));
    for (const auto bytes : {std::span(attributes).subspan(i * payload, payload),
                             std::as_bytes(std::span(&found[i].distance, 1))}) {
      block.payload.insert(block.payload.end(), bytes.begin(), bytes.end());
    }
  }
  places(block.positions);
  if (!block.empty()) writer.append(block);
}

}  // namespace terrace::terrain
