// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/tri/shape.hpp>

/// CGAL's functions, each in a translation unit of its own: they take long to compile.

namespace terrace::tools {

/// Faces between the points, which are different and not all in one plane. With CGAL's defaults: 5
/// for the bound of the ratio of radii, 0.52 radians for the bend at an edge.
std::vector<std::array<std::uint32_t, 3>> advancing_front(std::span<const tri::Point3> points);

/// alpha, offset > 0; at least one point.
tri::Surface alpha_wrap(std::span<const tri::Point3> points, double alpha, double offset);

}  // namespace terrace::tools
