// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "pool.hpp"

namespace terrace::tri {

/// Indices of the points along a Hilbert curve over their bounding square or cube, so that points
/// close in the result are close in the plane or in space. Points that 16 (in space 10) bits per
/// axis cannot distinguish are sorted in their own square or cube. Points must be valid. O(n);
/// needs 16 bytes per point besides the result.
template <class Point>
Pool<std::uint32_t> hilbert_order(std::span<const Point> points, unsigned threads = 1);

}  // namespace terrace::tri
