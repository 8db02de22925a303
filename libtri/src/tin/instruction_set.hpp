// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/simd.hpp>
#include <terrace/base/stop_check.hpp>

#include "terrace/tri/grid_tin.hpp"
#include "terrace/tri/point_tin.hpp"

/// Public functions with a given instruction set, for tests that compare them.

namespace terrace::tri::tin {

/// grid_tin(). T: float or double.
template <class T>
GridTin make_grid_tin(const GridWindow<T>& window, const GridSides& sides,
                      const GridTinOptions& options, base::SimdPath set);

/// select_samples(). T: float or double.
template <class T>
std::vector<std::uint32_t> select_samples_with(const GridWindow<T>& window, const GridSides& sides,
                                               double max_error, base::SimdPath set,
                                               const base::StopCheck& check_stop = {});

/// check_grid_tin(). T: float or double.
template <class T>
GridTinCheck check_grid_tin_with(const GridWindow<T>& window, std::span<const Point3> points,
                                 std::span<const std::array<std::uint32_t, 3>> triangles,
                                 double tolerance, base::SimdPath set,
                                 const base::StopCheck& check_stop = {});

namespace rows {

/// point_tin() for SampleRows or SampleGrid.
template <class Samples>
PointTin make_tin(const Samples& samples, std::span<const Point3> frame,
                  const PointTinOptions& options, base::SimdPath set);

}  // namespace rows
}  // namespace terrace::tri::tin
