// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "terrace/terrain/heights.hpp"

/// The samplers that make_sampler() chooses from.

namespace terrace::terrain {

/// Samples a raster at level 0.
std::unique_ptr<HeightSampler> make_lattice_sampler(const stream::Store& store,
                                                    const SamplerOptions& options,
                                                    const Context& context);
/// Samples points, or a raster at a coarser level.
std::unique_ptr<HeightSampler> make_point_sampler(const stream::Store& store,
                                                  const SamplerOptions& options,
                                                  const Context& context);

}  // namespace terrace::terrain
