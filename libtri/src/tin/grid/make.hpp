// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "path.hpp"
#include "terrace/tri/grid_tin.hpp"

namespace terrace::tri::tin {

/// grid_tin() with chosen instructions, for tests.
template <class T>
GridTin make_grid_tin(const GridWindow<T>& window, const GridSides& sides,
                      const GridTinOptions& options, GridPath path);

/// check_grid_tin() with chosen instructions, for tests.
template <class T>
GridTinCheck check_grid_tin_by(const GridWindow<T>& window, std::span<const Point3> points,
                               std::span<const std::array<std::uint32_t, 3>> triangles,
                               double tolerance, GridPath path);

}  // namespace terrace::tri::tin
