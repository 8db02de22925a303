// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <type_traits>

#include "double_kernel.hpp"
#include "int_kernel.hpp"
#include "mesh.hpp"
#include "terrace/tri/delaunay3.hpp"

namespace terrace::tri {

template <class Coord>
struct Delaunay3<Coord>::Impl {
  using Kernel =
      std::conditional_t<std::is_same_v<Coord, double>, spatial::DoubleKernel, spatial::IntKernel>;
  spatial::Mesh<Kernel> mesh;
  std::vector<std::uint32_t> set;  ///< scratch of remove()
};

/// For the library's own tests and benchmarks.
struct Delaunay3Access {
  template <class Coord>
  static const auto& mesh(const Delaunay3<Coord>& triangulation) {
    return triangulation.impl_->mesh;
  }
  template <class Coord>
  static auto& mesh(Delaunay3<Coord>& triangulation) {
    return triangulation.impl_->mesh;
  }
};

/// Full test of a triangulation: counts, free lists, links, orientation, the perturbed empty sphere
/// across every facet, the hull, and the sorted list while there are no tetrahedra. Returns what is
/// wrong first, or an empty string. O(n).
template <class Coord>
std::string find_fault(const Delaunay3<Coord>& triangulation);

}  // namespace terrace::tri
