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
  std::uint64_t answered = 0;  ///< lines with a height
};

/// Conversions of coordinates in place. Several threads may call them at once.
struct PlaceConversions {
  std::function<void(std::span<Point2>)> to_store;    ///< empty: places are in the store's CRS
  std::function<void(std::span<Point2>)> to_written;  ///< empty: lines keep their places
  bool writes_degrees = false;                        ///< whether to_written gives degrees
  /// The largest valid y if y is a latitude. A larger one is an error instead of an empty answer.
  double most_latitude = std::numeric_limits<double>::infinity();
};

/// Writes every line of `places` with its own columns, followed by height, gradient (rise per run),
/// slope (degrees) and aspect (degrees clockwise from north, downhill). Outside the surface these
/// are empty. Empty lines and comments are copied unchanged. The four names are appended to a
/// header line. Places in another CRS replace the original ones in their columns, which are named x
/// and y, or longitude and latitude. They are empty where they have no image.
///
/// write: receives the lines in order, many at a time. Reports "points". Throws: stream::Error on
/// invalid lines, latitudes beyond a pole and a damaged store; stream::Stopped; what `write`
/// throws.
SampleCounts answer_places(const stream::Store& store, const SamplerOptions& options,
                           PlaceFile& places, const PlaceConversions& conversions,
                           const std::function<void(std::string_view)>& write,
                           const Context& context);

}  // namespace terrace::terrain
