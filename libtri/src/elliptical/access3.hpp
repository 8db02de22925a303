// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "delaunay3/elliptical_kernel.hpp"
#include "delaunay3/mesh.hpp"
#include "terrace/tri/elliptical.hpp"

namespace terrace::tri {

struct EllipticalDelaunay3::Impl {
  explicit Impl(const LinearMap3& wanted) : map(wanted), metric(wanted) {}
  LinearMap3 map;
  spatial::EllipticalMetric metric;
  spatial::Mesh<spatial::EllipticalKernel> mesh;
  std::vector<std::uint32_t> set;  ///< scratch of remove()
};

/// For the library's own parts and tests.
struct EllipticalDelaunay3Access {
  static const auto& impl(const EllipticalDelaunay3& triangulation) { return *triangulation.impl_; }
};

/// As find_fault() of Delaunay3, in the metric.
std::string find_fault(const EllipticalDelaunay3& triangulation);

}  // namespace terrace::tri
