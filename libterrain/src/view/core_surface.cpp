// SPDX-License-Identifier: Apache-2.0
#include "view/store_view_impl.hpp"

/// The same for surfaces of scans; separate from core.cpp because they need the triangulation in
/// space.

namespace terrace::terrain {

template class StoreView<tri::DynamicSurface<std::int32_t>>;

}  // namespace terrace::terrain
