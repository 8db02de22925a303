// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/store_metric.hpp"

#include <array>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "earth/ground.hpp"
#include "surface/stored_box.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/latitudes.hpp"

namespace terrace::terrain {

tri::LinearMap3 ground_map(const stream::Store& store) {
  check_latitudes(store);
  return Ground(store.schema()).map(store.bounds());
}

tri::MetricField2 metric_field(const MetricChoice& metric, const stream::Store& store) {
  if (metric.kind != MetricChoice::Kind::euclidean &&
      metric.kind != MetricChoice::Kind::elliptical) {
    throw UsageError(
        fmt::format("a mesh has the metric euclidean or elliptical:FILE, not {}", metric.text));
  }
  const stream::Placement& placement = store.schema();
  const std::array<double, 6>& m = placement.world.xy;
  const Ground ground(placement);
  std::vector<tri::MetricField2::Region> regions;
  for (const MetricChoice::Region& region : metric.regions) {
    if (region.box && (m[1] != 0.0 || m[3] != 0.0)) {
      throw UsageError(
          stream::message("{metric}: the boxes of regions need a raster that is not rotated"));
    }
    constexpr double kEverywhere = std::numeric_limits<double>::infinity();
    tri::Box3 box{{-kEverywhere, -kEverywhere, -kEverywhere},
                  {kEverywhere, kEverywhere, kEverywhere}};
    stream::Box3 around = store.bounds();
    if (region.box) {
      const tri::Box3 stored = stored_box(placement, *region.box);
      for (std::size_t axis = 0; axis < 2; ++axis) {
        box.min[axis] = around.min[axis] = stored.min[axis];
        box.max[axis] = around.max[axis] = stored.max[axis];
      }
    }
    // Composes the map from stored coordinates to the ground with the ellipse's map to the unit
    // circle.
    const GroundMap on_ground = ground.map(around);
    const cluster::LinearMap& ellipse = region.metric.map();
    tri::LinearMap3 map{};
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column) {
        for (std::size_t k = 0; k < 3; ++k) {
          map[3 * row + column] += ellipse[3 * row + k] * on_ground[3 * k + column];
        }
      }
    }
    regions.push_back({box, tri::plane_map(map)});
  }
  return tri::MetricField2(std::move(regions));
}

}  // namespace terrace::terrain
