// SPDX-License-Identifier: Apache-2.0
#include "view/store_view_impl.hpp"

/// The part of the view that needs neither threads nor PROJ nor CGAL, for WebAssembly.

namespace terrace::terrain {

template class StoreView<std::int32_t>;
template class StoreView<tri::PointCloud>;

}  // namespace terrace::terrain
