// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "terrace/stream/point.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// Chooses a lattice for coordinates that have none. Its steps are powers of ten, at least 1e-9,
/// and the same for x and y. They are 0.001 (1e-7 for degrees) or smaller if `points` need it;
/// points with fewer decimals do not make them larger, because later ones may have more. Steps are
/// larger where 32 bits would not cover `bounds`. Without bounds, 32 bits must cover twenty times
/// the extent of the points, or a thousand times if the steps are smaller than usual.
Lattice decimal_lattice(std::span<const Point3> points, const std::optional<Box3>& bounds,
                        bool degrees);

}  // namespace terrace::stream
