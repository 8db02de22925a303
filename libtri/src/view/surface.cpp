// SPDX-License-Identifier: Apache-2.0
#include "view/control.hpp"
#include "view/geomorph.hpp"

/// Instantiates the model of a surface in space, its view control and its geomorphs, on integers.
/// Separate from those of the plane, which do not need space.

namespace terrace::tri {

template class MultiresolutionModel<DynamicSurface<std::int32_t>>;
template class ViewControl<DynamicSurface<std::int32_t>>;
template class Geomorph<DynamicSurface<std::int32_t>>;

}  // namespace terrace::tri
