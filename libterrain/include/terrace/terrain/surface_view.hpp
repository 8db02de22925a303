// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>
#include <terrace/tri/surface_control.hpp>

#include "terrace/terrain/context.hpp"

namespace terrace::terrain {

/// The surface that is stored with a scan (BuildRequest::surface), seen by a camera: with few
/// triangles where an error is not visible, without tears wherever the detail varies.
/// tri::SurfaceControl decides.
///
/// Cameras, regions and focuses are in the view frame of StoreView. Vertices are not rounded.
///
/// Reads the whole store at once: about 220 bytes per vertex of the surface, and the attributes.
/// StoreView<tri::DynamicSurface> serves scans that are too large for that or have no stored
/// surface.
///
/// One thread at a time may call members.
class SurfaceView {
 public:
  using Step = tri::SurfaceControl::Step;

  /// Whether the store has a surface that can be viewed.
  [[nodiscard]] static bool serves(const stream::Store& store) {
    return store.surface().has_value();
  }

  /// Reads the store. Throws: stream::Error if there is no surface, for damage, or if it does not
  /// fit in memory; std::invalid_argument for options out of range; stream::Stopped.
  explicit SurfaceView(const stream::Store& store, const tri::ViewOptions& options = {},
                       const Context& context = {});
  /// The same with the map from stored coordinates to metres that StoreView::ground() returns.
  /// Needs no PROJ, and does not check whether memory suffices. Throws also: stream::MissingBytes.
  SurfaceView(const stream::Store& store, const stream::LinearMap& ground,
              const tri::ViewOptions& options);
  ~SurfaceView();
  SurfaceView(const SurfaceView&) = delete;
  SurfaceView& operator=(const SurfaceView&) = delete;

  /// Brings the surface closer to what `view` asks for, in at most about `seconds`, less `after`
  /// for each vertex that was added and removed (tri::StepBudget).
  const Step& frame(const tri::View& view, double seconds, const std::array<double, 2>& after = {});
  /// Whether another frame with the same view would change nothing.
  [[nodiscard]] bool settled() const;

  /// A cluster that is pinned expanded has all its vertices, those that move when it is collapsed;
  /// one that is pinned collapsed has none, nor do those below it. O(vertices).
  void pin(tri::ClusterId cluster, tri::ViewPin kind);
  void unpin(tri::ClusterId cluster);

  // ---- Clusters of vertices --------------------------------------------------------------------

  /// The cluster that removes a vertex when it collapses; the root for one that is always shown.
  [[nodiscard]] tri::ClusterId cluster(tri::VertexId vertex) const;
  /// The coarsest cluster below that one with the vertex, or the point at it, of which vertices are
  /// hidden. O(points of the clusters).
  [[nodiscard]] std::optional<tri::ClusterId> expandable(tri::VertexId vertex) const;
  /// Whether the vertex is a point of the cluster or below it. O(log clusters).
  [[nodiscard]] bool is_in(tri::ClusterId cluster, tri::VertexId vertex) const;

  // ---- Vertices --------------------------------------------------------------------------------

  [[nodiscard]] const tri::SurfaceControl& control() const;
  [[nodiscard]] const tri::SurfaceFront& surface() const { return control().front(); }
  /// Returns a vertex in stored coordinates.
  [[nodiscard]] const stream::Point3& stored(tri::VertexId vertex) const;
  /// Returns a vertex, or a point in stored coordinates, as metres east, north and up.
  [[nodiscard]] const stream::Point3& in_view_frame(tri::VertexId vertex) const;
  [[nodiscard]] stream::Point3 in_view_frame(const stream::Point3& stored) const;
  /// The attributes of a vertex, as a record of the store's schema.
  [[nodiscard]] std::span<const std::byte> attributes(tri::VertexId vertex) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::terrain
