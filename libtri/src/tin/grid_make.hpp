// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "grid_scan.hpp"
#include "terrace/tri/grid_tin.hpp"

namespace terrace::tri::tin {

/// grid_tin() with chosen instructions, for tests.
template <class T>
GridTin make_grid_tin(const GridWindow<T>& window, const GridSides& sides,
                      const GridTinOptions& options, GridPath path);

}  // namespace terrace::tri::tin
