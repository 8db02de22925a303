// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <terrace/stream/store.hpp>

#include "surface/bounded/bounded_surface.hpp"
#include "surface/point_cloud.hpp"
#include "surface/window_tree.hpp"
#include "terrace/terrain/heights.hpp"

/// The samplers that make_sampler() chooses from.

namespace terrace::terrain {

/// Samples a raster at level 0.
std::unique_ptr<HeightSampler> make_lattice_sampler(const stream::Store& store,
                                                    const SamplerOptions& options,
                                                    const Context& context);

/// Returns the peak memory in bytes per place that these options take in addition.
inline std::uint64_t added_bytes_per_place(const SamplerOptions& options) {
  return options.focuses.empty() && !options.max_error ? 0 : 64;
}

/// A cloud that is sampled in windows. A sampler and PointCrossings may share one.
struct SampledCloud {
  /// Points of a window. Several windows are loaded together where that costs less.
  static constexpr std::size_t kWindowPoints = 16384;

  /// Throws: as PointCloud.
  SampledCloud(const stream::Store& sampled, const WantedClusters& wanted)
      : store(sampled), cloud(store, wanted), windows(store, wanted, kWindowPoints) {}

  /// Whether a place is sampled on the lattice of a raster, because all samples around it are
  /// wanted: those that determine a gradient there.
  [[nodiscard]] bool is_lattice(const Point2& stored) const {
    constexpr double kCellsAround = 2;
    return store.schema().grid && cloud.wanted.has_all_samples(stored, kCellsAround);
  }

  stream::Store store;
  PointCloud cloud;
  WindowTree windows;
};

/// Returns the points of a store, or of coarser or mixed levels of a raster; null for level 0 of a
/// raster. Throws: as make_sampler().
std::shared_ptr<SampledCloud> sampled_cloud(const stream::Store& store,
                                            const SamplerOptions& options, const Context& context);
/// Returns the surface within SamplerOptions::max_error, with its windows; null without. Throws: as
/// make_sampler().
std::shared_ptr<BoundedParts> sampled_surface(const stream::Store& store,
                                              const SamplerOptions& options,
                                              const Context& context);
/// Samples the triangles of a bounded surface. Throws: stream::Error if memory does not suffice.
std::unique_ptr<HeightSampler> make_bounded_sampler(const stream::Store& store,
                                                    std::shared_ptr<BoundedParts> surface,
                                                    const SamplerOptions& options,
                                                    const Context& context);

/// Samples points, or a raster at coarser or mixed levels. Uses the clusters of the cloud.
std::unique_ptr<HeightSampler> make_cloud_sampler(std::shared_ptr<SampledCloud> cloud,
                                                  const SamplerOptions& options,
                                                  const Context& context);
/// The same on the triangulation of the points alone.
std::unique_ptr<HeightSampler> make_point_sampler(std::shared_ptr<SampledCloud> cloud,
                                                  const SamplerOptions& options,
                                                  const Context& context);

}  // namespace terrace::terrain
