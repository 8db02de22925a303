// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/base/simd.hpp>

#include "terrace/tri/grid_tin.hpp"
#include "tin/scan.hpp"

namespace terrace::tri::tin {

/// grid_tin() with a given instruction set. For tests.
template <class T>
GridTin make_grid_tin(const GridWindow<T>& window, const GridSides& sides,
                      const GridTinOptions& options, base::SimdPath set);

/// check_grid_tin() with a given instruction set. For tests.
template <class T>
GridTinCheck check_grid_tin_by(const GridWindow<T>& window, std::span<const Point3> points,
                               std::span<const std::array<std::uint32_t, 3>> triangles,
                               double tolerance, base::SimdPath set);

}  // namespace terrace::tri::tin
