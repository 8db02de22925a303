// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "../pool.hpp"

namespace terrace::tri::planar {

/// Numbers of the points along a Hilbert curve over their bounding box, so that points close in the
/// result are close in the plane. Points too close to tell apart by 16 bits per axis are sorted in
/// their own box. Points are valid. O(n); 16 bytes per point while it runs besides the result.
template <class Coord>
Pool<std::uint32_t> hilbert_order(std::span<const std::array<Coord, 2>> points);

}  // namespace terrace::tri::planar
