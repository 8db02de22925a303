// SPDX-License-Identifier: Apache-2.0
#include "view/store_view_impl.hpp"

/// The part of the view that needs neither threads nor PROJ nor CGAL, for WebAssembly.

namespace terrace::terrain {

template class StoreView<tri::ThinnedDelaunay2>;
template class StoreView<tri::PointCloud>;

}  // namespace terrace::terrain
