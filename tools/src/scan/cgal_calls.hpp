// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>
#include <terrace/tri/shape.hpp>

/// CGAL's functions, each in a separate translation unit because they take long to compile.

namespace terrace::tools {

/// Returns faces between distinct points that are not all in one plane, with CGAL's defaults: a
/// radius ratio bound of 5 and a beta of 0.52 radians. Calls check_stop for each candidate facet.
std::vector<std::array<std::uint32_t, 3>> advancing_front(std::span<const tri::Point3> points,
                                                          const base::StopCheck& check_stop);

/// Requires alpha > 0, offset > 0 and at least one point.
tri::Surface alpha_wrap(std::span<const tri::Point3> points, double alpha, double offset);

}  // namespace terrace::tools
