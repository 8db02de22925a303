// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <type_traits>

#include "double_kernel.hpp"
#include "int_kernel.hpp"
#include "mesh.hpp"
#include "terrace/tri/delaunay2.hpp"

namespace terrace::tri {

template <class Coord>
struct Delaunay2<Coord>::Impl {
  using Kernel =
      std::conditional_t<std::is_same_v<Coord, double>, planar::DoubleKernel, planar::IntKernel>;
  planar::Mesh<Kernel> mesh;
  std::vector<std::uint32_t> set;  ///< scratch of remove()
};

/// For the library's own tests.
struct Delaunay2Access {
  template <class Coord>
  static const auto& mesh(const Delaunay2<Coord>& triangulation) {
    return triangulation.impl_->mesh;
  }
};

/// Full test of a triangulation: counts, free lists, links, orientation, the perturbed empty circle
/// across every edge, the hull, and the sorted line while there are no triangles. Returns what is
/// wrong first, or an empty string. O(n).
template <class Coord>
std::string find_fault(const Delaunay2<Coord>& triangulation);

}  // namespace terrace::tri
