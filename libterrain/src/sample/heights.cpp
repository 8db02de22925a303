// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "base/store_checks.hpp"
#include "sample/samplers.hpp"
#include "surface/ground_slope.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/latitudes.hpp"

namespace terrace::terrain {

std::shared_ptr<SampledCloud> sampled_cloud(const stream::Store& store,
                                            const SamplerOptions& options, const Context& context) {
  need_terrain(store, "the height of a place");
  const WantedClusters wanted(store.with_stop(context.stop), options.level, options.focuses);
  if (store.schema().grid && wanted.level() == 0) return nullptr;
  return std::make_shared<SampledCloud>(store.with_stop(context.stop), wanted);
}

std::unique_ptr<HeightSampler> make_sampler(const stream::Store& store,
                                            const SamplerOptions& options, const Context& context) {
  if (auto surface = sampled_surface(store, options, context)) {
    return make_bounded_sampler(store, std::move(surface), options, context);
  }
  if (std::shared_ptr<SampledCloud> cloud = sampled_cloud(store, options, context)) {
    return make_cloud_sampler(std::move(cloud), options, context);
  }
  if (options.max_edge) {
    throw UsageError(stream::message(
        "{max_edge} does not apply to level 0 of a raster, which marks missing data explicitly"));
  }
  return make_lattice_sampler(store.with_stop(context.stop), options, context);
}

std::vector<GroundPoint> sample_places(const stream::Store& store, std::span<const Point2> places,
                                       const SamplerOptions& options, const Context& context) {
  constexpr std::size_t kPlacesAtOnce = 16384;
  check_latitudes(places, most_latitude(store.schema().crs), store.path().string());
  const std::unique_ptr<HeightSampler> sampler = make_sampler(store, options, context);
  const GroundSlope ground(store);
  if (options.gradients || options.max_error) say_unknown_height_unit(ground.ground(), context);
  std::vector<Point2> stored(places.size());
  std::vector<SurfacePoint> surface(places.size());
  std::vector<GroundPoint> points(places.size());
  const auto in_pieces = [&](const auto& work) {
    parallel_for((places.size() + kPlacesAtOnce - 1) / kPlacesAtOnce, std::max(1U, context.threads),
                 [&](std::size_t piece) {
                   const std::size_t begin = piece * kPlacesAtOnce;
                   const std::size_t end = std::min(begin + kPlacesAtOnce, places.size());
                   for (std::size_t i = begin; i < end; ++i) work(i);
                 },
                 context.stop);
  };
  in_pieces([&](std::size_t i) { stored[i] = ground.stored(places[i]); });
  sampler->sample(stored, surface);
  in_pieces([&](std::size_t i) {
    if (std::isnan(surface[i].height)) return;
    const tri::Gradient gradient = ground.on_ground(stored[i], surface[i]);
    points[i] = {.height = surface[i].height, .east = gradient.x, .north = gradient.y};
  });
  return points;
}

}  // namespace terrace::terrain
