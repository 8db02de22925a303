// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <terrace/stream/overlay.hpp>
#include <terrace/tri/multiresolution.hpp>
#include <terrace/tri/smoothing.hpp>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Where the vertices of a mesh have other heights than in the store: first the overlay's, then
/// smoothed.
struct HeightOptions {
  /// Heights are smoothed, with a region only inside it, its border staying: on the triangulation
  /// as it is made, so of rasters on the unit grid. An edge_height of 0 becomes four times the root
  /// mean square of the height differences along edges.
  std::optional<tri::SmoothingOptions> smoothing;
  /// Replaces the heights of the points that it has.
  stream::Overlay* overlay = nullptr;
  /// Gets the heights that in the end are not the store's, in the name of the vertices' points.
  stream::OverlayWriter* save = nullptr;

  [[nodiscard]] bool any() const { return smoothing || overlay != nullptr || save != nullptr; }
  /// Peak bytes per vertex, beside the mesh.
  [[nodiscard]] std::uint64_t bytes_per_vertex() const;
};

/// The heights in real units by the slot of the vertex. Of points of equal x and y only the one
/// that stands for the vertex has a say. Throws: stream::Error on a damaged overlay, or where it
/// can not be written; std::invalid_argument where smoothing leaves the range of doubles.
template <class Coord>
std::vector<double> changed_heights(const tri::Multiresolution2<Coord>& model,
                                    const stream::Placement& placement,
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

}  // namespace terrace::terrain
