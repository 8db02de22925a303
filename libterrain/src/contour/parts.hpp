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

/// The parts of write_contours().

namespace terrace::terrain {

/// The source of the lines, and their destination.
struct ContourParts {
  const stream::Store& store;
  const ContourRequest& request;
  unsigned threads = 1;
  std::uint64_t memory_bytes = std::uint64_t{1} << 30;
  std::function<void(ContourLine&&)> emit;  ///< in the form that ContourText::add() expects
  OpenLineLimit limit;
  std::function<void(double share)> progress;
  /// Points per triangulated part; the order of the lines depends on it.
  std::uint64_t points_per_part = std::uint64_t{1} << 16;
};

/// Draws the lines of a raster at level 0.
void draw_lattice_contours(const ContourParts& parts);
/// Draws the lines of points, or of a raster at coarser or mixed levels.
void draw_point_contours(const ContourParts& parts);

/// Draws the lines of the surface within ContourRequest::max_error. Throws: UsageError for options
/// that exclude it.
void draw_bounded_contours(const ContourParts& parts);

/// Returns the box in stored coordinates around a region's box.
StoredBox box_around(const Region& region, const GroundSlope& ground);
/// Whether places in a box of stored coordinates are in the region, at any height.
bool reaches_into(const StoredBox& box, const Region& region, const GroundSlope& ground);

}  // namespace terrace::terrain
