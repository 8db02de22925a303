// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include <terrace/stream/store.hpp>

#include "sample/place_file.hpp"
#include "terrace/terrain/context.hpp"
#include "terrace/terrain/heights.hpp"

namespace terrace::terrain {

struct SampleCounts {
  std::uint64_t points = 0;    ///< lines with a place
  std::uint64_t answered = 0;  ///< of these, with a height
};

/// From the coordinates of places to others, in place; on several threads at once.
struct PlaceConversions {
  std::function<void(std::span<Point2>)> to_store;    ///< none: they are in the store's CRS
  std::function<void(std::span<Point2>)> to_written;  ///< none: lines keep their places
  bool writes_degrees = false;                        ///< of to_written
  /// The largest y where y is a latitude. A line with a larger one is an error, not off the data.
  double most_latitude = std::numeric_limits<double>::infinity();
};

/// Answers every line of `places` by one: its own columns, then height, gradient (rise per run),
/// slope (degrees) and aspect (degrees clockwise from north, downhill), empty where there is none.
/// Empty lines and comments come back as they are; a line of names gets four more. Places that are
/// written in another CRS stand in their columns, empty where they have none there, and the columns
/// are called x and y, or longitude and latitude.
///
/// write: what takes the lines, in order, many at a time. Reports "points".
/// Throws: stream::Error on bad lines, latitudes beyond a pole and a damaged store,
/// stream::Stopped, what `write` throws.
SampleCounts answer_places(const stream::Store& store, const SamplerOptions& options,
                           PlaceFile& places, const PlaceConversions& conversions,
                           const std::function<void(std::string_view)>& write,
                           const Context& context);

}  // namespace terrace::terrain
