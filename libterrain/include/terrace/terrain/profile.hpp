// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

struct ProfileRequest {
  SamplerOptions sampler{};
  std::vector<Point2> line{};    ///< in the store's CRS, straight between its places there
  std::optional<double> step{};  ///< metres
};

struct ProfileOutcome {
  std::uint64_t points = 0, answered = 0;
  double metres = 0;  ///< length of the line
};

/// Rows distance,x,y,height along the line: metres from its begin, the place in the store's CRS,
/// and the height, empty where there is none.
///
/// With a step, every so many metres and at the end. Without, at the line's places and wherever it
/// crosses a column, a row or a diagonal of a raster's lattice, or, of irregular points and coarser
/// levels, an edge of their triangulation: between them the linear surface is straight, so the
/// profile is the surface itself.
///
/// Distances are geodesics (line_distance.hpp) summed over pieces so short that the line's bend
/// does not show; without a CRS they are the map's. Memory: some thousand rows at a time.
/// Throws: stream::Error on a damaged store, stream::Stopped, UsageError as make_sampler().
ProfileOutcome write_profile(const stream::Store& store, const ProfileRequest& request,
                             const std::function<void(std::string_view)>& write,
                             const Context& context = {});

}  // namespace terrace::terrain
