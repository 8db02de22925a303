// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/bounded_mesher.hpp"

#include <algorithm>
#include <cmath>

#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "earth/ground.hpp"

namespace terrace::terrain {

BoundedMesher::BoundedMesher(const stream::Store& store, const BoundedMeshOptions& options,
                             const Context& context)
    : store_(store),
      options_(options),
      context_(context),
      placement_(store.schema()),
      bounds_(world_box(placement_, store.bounds())),
      rounding_(options.path, bounds_, options.writer) {}

double BoundedMesher::metres_vertical() const {
  return Ground(placement_).map(store_.bounds())[8] / placement_.coordinates[2].scale;
}

Aim BoundedMesher::aim_within(double bound) const {
  const stream::Point3& moved = rounding_.largest();
  if (moved == stream::Point3{}) return {bound, bound, bound};
  const double first = bound * (255.0 / 256.0) - moved[2];
  const double sure = bound * (15.0 / 16.0) - moved[2];
  if (options_.max_points > 0) return {std::max(first, 0.0), std::max(sure, 0.0), HUGE_VAL};
  if (!(sure >= 0.0)) {
    throw stream::Error({.file = options_.path,
                         .where = {},
                         .cause = "its format rounds heights by up to " +
                                  readable_number(moved[2]) + ", too much for this `max_error`",
                         .remedy = "write PLY, which is exact"});
  }
  return {first, sure, bound};
}

unsigned BoundedMesher::threads_within_memory(std::uint64_t each, std::uint64_t beside,
                                              const std::string& purpose) const {
  const std::uint64_t memory = context_.memory_or(0);
  if (memory < beside + each) {
    throw stream::Error({.file = store_.path().string(),
                         .where = {},
                         .cause = "a mesh with a bound needs " +
                                  std::to_string(((beside + each) >> 20) + 1) + "M of memory" +
                                  purpose + ", `memory_bytes` allows " +
                                  std::to_string(memory >> 20) + "M",
                         .remedy = "allow more"});
  }
  return static_cast<unsigned>(std::min<std::uint64_t>(
      context_.threads, (memory - beside) / std::max<std::uint64_t>(each, 1)));
}

}  // namespace terrace::terrain
