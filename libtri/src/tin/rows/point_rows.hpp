// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <terrace/base/simd.hpp>

#include "terrace/tri/point_tin.hpp"
#include "tin/scan.hpp"

namespace terrace::tri::tin {

namespace points {

/// Throws as point_tin() does.
void check_options(const PointTinOptions& options, std::span<const Point3> frame);

}  // namespace points

namespace rows {

/// point_tin() for SampleRows or SampleGrid, with a given instruction set.
template <class Samples>
PointTin make_tin(const Samples& samples, std::span<const Point3> frame,
                  const PointTinOptions& options, base::SimdPath set);

}  // namespace rows
}  // namespace terrace::tri::tin
