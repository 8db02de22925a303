// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <type_traits>
#include <vector>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "int_kernel.hpp"
#include "mesh.hpp"
#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/metric.hpp"

namespace terrace::tri {
namespace planar {

/// Types for computing in a metric: the kernel, the form of the metric that its predicates take,
/// and the scope that passes this form to them for the duration of a call.
template <class Coord, class Metric>
struct InMetric;

template <class Coord>
struct InMetric<Coord, Euclidean> {
  using Kernel = std::conditional_t<std::is_same_v<Coord, double>, DoubleKernel, IntKernel>;
  using Form = Euclidean;
  struct Scope {
    explicit Scope(Form) {}
  };
};

template <>
struct InMetric<double, EllipticalMetric2> {
  using Kernel = EllipticalKernel;
  using Form = QuadraticForm;
  using Scope = EllipticalKernel::Scope;
};

}  // namespace planar

template <class Coord, class Metric>
struct Delaunay2<Coord, Metric>::Impl : planar::InMetric<Coord, Metric> {
  using Base = planar::InMetric<Coord, Metric>;
  explicit Impl(const Metric& value) : metric(value), form(value) {}
  [[nodiscard]] typename Base::Scope scope() const { return typename Base::Scope(form); }

  Metric metric;
  typename Base::Form form;
  planar::Mesh<typename Base::Kernel> mesh;
  std::vector<std::uint32_t> set;  ///< scratch of remove()
};

/// For the library's own parts, tests and benchmarks.
struct Delaunay2Access {
  template <class Coord, class Metric>
  static const auto& mesh(const Delaunay2<Coord, Metric>& triangulation) {
    return triangulation.impl_->mesh;
  }
  /// Predicates on the mesh need this scope, which must not outlive the triangulation.
  template <class Coord, class Metric>
  static auto scope(const Delaunay2<Coord, Metric>& triangulation) {
    return triangulation.impl_->scope();
  }
};

/// Checks a triangulation completely: counts, free lists, links, orientation, the perturbed empty
/// circle across every edge, the hull, and the sorted line while there are no triangles. Returns a
/// description of the first fault, or an empty string. O(n).
template <class Coord, class Metric>
std::string find_fault(const Delaunay2<Coord, Metric>& triangulation);

}  // namespace terrace::tri
