// SPDX-License-Identifier: Apache-2.0
#include "view/store_view_impl.hpp"

/// The part of core.cpp for surfaces of scans. It is separate, because only these need the
/// triangulation in space.

namespace terrace::terrain {

template class StoreView<tri::DynamicSurface<std::int32_t>>;

}  // namespace terrace::terrain
