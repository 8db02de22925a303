// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// What makes a polygon invalid by OGC Simple Features, and where; nullopt if it is valid. Exact,
/// and O(n log n) for n corners of any shape: a sweep over the edges.
/// Source: M. Shamos, D. Hoey, Geometric intersection problems, 1976.
/// Requires finite coordinates, and a ring at least. Throws: stream::Stopped.
[[nodiscard]] std::optional<std::string> fault_of(const Polygon& polygon,
                                                  const std::stop_token& stop = {});

}  // namespace terrace::terrain
