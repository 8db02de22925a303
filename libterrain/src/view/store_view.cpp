// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/store_view.hpp"

#include <utility>

#include "base/store_checks.hpp"
#include "earth/ground.hpp"
#include "terrace/terrain/latitudes.hpp"
#include "terrace/terrain/surface_view.hpp"
#include "view/frame.hpp"
#include "view/store_view_impl.hpp"

namespace terrace::terrain {

ViewFrame view_frame(const stream::Store& store) {
  check_latitudes(store);
  return {store, Ground(store.schema()).map(store.bounds())};
}

template <class Shown>
StoreView<Shown>::StoreView(const stream::Store& store, const tri::ViewOptions& options,
                            Reader reader, ViewMetrics<Shown> metrics)
    : impl_(std::make_unique<Impl>(
          store, view_frame(store).ground(), options,
          [&](FramedSource& source) {
            return reader == Reader::thread ? make_reading_thread(source)
                                            : make_frame_reader(source);
          },
          std::move(metrics))) {}

SurfaceView::SurfaceView(const stream::Store& store, const tri::ViewOptions& options,
                         const Context& context)
    : SurfaceView(
          [&] {
            const stream::Store source = store.with_stop(context.stop);
            // While the store is read: the stored tree and triangles, and those of the view.
            constexpr std::uint64_t kBytesPerPoint = 400;
            need_memory_for_surface(
                source, source.points(), kBytesPerPoint + source.schema().payload_size(),
                context.memory_or(0), stream::message("view it without its stored surface"));
            return source;
          }(),
          view_frame(store).ground(), options) {}

template StoreView<tri::ThinnedDelaunay2>::StoreView(const stream::Store&, const tri::ViewOptions&,
                                                     Reader, ViewMetrics<tri::ThinnedDelaunay2>);
template StoreView<tri::PointCloud>::StoreView(const stream::Store&, const tri::ViewOptions&,
                                               Reader, ViewMetrics<tri::PointCloud>);
template StoreView<tri::DynamicSurface<std::int32_t>>::StoreView(
    const stream::Store&, const tri::ViewOptions&, Reader,
    ViewMetrics<tri::DynamicSurface<std::int32_t>>);
template class StoreView<std::int32_t>;
template class StoreView<double>;
template class StoreView<tri::RegionalDelaunay2<std::int32_t>>;
template class StoreView<tri::RegionalDelaunay2<double>>;

}  // namespace terrace::terrain
