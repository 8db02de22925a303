// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

struct ProfileRequest {
  SamplerOptions sampler{};
  std::vector<Point2> line{};  ///< in the store's CRS, with straight segments there
  /// From the store's CRS to the CRS of the line; empty if they are the same.
  std::optional<Transformation> to_line{};
  std::optional<double> step{};  ///< metres; without a CRS, units of the map
};

struct ProfileOutcome {
  std::uint64_t points = 0;
  std::uint64_t answered = 0;  ///< number of points that have a height
  double metres = 0;           ///< length of the line; without a CRS, in units of the map
};

struct ProfilePoint {
  double metres = 0;  ///< from the start of the line; without a CRS, in units of the map
  Point2 place{};     ///< in the store's CRS
  double height = 0;  ///< in the store's vertical unit; NaN without a surface
};

/// Computes the heights of the surface along a line.
///
/// With a step, there is a point every `step` metres and one at the end. Without one, there is a
/// point at each place of the line and wherever the line crosses a column, a row or a diagonal of a
/// raster's lattice or, for irregular points, coarser levels or a max_error, a triangle's edge.
/// The linear surface is straight between these points, so the profile is exact.
///
/// Distances are geodesics (line_distance.hpp), summed over pieces so short that the curvature of
/// the line does not matter. Without a CRS they are distances in the map.
///
/// take: receives the points in order, up to 65,536 at a time.
/// Throws: stream::Error on a damaged store and for a latitude beyond a pole; stream::Stopped;
/// UsageError as make_sampler(), for a line of fewer than two places, for a place that is not
/// finite or whose stored coordinates reach 2^40 in magnitude, and, with a step or on a lattice,
/// for a profile of more than 1e9 points; what `take` throws.
ProfileOutcome profile(const stream::Store& store, const ProfileRequest& request,
                       const std::function<void(std::span<const ProfilePoint>)>& take,
                       const Context& context = {});

/// Writes the points of profile() as text: a header line, then rows of distance,x,y,height. The
/// height is empty where there is no surface. Throws: as profile(), and what `write` throws.
ProfileOutcome write_profile(const stream::Store& store, const ProfileRequest& request,
                             const std::function<void(std::string_view)>& write,
                             const Context& context = {});

}  // namespace terrace::terrain
