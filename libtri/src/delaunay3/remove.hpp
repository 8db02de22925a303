// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "mesh.hpp"

namespace terrace::tri::spatial {

/// Removes one or many different vertices, see remove.cpp.
template <class Kernel>
void remove_set(Mesh<Kernel>& mesh, std::span<const std::uint32_t> vertices);

/// Fills mesh.hole, which one vertex at `removed` has left, by cutting ears, see ear_queue.cpp.
template <class Kernel>
void fill_by_ears(Mesh<Kernel>& mesh, const typename Kernel::Point& removed);

}  // namespace terrace::tri::spatial
