// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "../pool.hpp"

namespace terrace::tri::planar {

/// Indices of the points along a Hilbert curve over their bounding box, so that points close in the
/// result are close in the plane. Points that 16 bits per axis cannot distinguish are sorted in
/// their own box. Points must be valid. O(n); needs 16 bytes per point besides the result.
template <class Coord>
Pool<std::uint32_t> hilbert_order(std::span<const std::array<Coord, 2>> points);

}  // namespace terrace::tri::planar
