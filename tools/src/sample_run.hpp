// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <terrace/stream/store.hpp>

#include "height_sampler.hpp"
#include "place_file.hpp"

namespace terrace::tools {

struct SampleCounts {
  std::uint64_t points = 0;    ///< lines with a place
  std::uint64_t answered = 0;  ///< of these, with a height
};

/// How the places' own coordinates are written, if not as they came.
struct OutputPlaces {
  std::function<void(std::span<Point2>)> convert;  ///< in place; called on several threads at once
  int decimals = 4;
};

/// Answers every line of `places` by one: its own columns, then height, gradient (rise per run),
/// slope (degrees) and aspect (degrees clockwise from north, downhill), empty where there is none.
/// Empty lines and comments come back as they are; a line of names gets four more.
///
/// to_store: from the places' coordinates to the store's CRS, in place, if they differ; called on
/// several threads at once. written: what x and y become in the lines; the other columns stay.
/// write: what takes the lines, in order, many at a time. Throws: stream::Error on bad lines and a
/// damaged store, Interrupted, what `write` throws.
SampleCounts answer_places(const stream::Store& store, const SamplerOptions& options,
                           PlaceFile& places,
                           const std::function<void(std::span<Point2>)>& to_store,
                           const std::optional<OutputPlaces>& written,
                           const std::function<void(std::string_view)>& write,
                           const std::function<void(const SampleCounts&)>& progress);

}  // namespace terrace::tools
