// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "terrace/stream/point.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// A lattice for coordinates that have none: steps of a power of ten from 1e-9 on, the same for x
/// and y. They are 0.001 (1e-7 for degrees), whatever decimals `points` have, as the points that
/// follow may have more; smaller where `points` require it; and larger where 32 bits would not
/// reach all of `bounds`. Without bounds they reach twenty times as far as the points, smaller
/// steps than those a thousand times.
Lattice decimal_lattice(std::span<const Point3> points, const std::optional<Box3>& bounds,
                        bool degrees);

}  // namespace terrace::stream
