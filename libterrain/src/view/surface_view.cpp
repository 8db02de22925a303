// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/surface_view.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include <terrace/stream/stored_surface.hpp>

#include "mesh/scan_surface_steps.hpp"
#include "surface/numbered_points.hpp"
#include "view/cluster_reader.hpp"
#include "view/frame.hpp"

namespace terrace::terrain {
namespace {

/// While the store is read: the stored tree and triangles, and those of the view.
constexpr std::uint64_t kBytesPerPoint = 400;

}  // namespace

struct SurfaceView::Impl {
  /// The vertices of the surface: points of the store that are on it.
  struct Vertices {
    tri::Surface surface;  ///< in the view frame
    tri::VertexTree tree;
    std::vector<std::uint32_t> numbers;  ///< of the points
    std::vector<stream::Point3> stored;
    std::vector<std::byte> values;
  };

  Impl(const stream::Store& store, const stream::ClusterOrder& order, const ViewFrame& view_frame,
       Vertices&& vertices, const tri::ViewOptions& options)
      : frame(view_frame),
        clusters(order.clusters),
        record_bytes(store.schema().payload_size()),
        stored(std::move(vertices.stored)),
        values(std::move(vertices.values)),
        levels(vertices.tree.levels),
        numbers(std::move(vertices.numbers)),
        control(vertices.surface, vertices.tree, options) {}

  static Vertices read(const stream::Store& store, const stream::ClusterOrder& order,
                       const ViewFrame& frame);
  /// The index in the full surface.
  [[nodiscard]] std::size_t index(tri::VertexId vertex) const {
    return control.front().input()[slot(vertex)];
  }
  void apply_pins();

  ViewFrame frame;
  std::vector<stream::ClusterOrder::Cluster> clusters;
  std::size_t record_bytes = 0;
  // By index in the full surface.
  std::vector<stream::Point3> stored;
  std::vector<std::byte> values;
  std::vector<std::uint8_t> levels;
  std::vector<std::uint32_t> numbers;  ///< ascending
  tri::SurfaceControl control;
  std::map<tri::ClusterId, tri::ViewPin> pins;
  bool settled = false;
};

SurfaceView::Impl::Vertices SurfaceView::Impl::read(const stream::Store& store,
                                                    const stream::ClusterOrder& order,
                                                    const ViewFrame& frame) {
  stream::StoredSurface surface = store.read_surface(order);
  const std::vector<bool> on_surface = surface.on_surface();
  std::vector<std::uint32_t> vertex(order.points(), stream::kNoNumber);
  Vertices out;
  for (std::uint32_t number = 0; number < order.points(); ++number) {
    if (!on_surface[number]) continue;
    vertex[number] = static_cast<std::uint32_t>(out.numbers.size());
    out.numbers.push_back(number);
  }
  const std::size_t vertices = out.numbers.size(), bytes = store.schema().payload_size();
  out.surface.points.resize(vertices);
  out.stored.resize(vertices);
  out.values.resize(vertices * bytes);
  for_each_numbered_point(
      store, order,
      [&](std::uint32_t number, const stream::Point3& p, std::span<const std::byte> values) {
        const std::uint32_t v = vertex[number];
        if (v == stream::kNoNumber) return;
        out.stored[v] = p;
        out.surface.points[v] = frame(p);
        std::copy(values.begin(), values.end(),
                  out.values.begin() + static_cast<std::ptrdiff_t>(v * bytes));
      });
  for (const std::uint32_t number : out.numbers) {
    const std::uint32_t parent = surface.parents[number];
    out.tree.parents.push_back(parent == stream::kNoNumber ? stream::kNoNumber : vertex[parent]);
    out.tree.errors.push_back(surface.errors[number]);
    out.tree.levels.push_back(surface.levels[number]);
  }
  out.surface.faces = std::move(surface.triangles);
  for (auto& face : out.surface.faces) {
    for (std::uint32_t& corner : face) corner = vertex[corner];
  }
  return out;
}

// A cluster's vertices are those of its points that move when it is collapsed.
void SurfaceView::Impl::apply_pins() {
  std::vector<tri::VertexId> active, inactive;
  std::vector<tri::VertexId> vertex_of(numbers.size());
  for (std::uint32_t v = 0; v < numbers.size(); ++v) {
    vertex_of[control.front().input()[v]] = tri::VertexId{v};
  }
  for (const auto& [id, kind] : pins) {
    const auto cluster = std::find_if(clusters.begin(), clusters.end(),
                                      [&](const auto& one) { return one.id == id; });
    if (cluster == clusters.end()) continue;
    const auto begin = std::lower_bound(numbers.begin(), numbers.end(), cluster->begin);
    const auto end = std::lower_bound(begin, numbers.end(), cluster->end);
    for (auto at = begin; at != end; ++at) {
      const auto i = static_cast<std::size_t>(at - numbers.begin());
      if (levels[i] > tri::level_of(id)) continue;
      if (kind == tri::ViewPin::collapsed) {
        inactive.push_back(vertex_of[i]);
      } else if (levels[i] == tri::level_of(id)) {
        active.push_back(vertex_of[i]);
      }
    }
  }
  control.pin(active, inactive);
}

SurfaceView::SurfaceView(const stream::Store& store, const tri::ViewOptions& options,
                         const Context& context) {
  const stream::Store source = store.with_stop(context.stop);
  check_surface_memory(source, source.points(), kBytesPerPoint + source.schema().payload_size(),
                       context.memory_or(0));
  const stream::ClusterOrder order = stream::cluster_order(source);
  const ViewFrame frame = view_frame(source);
  impl_ = std::make_unique<Impl>(source, order, frame, Impl::read(source, order, frame), options);
}
SurfaceView::~SurfaceView() = default;

const SurfaceView::Step& SurfaceView::frame(const tri::View& view, double seconds,
                                            const std::array<double, 2>& after) {
  const Step& step =
      impl_->control.step(view, {.seconds = seconds, .clock = steady_seconds, .after = after});
  impl_->settled = step.settled;
  return step;
}
bool SurfaceView::settled() const { return impl_->settled; }

void SurfaceView::pin(tri::ClusterId cluster, tri::ViewPin kind) {
  impl_->pins[cluster] = kind;
  impl_->apply_pins();
}
void SurfaceView::unpin(tri::ClusterId cluster) {
  impl_->pins.erase(cluster);
  impl_->apply_pins();
}

const tri::SurfaceControl& SurfaceView::control() const { return impl_->control; }
const stream::Point3& SurfaceView::stored(tri::VertexId vertex) const {
  return impl_->stored[impl_->index(vertex)];
}
const stream::Point3& SurfaceView::in_view_frame(tri::VertexId vertex) const {
  return surface().point(vertex);
}
stream::Point3 SurfaceView::in_view_frame(const stream::Point3& stored) const {
  return impl_->frame(stored);
}
std::span<const std::byte> SurfaceView::attributes(tri::VertexId vertex) const {
  const std::size_t bytes = impl_->record_bytes;
  return std::span(impl_->values).subspan(impl_->index(vertex) * bytes, bytes);
}

}  // namespace terrace::terrain
