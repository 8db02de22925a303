// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Returns why and where a polygon is invalid by OGC Simple Features; nullopt if it is valid.
/// Sweeps over the edges; exact, O(n log n) for n corners in any arrangement. Source: M. Shamos, D.
/// Hoey, Geometric intersection problems, 1976. Requires finite coordinates and at least one ring.
/// Throws: stream::Stopped.
[[nodiscard]] std::optional<std::string> fault_of(const Polygon& polygon,
                                                  const std::stop_token& stop = {});

}  // namespace terrace::terrain
