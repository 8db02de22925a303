// SPDX-License-Identifier: Apache-2.0
#include "view/control.hpp"
#include "view/geomorph.hpp"

/// The model of a surface in space, its control by a view and its geomorphs, on integers. Apart
/// from those of the plane, for which space is not needed.

namespace terrace::tri {

template class MultiresolutionModel<DynamicSurface<std::int32_t>>;
template class ViewControl<DynamicSurface<std::int32_t>>;
template class Geomorph<DynamicSurface<std::int32_t>>;

}  // namespace terrace::tri
