// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include <terrace/stream/store.hpp>

#include "region.hpp"

namespace terrace::tools {

struct ContourRequest {
  double interval = 0;           ///< in the store's vertical unit, above 0
  std::optional<Region> region;  ///< in the store's CRS
  unsigned threads = 1;
  std::uint64_t memory_bytes = std::uint64_t{1} << 30;
};

struct ContourOutcome {
  std::uint64_t lines = 0, closed = 0, points = 0;
};

/// The contour lines of a raster at full resolution as GeoJSON (RFC 7946): one LineString in
/// longitude and latitude per line, with its height as `elev`. With a region, those of the squares
/// of samples whose middles lie inside; lines end there. See ContourLines for what is exact.
///
/// Memory: a band of rows, and the lines that go on below it. Throws: stream::Error if the store is
/// no raster, has no CRS, does not meet the region, is damaged, or if the lines at work do not fit.
ContourOutcome write_contours(
    const stream::Store& store, const ContourRequest& request,
    const std::function<void(std::string_view)>& write,
    const std::function<void(std::uint64_t lines, double share)>& progress);

}  // namespace terrace::tools
