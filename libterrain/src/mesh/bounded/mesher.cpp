// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/mesher.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "earth/ground.hpp"

namespace terrace::terrain {
namespace {

/// Returns a box around the meshed samples, in the CRS of the store; for a raster it includes the
/// samples next to the region.
stream::Box3 meshed_box(const stream::Store& store, const std::optional<Region>& region) {
  const stream::Placement& placement = store.schema();
  stream::Box3 stored = store.bounds();
  const stream::Box3 all = world_box(placement, stored);
  if (!region || stored.empty()) return all;
  const stream::Box3& inside = region->box();
  stream::Box3 box = inside;
  if (store.schema().grid) {
    constexpr double kMargin = 2;  // in cells
    stream::Box3 wanted_box;
    for (unsigned corner = 0; corner < 4; ++corner) {
      const Point2 place = stored_place(placement, {((corner & 1) ? inside.max : inside.min)[0],
                                                    ((corner & 2) ? inside.max : inside.min)[1]});
      wanted_box.include(stream::Point3{place[0], place[1], 0});
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      stored.min[axis] = std::max(stored.min[axis], wanted_box.min[axis] - kMargin);
      stored.max[axis] = std::min(stored.max[axis], wanted_box.max[axis] + kMargin);
      if (!(stored.min[axis] <= stored.max[axis])) return all;
    }
    box = world_box(placement, stored);
  }
  stream::Box3 meshed = all;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    meshed.min[axis] = std::max(all.min[axis], box.min[axis]);
    meshed.max[axis] = std::min(all.max[axis], box.max[axis]);
    if (!(meshed.min[axis] <= meshed.max[axis])) return all;
  }
  return meshed;
}

}  // namespace

BoundedMesher::BoundedMesher(const stream::Store& store, const BoundedMeshOptions& options,
                             const Context& context)
    : store_(store),
      options_(options),
      context_(context),
      placement_(store.schema()),
      bounds_(options.places.box_around(meshed_box(store, options.region))),
      coordinates_(mesh_coordinates(options.path, options.writer, MeshUnits(store, options.places),
                                    bounds_)),
      rounding_(options.path, bounds_, options.writer, coordinates_.frame) {}

double BoundedMesher::metres_vertical() const {
  return Ground(placement_).map(store_.bounds())[8] / placement_.coordinates[2].scale;
}

Aim BoundedMesher::aim_within(double bound) const {
  const stream::Point3& moved = rounding_.largest();
  if (moved == stream::Point3{} && !bends()) return {bound, bound, bound};
  const double first = bound * (255.0 / 256.0) - moved[2];
  const double sure = bound * (bends() ? 7.0 / 8.0 : 15.0 / 16.0) - moved[2];
  if (options_.max_points > 0) return {std::max(first, 0.0), std::max(sure, 0.0), HUGE_VAL};
  if (!(sure >= 0.0)) {
    throw stream::Error(
        options_.path,
        stream::message("its format rounds heights by up to {}, too much for this {max_error}",
                        readable_number(moved[2])))
        .remedy("write PLY, which is exact");
  }
  return {first, sure, bound};
}

unsigned BoundedMesher::threads_within_memory(std::uint64_t each, std::uint64_t shared,
                                              const std::string& purpose) const {
  const std::uint64_t memory = context_.memory_or(0);
  if (memory < shared + each) {
    throw stream::Error(
        store_.path().string(),
        stream::message("a mesh with a bound needs {}M of memory{}, {memory_bytes} allows {}M",
                        ((shared + each) >> 20) + 1, purpose, memory >> 20))
        .remedy("allow more");
  }
  return static_cast<unsigned>(std::min<std::uint64_t>(
      context_.threads, (memory - shared) / std::max<std::uint64_t>(each, 1)));
}

}  // namespace terrace::terrain
