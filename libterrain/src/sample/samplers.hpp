// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

#include <terrace/stream/store.hpp>

#include "surface/point_cloud.hpp"
#include "surface/window_tree.hpp"
#include "terrace/terrain/heights.hpp"

/// The samplers that make_sampler() chooses from.

namespace terrace::terrain {

/// Samples a raster at level 0.
std::unique_ptr<HeightSampler> make_lattice_sampler(const stream::Store& store,
                                                    const SamplerOptions& options,
                                                    const Context& context);
/// A cloud that is sampled in windows. A sampler and SurfaceCrossings may share one.
struct SampledCloud {
  /// Points of a window. Several windows are loaded together where that costs less.
  static constexpr std::size_t kWindowPoints = 16384;

  /// Throws: as PointCloud.
  SampledCloud(const stream::Store& sampled, unsigned level)
      : store(sampled), cloud(store, level), windows(store, level, kWindowPoints) {}

  stream::Store store;
  PointCloud cloud;
  WindowTree windows;
};

/// Returns the points of a store, or of a coarser level of a raster; null for level 0 of a raster.
/// Throws: as make_sampler().
std::shared_ptr<SampledCloud> sampled_cloud(const stream::Store& store,
                                            const SamplerOptions& options, const Context& context);
/// Samples points, or a raster at a coarser level. Uses the level of the cloud.
std::unique_ptr<HeightSampler> make_point_sampler(std::shared_ptr<SampledCloud> cloud,
                                                  const SamplerOptions& options,
                                                  const Context& context);

}  // namespace terrace::terrain
