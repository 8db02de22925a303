// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "int_kernel.hpp"
#include "mesh.hpp"
#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/metric.hpp"
#include "windowed_kernel.hpp"

namespace terrace::tri {
namespace planar {

/// The types that belong to a metric: its kernel, the form in which predicates receive it, and the
/// scope that hands the form to the predicates during a call.
template <class Coord, class Metric>
struct MetricTraits;

/// The form and scope of a metric without parameters.
template <class Metric>
struct PlainTraits {
  using Form = Metric;
  struct Scope {
    explicit Scope(Form) {}
  };
};

template <class Coord>
struct MetricTraits<Coord, Euclidean> : PlainTraits<Euclidean> {
  using Kernel = std::conditional_t<std::is_same_v<Coord, double>, DoubleKernel, IntKernel>;
};

template <>
struct MetricTraits<std::int32_t, Windowed> : PlainTraits<Windowed> {
  using Kernel = WindowedKernel;
};

template <>
struct MetricTraits<double, EllipticalMetric2> {
  using Kernel = EllipticalKernel;
  using Form = QuadraticForm;
  using Scope = EllipticalKernel::Scope;
};

}  // namespace planar

template <class Coord, class Metric>
struct Delaunay2<Coord, Metric>::Impl : planar::MetricTraits<Coord, Metric> {
  using Base = planar::MetricTraits<Coord, Metric>;
  explicit Impl(const Metric& value) : metric(value), form(value) {}
  [[nodiscard]] typename Base::Scope scope() const { return typename Base::Scope(form); }

  Metric metric;
  typename Base::Form form;
  planar::Mesh<typename Base::Kernel> mesh;
  std::vector<std::uint32_t> to_remove;  ///< scratch of remove()
};

/// Gives the library's own sources, tests and benchmarks access to the mesh.
struct Delaunay2Access {
  template <class Coord, class Metric>
  static const auto& mesh(const Delaunay2<Coord, Metric>& triangulation) {
    return triangulation.impl_->mesh;
  }
  /// Returns the scope that predicates on the mesh need. It must not outlive the triangulation.
  template <class Coord, class Metric>
  static auto scope(const Delaunay2<Coord, Metric>& triangulation) {
    return triangulation.impl_->scope();
  }
};

/// Checks all invariants: counts, free lists, links, orientation, the perturbed empty
/// circle across every edge, the hull, and the sorted line while there are no triangles. Returns a
/// description of the first fault, or an empty string. O(n).
template <class Coord, class Metric>
std::string find_fault(const Delaunay2<Coord, Metric>& triangulation);

}  // namespace terrace::tri
