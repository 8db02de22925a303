// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <type_traits>
#include <vector>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "int_kernel.hpp"
#include "mesh.hpp"
#include "terrace/tri/delaunay3.hpp"
#include "terrace/tri/metric.hpp"

namespace terrace::tri {
namespace spatial {

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
struct InMetric<double, EllipticalMetric3> {
  using Kernel = EllipticalKernel;
  using Form = QuadraticForm;
  using Scope = EllipticalKernel::Scope;
};

}  // namespace spatial

template <class Coord, class Metric>
struct Delaunay3<Coord, Metric>::Impl : spatial::InMetric<Coord, Metric> {
  using Base = spatial::InMetric<Coord, Metric>;
  explicit Impl(const Metric& value) : metric(value), form(value) {}
  [[nodiscard]] typename Base::Scope scope() const { return typename Base::Scope(form); }

  Metric metric;
  typename Base::Form form;
  spatial::Mesh<typename Base::Kernel> mesh;
  std::vector<std::uint32_t> set;  ///< scratch of remove()
};

/// For the library's own parts, tests and benchmarks.
struct Delaunay3Access {
  template <class Coord, class Metric>
  static const auto& mesh(const Delaunay3<Coord, Metric>& triangulation) {
    return triangulation.impl_->mesh;
  }
  template <class Coord, class Metric>
  static auto& mesh(Delaunay3<Coord, Metric>& triangulation) {
    return triangulation.impl_->mesh;
  }
  /// Predicates on the mesh need this scope, which must not outlive the triangulation.
  template <class Coord, class Metric>
  static auto scope(const Delaunay3<Coord, Metric>& triangulation) {
    return triangulation.impl_->scope();
  }
};

/// Checks a triangulation completely: counts, free lists, links, orientation, the perturbed empty
/// sphere across every facet, the hull, and the sorted list while there are no tetrahedra. Returns
/// a description of the first fault, or an empty string. O(n).
template <class Coord, class Metric>
std::string find_fault(const Delaunay3<Coord, Metric>& triangulation);

}  // namespace terrace::tri
