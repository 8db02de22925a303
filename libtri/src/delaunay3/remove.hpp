// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "delaunay3/mesh.hpp"
#include "delaunay3/wrap/wrap.hpp"

namespace terrace::tri::spatial {

/// Fills mesh.hole, like wrap_hole().
template <class Kernel>
using FillHole = void (*)(Mesh<Kernel>& mesh);

/// Removes one or many different vertices, see remove.cpp.
template <class Kernel>
void remove_set(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices,
                FillHole<Kernel> fill = wrap_hole<Kernel>);

}  // namespace terrace::tri::spatial
