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
  std::vector<Point2> line{};  ///< straight between its places in the store's CRS
  /// From the store's CRS to that of the line, if it is another.
  std::optional<Transformation> to_line{};
  std::optional<double> step{};  ///< metres
};

struct ProfileOutcome {
  std::uint64_t points = 0, answered = 0;
  double metres = 0;  ///< length of the line
};

struct ProfilePoint {
  double metres = 0;  ///< from the line's begin
  Point2 place{};     ///< in the store's CRS
  double height = 0;  ///< in the store's vertical unit; NaN where there is none
};

/// The surface along the line.
///
/// With a step, every so many metres and at the end. Without, at the line's places and wherever it
/// crosses a column, a row or a diagonal of a raster's lattice, or, of irregular points and coarser
/// levels, an edge of their triangulation: between them the linear surface is straight, so the
/// profile is the surface itself.
///
/// Distances are geodesics (line_distance.hpp) summed over pieces so short that the line's bend
/// does not show; without a CRS they are the map's.
///
/// take: gets the points in order, some thousand at a time.
/// Throws: stream::Error on a damaged store and for a latitude beyond a pole, stream::Stopped,
/// UsageError as make_sampler() and for a line of less than two places or with one that is 2^40
/// stored units away or not finite.
ProfileOutcome profile(const stream::Store& store, const ProfileRequest& request,
                       const std::function<void(std::span<const ProfilePoint>)>& take,
                       const Context& context = {});

/// The same as rows distance,x,y,height of text with a line of names before them, the height empty
/// where there is none.
ProfileOutcome write_profile(const stream::Store& store, const ProfileRequest& request,
                             const std::function<void(std::string_view)>& write,
                             const Context& context = {});

}  // namespace terrace::terrain
