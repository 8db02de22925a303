// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/surface_view.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include <terrace/stream/stored_surface.hpp>

#include "base/numbered_points.hpp"
#include "view/cluster_reader.hpp"
#include "view/frame.hpp"

namespace terrace::terrain {

struct SurfaceView::Impl {
  /// The vertices of the surface: points of the store that are on it.
  struct Read {
    tri::Surface surface;  ///< in the view frame
    tri::VertexTree tree;
    std::vector<std::uint32_t> numbers;  ///< of the points
    std::vector<stream::Point3> stored;
    std::vector<std::byte> values;
  };

  Impl(const stream::Store& store, const stream::ClusterOrder& order, const ViewFrame& view_frame,
       Read&& read, const tri::ViewOptions& options)
      : frame(view_frame),
        clusters(order.clusters),
        record_bytes(store.schema().payload_size()),
        stored(std::move(read.stored)),
        values(std::move(read.values)),
        levels(read.tree.levels),
        numbers(std::move(read.numbers)),
        control(read.surface, read.tree, options) {
    vertices.resize(numbers.size());
    for (std::uint32_t v = 0; v < numbers.size(); ++v) {
      vertices[control.front().input()[v]] = tri::VertexId{v};
    }
    for (std::uint32_t c = 0; c < clusters.size(); ++c) {
      by_id.push_back(c);
      if (tri::level_of(clusters[c].id) == 0) leaves.push_back(c);
    }
    std::sort(by_id.begin(), by_id.end(),
              [this](std::uint32_t a, std::uint32_t b) { return clusters[a].id < clusters[b].id; });
  }

  static Read read(const stream::Store& store, const stream::ClusterOrder& order,
                   const ViewFrame& frame);
  /// The index in the full surface.
  [[nodiscard]] std::size_t index(tri::VertexId vertex) const {
    return control.front().input()[slot(vertex)];
  }
  /// Null if there is no such cluster.
  [[nodiscard]] const stream::ClusterOrder::Cluster* find(tri::ClusterId id) const;
  /// The cluster of level 0 that has a point.
  [[nodiscard]] const stream::ClusterOrder::Cluster& leaf(std::uint32_t number) const {
    const auto after = std::upper_bound(
        leaves.begin(), leaves.end(), number,
        [&](std::uint32_t wanted, std::uint32_t c) { return wanted < clusters[c].begin; });
    return clusters[*std::prev(after)];
  }
  /// The cluster above one at a level.
  [[nodiscard]] const stream::ClusterOrder::Cluster& above(
      const stream::ClusterOrder::Cluster& cluster, unsigned level) const {
    const auto* at = &cluster;
    while (tri::level_of(at->id) < level) at = &clusters[at->parent];
    return *at;
  }
  template <class Visit>
  void for_each_vertex(const stream::ClusterOrder::Cluster& cluster, const Visit& visit) const;
  void apply_pins();

  ViewFrame frame;
  std::vector<stream::ClusterOrder::Cluster> clusters;
  std::vector<std::uint32_t> by_id;   ///< all clusters
  std::vector<std::uint32_t> leaves;  ///< those of level 0, by their points
  std::size_t record_bytes = 0;
  // By index in the full surface.
  std::vector<stream::Point3> stored;
  std::vector<std::byte> values;
  std::vector<std::uint8_t> levels;
  std::vector<std::uint32_t> numbers;  ///< ascending
  tri::SurfaceControl control;
  std::vector<tri::VertexId> vertices;
  std::map<tri::ClusterId, tri::ViewPin> pins;
  bool settled = false;
};

SurfaceView::Impl::Read SurfaceView::Impl::read(const stream::Store& store,
                                                const stream::ClusterOrder& order,
                                                const ViewFrame& frame) {
  stream::StoredSurface surface = store.read_surface(order);
  const std::vector<bool> on_surface = surface.on_surface();
  std::vector<std::uint32_t> vertex(order.points(), stream::kNoNumber);
  Read out;
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
      [&](std::uint32_t number, const stream::Point3& p, std::span<const std::byte> record) {
        const std::uint32_t v = vertex[number];
        if (v == stream::kNoNumber) return;
        out.stored[v] = p;
        out.surface.points[v] = frame(p);
        std::copy(record.begin(), record.end(),
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

const stream::ClusterOrder::Cluster* SurfaceView::Impl::find(tri::ClusterId id) const {
  const auto found = std::lower_bound(
      by_id.begin(), by_id.end(), id,
      [&](std::uint32_t cluster, tri::ClusterId wanted) { return clusters[cluster].id < wanted; });
  if (found == by_id.end() || clusters[*found].id != id) return nullptr;
  return &clusters[*found];
}

/// Calls visit(index) for the vertices of the full surface that a cluster removes when it
/// collapses.
template <class Visit>
void SurfaceView::Impl::for_each_vertex(const stream::ClusterOrder::Cluster& cluster,
                                        const Visit& visit) const {
  const auto begin = std::lower_bound(numbers.begin(), numbers.end(), cluster.begin);
  const auto end = std::lower_bound(begin, numbers.end(), cluster.end);
  for (auto at = begin; at != end; ++at) {
    const auto index = static_cast<std::size_t>(at - numbers.begin());
    if (levels[index] == tri::level_of(cluster.id)) visit(index);
  }
}

void SurfaceView::Impl::apply_pins() {
  std::vector<tri::VertexId> active, inactive;
  for (const auto& [id, kind] : pins) {
    const auto* const cluster = find(id);
    if (cluster == nullptr) continue;
    if (kind == tri::ViewPin::expanded) {
      for_each_vertex(*cluster, [&](std::size_t index) { active.push_back(vertices[index]); });
      continue;
    }
    for (auto* at = cluster; at != clusters.data() + cluster->next; ++at) {
      for_each_vertex(*at, [&](std::size_t index) { inactive.push_back(vertices[index]); });
    }
  }
  control.pin(active, inactive);
}

SurfaceView::SurfaceView(const stream::Store& store, const stream::LinearMap& ground,
                         const tri::ViewOptions& options) {
  const stream::ClusterOrder order = stream::cluster_order(store);
  const ViewFrame frame(store, ground);
  impl_ = std::make_unique<Impl>(store, order, frame, Impl::read(store, order, frame), options);
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

tri::ClusterId SurfaceView::cluster(tri::VertexId vertex) const {
  const std::size_t index = impl_->index(vertex);
  return impl_->above(impl_->leaf(impl_->numbers[index]), impl_->levels[index]).id;
}

std::optional<tri::ClusterId> SurfaceView::expandable(tri::VertexId vertex) const {
  const std::size_t index = impl_->index(vertex);
  const auto& leaf = impl_->leaf(impl_->numbers[index]);
  for (unsigned level = impl_->levels[index]; level-- > 0;) {
    const auto& cluster = impl_->above(leaf, level);
    bool hides = false;
    impl_->for_each_vertex(cluster, [&](std::size_t other) {
      hides = hides || !surface().alive(impl_->vertices[other]);
    });
    if (hides) return cluster.id;
  }
  return std::nullopt;
}

bool SurfaceView::is_in(tri::ClusterId cluster, tri::VertexId vertex) const {
  const auto* const found = impl_->find(cluster);
  const std::uint32_t number = impl_->numbers[impl_->index(vertex)];
  return found != nullptr && number >= found->begin && number < found->end;
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
