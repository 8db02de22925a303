// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "terrace/terrain/store_view.hpp"
#include "view/cluster_reader.hpp"
#include "view/frame.hpp"
#include "view/raster_gap.hpp"

/// Template definitions of store_view.hpp, for files that instantiate it.

namespace terrace::terrain {

/// Whether vertices are on a lattice in the view frame.
template <class Shown>
inline constexpr bool shows_surface = false;
template <class Coord>
inline constexpr bool shows_surface<tri::DynamicSurface<Coord>> = true;

template <class Shown>
inline constexpr bool kThinned = std::is_same_v<Shown, tri::ThinnedDelaunay2>;
/// Whether the vertices are samples of a raster.
template <class Shown>
inline constexpr bool kShowsRaster = std::is_integral_v<Shown> || kThinned<Shown>;
template <class Coord>
inline constexpr bool kShowsRaster<tri::RegionalDelaunay2<Coord>> = std::is_integral_v<Coord>;

template <class Shown>
struct StoreView<Shown>::Impl : ViewMetrics<Shown> {
  using MakeReader = std::function<std::unique_ptr<ClusterReader>(FramedSource&)>;

  Impl(const stream::Store& input, const stream::LinearMap& ground, const tri::ViewOptions& options,
       const MakeReader& make_reader, ViewMetrics<Shown> metrics = {})
      : ViewMetrics<Shown>(std::move(metrics)),
        store(input),
        frame(store, ground),
        lattice(store, frame),
        source(store, frame, shows_surface<Shown> ? &lattice : nullptr, options.silhouette == 1.0,
               kThinned<Shown>),
        control(source.counts(), load_root(), options_of(options), empty()),
        reader(make_reader(source)) {
    assert((!kShowsRaster<Shown> || store.schema().grid));
  }

  /// Adds what a thinned raster needs.
  [[nodiscard]] tri::ViewOptions options_of(tri::ViewOptions options) const {
    if constexpr (kThinned<Shown>) {
      options.raster = {frame.ground(), frame({0, 0, 0})};
      options.raster_has_gaps =
          terrain::has_gaps(store) || store.bounds().min[0] > 0 || store.bounds().min[1] > 0;
    }
    return options;
  }
  [[nodiscard]] auto empty() const {
    using Triangulation = typename ViewTriangulation<Shown>::type;
    if constexpr (kThinned<Shown>) {
      if (store.bounds().empty()) return Triangulation({0, 0});
      const stream::Point3& last = store.bounds().max;
      return Triangulation(
          {static_cast<std::int32_t>(last[0]), static_cast<std::int32_t>(last[1])});
    } else if constexpr (requires { this->field; }) {
      return Triangulation(this->field);
    } else {
      return Triangulation();
    }
  }

  tri::LoadedCluster load_root() {
    tri::LoadedCluster root = source.load_root();
    root_values = root.values;
    return root;
  }
  /// The values of a cluster's members, read again. Valid until the next call.
  [[nodiscard]] std::span<const std::byte> values_again(tri::ClusterId cluster) {
    if (!reread || cluster != reread_cluster) {
      if (!reread) reread = std::make_unique<StoreSource>(store);
      reread_values = reread->read(cluster).values;
      reread_cluster = cluster;
    }
    return reread_values;
  }

