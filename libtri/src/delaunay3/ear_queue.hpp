// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh.hpp"

namespace terrace::tri::spatial {

/// Fills mesh.hole, which one vertex at `removed` has left, by cutting ears, see ear_queue.cpp.
template <class Kernel>
void fill_by_ears(Mesh<Kernel>& mesh, const typename Kernel::Point& removed);

}  // namespace terrace::tri::spatial
