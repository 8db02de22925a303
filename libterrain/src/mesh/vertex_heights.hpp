// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <terrace/tri/multiresolution.hpp>

#include "mesh/matching_points.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Peak memory in bytes per vertex for changing heights, in addition to the mesh.
std::uint64_t height_bytes_per_vertex(const HeightOptions& options);

/// Returns the heights in real units by vertex slot. Of points with equal x and y, only the one
/// that represents the vertex is used. Model: tri::Multiresolution2 or MatchingPoints. Throws:
/// stream::Error on a damaged overlay, or if one cannot be written; std::invalid_argument if
/// smoothing exceeds the range of doubles.
template <class Model>
std::vector<double> changed_heights(const Model& model, const stream::Placement& placement,
                                    const std::optional<Region>& region,
                                    const HeightOptions& options);

extern template std::vector<double> changed_heights(const tri::Multiresolution2<std::int32_t>&,
                                                    const stream::Placement&,
                                                    const std::optional<Region>&,
                                                    const HeightOptions&);
extern template std::vector<double> changed_heights(const tri::Multiresolution2<double>&,
                                                    const stream::Placement&,
                                                    const std::optional<Region>&,
                                                    const HeightOptions&);
extern template std::vector<double> changed_heights(const MatchingPoints<std::int32_t>&,
                                                    const stream::Placement&,
                                                    const std::optional<Region>&,
                                                    const HeightOptions&);
extern template std::vector<double> changed_heights(const MatchingPoints<double>&,
                                                    const stream::Placement&,
                                                    const std::optional<Region>&,
                                                    const HeightOptions&);

}  // namespace terrace::terrain
