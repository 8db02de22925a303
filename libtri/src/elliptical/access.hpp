// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "delaunay2/elliptical_kernel.hpp"
#include "delaunay2/mesh.hpp"
#include "terrace/tri/elliptical.hpp"

namespace terrace::tri {

struct EllipticalDelaunay2::Impl {
  explicit Impl(const LinearMap2& wanted) : map(wanted), metric(wanted) {}
  LinearMap2 map;
  planar::EllipticalMetric metric;
  planar::Mesh<planar::EllipticalKernel> mesh;
  std::vector<std::uint32_t> set;  ///< scratch of remove()
};

/// For the library's own tests.
struct EllipticalDelaunay2Access {
  static const auto& impl(const EllipticalDelaunay2& triangulation) { return *triangulation.impl_; }
};

/// As find_fault() of Delaunay2, in the metric.
std::string find_fault(const EllipticalDelaunay2& triangulation);

}  // namespace terrace::tri
