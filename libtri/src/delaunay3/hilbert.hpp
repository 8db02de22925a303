// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "../pool.hpp"

namespace terrace::tri::spatial {

/// Indices of the points along a Hilbert curve over their bounding cube, so that points close in
/// the result are close in space. Points that 10 bits per axis cannot distinguish are sorted in
/// their own cube. Points must be valid. O(n); needs 16 bytes per point besides the result.
template <class Coord>
Pool<std::uint32_t> hilbert_order(std::span<const std::array<Coord, 3>> points,
                                  unsigned threads = 1);

}  // namespace terrace::tri::spatial
