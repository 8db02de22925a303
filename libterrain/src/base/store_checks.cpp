// SPDX-License-Identifier: Apache-2.0
#include "base/store_checks.hpp"

#include <terrace/stream/error.hpp>

#include "base/stored_entities.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {

void need_points(const stream::Store& store, const std::string& what) {
  const stream::Entities entities = entities_of(store.schema());
  if (entities == stream::Entities::points) return;
  throw stream::Error({.file = store.path().string(),
                       .where = {},
                       .cause = "holds " + std::string(stream::name_of(entities)) + ", and " +
                                what + " needs points",
                       .remedy = "build a store of the vertices: leave `entities` out"});
}

void need_level(const stream::Store& store, unsigned level) {
  if (level <= store.top()) return;
  throw UsageError("the store has no level " + std::to_string(level) + ": its top is level " +
                   std::to_string(store.top()));
}

void need_all_points(const stream::Store& store, unsigned level, std::uint64_t points) {
  const std::uint64_t expected = store.levels()[level].points;
  if (points == expected) return;
  throw stream::Error({.file = store.path().string(),
                       .where = "level " + std::to_string(level),
                       .cause = "the clusters have " + std::to_string(points) +
                                " points and not the " + std::to_string(expected) +
                                " that the manifest tells",
                       .remedy = "restore the files or build the store anew"});
}

void throw_region_outside(const stream::Store& store) {
  throw stream::Error(
      {.file = store.path().string(),
       .where = {},
       .cause = "the region does not meet the store",
       .remedy = "look at its bounds, and at the CRS in which the `region` is given"});
}

}  // namespace terrace::terrain
