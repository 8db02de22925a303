// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/store_view.hpp"

#include "earth/ground.hpp"
#include "terrace/terrain/latitudes.hpp"
#include "view/frame.hpp"
#include "view/store_view_impl.hpp"

namespace terrace::terrain {

ViewFrame view_frame(const stream::Store& store) {
  check_latitudes(store);
  return {store, Ground(store.schema()).map(store.bounds())};
}

template <class Shown>
StoreView<Shown>::StoreView(const stream::Store& store, const tri::ViewOptions& options,
                            Reader reader)
    : impl_(std::make_unique<Impl>(store, view_frame(store).ground(), options,
                                   [&](FramedSource& source) {
                                     return reader == Reader::thread ? make_reading_thread(source)
                                                                     : make_frame_reader(source);
                                   })) {}

template StoreView<tri::ThinnedDelaunay2>::StoreView(const stream::Store&, const tri::ViewOptions&,
                                                     Reader);
template StoreView<tri::PointCloud>::StoreView(const stream::Store&, const tri::ViewOptions&,
                                               Reader);
template StoreView<tri::DynamicSurface<std::int32_t>>::StoreView(const stream::Store&,
                                                                 const tri::ViewOptions&, Reader);
template class StoreView<std::int32_t>;
template class StoreView<double>;

}  // namespace terrace::terrain
