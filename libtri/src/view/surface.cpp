// SPDX-License-Identifier: Apache-2.0
#include "model/multiresolution.hpp"
#include "view/control.hpp"
#include "view/geomorph.hpp"

/// Explicit instantiations for surfaces in space with integer coordinates. They have their own file
/// so that programs for the plane do not link the code for space.

namespace terrace::tri {

template class MultiresolutionModel<DynamicSurface<std::int32_t>>;
template class ViewControl<DynamicSurface<std::int32_t>>;
template class Geomorph<DynamicSurface<std::int32_t>>;

}  // namespace terrace::tri