  stream::Store store;
  ViewFrame frame;
  ViewLattice lattice;
  FramedSource source;
  std::vector<std::byte> root_values;
  std::unique_ptr<StoreSource> reread;  ///< apart from `source`, which another thread may use
  tri::ClusterId reread_cluster{};
  std::span<const std::byte> reread_values;
  Control control;
  bool settled = false;
  std::unique_ptr<ClusterReader> reader;
};

template <class Shown>
StoreView<Shown>::StoreView(const stream::Store& store, const stream::LinearMap& ground,
                            const tri::ViewOptions& options,
                            std::function<bool(const stream::ByteRange&)> input)
    : impl_(std::make_unique<Impl>(store, ground, options, [&](FramedSource& source) {
        return make_frame_reader(source, std::move(input));
      })) {}

template <class Shown>
StoreView<Shown>::~StoreView() = default;

template <class Shown>
const typename StoreView<Shown>::Step& StoreView<Shown>::frame(const tri::View& view,
                                                               double seconds,
                                                               const std::array<double, 2>& after) {
  const double begin = steady_seconds();
  impl_->reader->bring(
      seconds, [&](tri::LoadedCluster cluster) { impl_->control.give(std::move(cluster)); },
      [&](tri::ClusterId id, const tri::ClusterRecord& record) {
        impl_->control.give_record(id, record);
      });
  const double remaining = seconds - (steady_seconds() - begin);
  const Step& step =
      impl_->control.step(view, {.seconds = remaining, .clock = steady_seconds, .after = after});
  impl_->reader->ask(step.wanted, step.requests, step.withdrawn);
  impl_->settled = step.settled && step.wanted.empty();
  return step;
}

template <class Shown>
auto StoreView<Shown>::restore(unsigned threads) -> const typename Control::Delta& {
  return impl_->control.restore(threads);
}

template <class Shown>
bool StoreView<Shown>::settled() const {
  return impl_->settled;
}

template <class Shown>
std::span<const stream::ByteRange> StoreView<Shown>::missing() const {
  return impl_->reader->missing();
}

template <class Shown>
void StoreView<Shown>::pin(tri::ClusterId cluster, tri::ViewPin kind) {
  impl_->control.pin(cluster, kind);
}

template <class Shown>
void StoreView<Shown>::unpin(tri::ClusterId cluster) {
  impl_->control.unpin(cluster);
}

template <class Shown>
const typename StoreView<Shown>::Control& StoreView<Shown>::control() const {
  return impl_->control;
}

template <class Shown>
const stream::LinearMap& StoreView<Shown>::ground() const {
  return impl_->frame.ground();
}

template <class Shown>
stream::Point3 StoreView<Shown>::in_view_frame(const stream::Point3& stored) const {
  return impl_->frame(stored);
}

template <class Shown>
stream::Point3 StoreView<Shown>::in_view_frame(tri::VertexId vertex) const {
  if constexpr (shows_surface<Shown>) {
    const auto p = model().triangulation().point(vertex);
    return model_in_view_frame(
        {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
  } else {
    return impl_->frame(stored(vertex));
  }
}

template <class Shown>
stream::Point3 StoreView<Shown>::model_in_view_frame(const stream::Point3& place) const {
  if constexpr (shows_surface<Shown>) return impl_->lattice.in_view_frame(place);
  return impl_->frame(place);
}

template <class Shown>
stream::Point3 StoreView<Shown>::stored(tri::VertexId vertex) const {
  if constexpr (shows_surface<Shown>) {
    return impl_->frame.stored(in_view_frame(vertex));
  } else {
    const auto p = model().triangulation().point(vertex);
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), model().height(vertex)};
  }
}

template <class Shown>
std::size_t StoreView<Shown>::points() const {
  if constexpr (kThinned<Shown>) return model().triangulation().vertex_count();
  return model().point_count();
}

template <class Shown>
bool StoreView<Shown>::spans_gap(tri::TriangleId triangle) const {
  if constexpr (!kShowsRaster<Shown>) {
    return false;
  } else {
    const auto& mesh = model().triangulation();
    const auto corners = mesh.vertices(triangle);
    const auto far = [&](const stream::Box3& cells) {
      if constexpr (kThinned<Shown>) {
        // Not all samples of expanded clusters are vertices.
        if (mesh.is_in_thinned_window(triangle) ||
            mesh.has_hidden_sample_near((cells.min[0] + cells.max[0]) / 2,
                                        (cells.min[1] + cells.max[1]) / 2))
          return false;
      }
      tri::Box3 near = impl_->frame.box_of(cells);
      near.min[2] = -std::numeric_limits<double>::infinity();
      near.max[2] = std::numeric_limits<double>::infinity();
      // It is usually one of the clusters that the corners represent.
      for (const tri::VertexId corner : corners) {
        const auto record = control().represented_cluster(corner);
        if (record && record->box.intersects(near)) return false;
      }
      return !control().meets_collapsed(near);
    };
    return terrain::spans_gap(
        {mesh.point(corners[0]), mesh.point(corners[1]), mesh.point(corners[2])}, far);
  }
}

template <class Shown>
bool StoreView<Shown>::has_gaps() const {
  return kShowsRaster<Shown> && terrain::has_gaps(impl_->store);
}

template <class Shown>
std::span<const std::byte> StoreView<Shown>::attributes(tri::VertexId vertex) const {
  const tri::PointId id = model().point_id(vertex);
  const std::size_t bytes = impl_->store.schema().payload_size();
  if (tri::level_of(id.cluster) == model().top()) {
    return std::span(impl_->root_values).subspan(id.index * bytes, bytes);
  }
  const tri::LoadedCluster* const cached = control().cached_cluster(id.cluster);
  if constexpr (kThinned<Shown>) {
    // A vertex may be shown long after its cluster was loaded.
    if (cached == nullptr && bytes > 0)
      return impl_->values_again(id.cluster).subspan(id.index * bytes, bytes);
  }
  if (cached == nullptr) return {};
  return std::span(cached->values).subspan(id.index * bytes, bytes);
}

template <class Shown>
ViewTraffic StoreView<Shown>::traffic() const {
  return impl_->source.traffic();
}

}  // namespace terrace::terrain
