// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "terrace/stream/point.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// A lattice for coordinates that have none: steps of a power of ten from 1e-9 on, the same for x
/// and y. They are as small as the decimals of `points` require, and large enough that 32 bits
/// reach all of `bounds`. Without bounds they reach a thousand times as far as the points, of which
/// others may follow; steps of 0.001 (in degrees 1e-7), 2,000 km either way, only twenty times.
Lattice decimal_lattice(std::span<const Point3> points, const std::optional<Box3>& bounds,
                        bool degrees);

}  // namespace terrace::stream
