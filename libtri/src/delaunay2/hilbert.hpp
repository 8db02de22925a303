// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "../pool.hpp"

namespace terrace::tri::planar {

/// Indices of the points along a Hilbert curve over their bounding box, so that points close in the
/// result are close in the plane. Points that 16 bits per axis cannot distinguish are sorted in a
/// box of their own. Points must be valid. O(n); besides the result 16 bytes per point while it
/// runs.
template <class Coord>
Pool<std::uint32_t> hilbert_order(std::span<const std::array<Coord, 2>> points);

}  // namespace terrace::tri::planar
