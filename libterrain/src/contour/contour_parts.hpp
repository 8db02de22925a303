// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include <terrace/stream/store.hpp>

#include "contour/line_joiner.hpp"
#include "surface/ground_slope.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/contours.hpp"
#include "terrace/terrain/region.hpp"

/// What write_contours() is made of.

namespace terrace::terrain {

/// What the lines are drawn of, and where they go.
struct ContourParts {
  const stream::Store& store;
  const ContourRequest& request;
  unsigned threads = 1;
  std::uint64_t memory_bytes = std::uint64_t{1} << 30;
  std::function<void(ContourLine&&)> emit;  ///< as ContourText::add() wants them
  OpenLineLimit limit;
  std::function<void(double share)> progress;
  /// The parts in which points are triangulated; the order of the lines depends on it.
  std::uint64_t points_per_part = std::uint64_t{1} << 16;
};

/// Draws the lines of a raster at level 0.
void draw_lattice_contours(const ContourParts& parts);
/// Draws the lines of points, or of a raster at a level above 0.
void draw_point_contours(const ContourParts& parts);

/// The box in stored coordinates around a region's box.
StoredBox box_around(const Region& region, const GroundSlope& ground);
/// Whether places in a box of stored coordinates lie in the region, at any height.
bool reaches_into(const StoredBox& box, const Region& region, const GroundSlope& ground);

}  // namespace terrace::terrain
