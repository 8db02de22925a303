// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// -1, 0 or 1: c lies right of, on, or left of the directed line a to b. Exact for all doubles
/// whose products neither overflow nor underflow.
/// Source: J. R. Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
/// Predicates (1997), doi:10.1007/PL00009321; here one filter and the full expansion.
int orientation(const Point2& a, const Point2& b, const Point2& c);

}  // namespace terrace::terrain
