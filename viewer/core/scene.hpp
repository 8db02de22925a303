// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <terrace/stream/given_bytes.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>
#include <terrace/tri/view.hpp>

#include "cloud_colours.hpp"

namespace terrace::viewer {

/// A vertex in the layout for the GPU: metres in the view frame of terrain::StoreView, with heights
/// relative to the middle of Scene::box().
struct SceneVertex {
  static constexpr std::uint8_t kNone = 255;  ///< the level of a slot without a vertex

  float x = 0, y = 0, z = 0;
  std::array<std::int8_t, 3> normal{};  ///< upward, times 127
  std::uint8_t level = kNone;           ///< the point's highest level
  float start_z = 0;                    ///< the z at which the slide starts
  float start_time = -1e9F;             ///< when the slide started, in the time of Scene::frame()
};
static_assert(sizeof(SceneVertex) == 24);

/// A vertex of a cloud, whose points do not slide.
struct ScenePoint {
  float x = 0, y = 0, z = 0;
  std::array<std::int8_t, 3> normal{};  ///< of a surface: outward, times 127; otherwise 0
  std::uint8_t level = SceneVertex::kNone;
  std::array<std::uint8_t, 3> rgb{};
  std::uint8_t group = 0, intensity = 0;
};
static_assert(sizeof(ScenePoint) == 24);

/// A vertex of the surface of a scan. Its first members use the padding of ScenePoint.
struct SceneBodyPoint : ScenePoint {
  std::int8_t start_exponent = 0;       ///< exponent of start's unit: 2^n metres
  std::array<std::int16_t, 3> start{};  ///< start of the slide, relative to x, y, z
  float start_time = -1e9F;             ///< when the slide started
};
static_assert(sizeof(SceneBodyPoint) == 32);

using SceneTriangle = std::array<std::uint32_t, 3>;  ///< slots of vertices; all 0: none

/// The changes of a frame to the drawn arrays. Removed parts may be drawn for a while, in separate
/// slots before those of the model. Changes are listed in blocks of 64 slots: block b is slots 64 b
/// ... 64 b + 63.
struct SceneChanges {
  static constexpr std::size_t kBlock = 64;
  std::vector<std::uint32_t> vertex_blocks, triangle_blocks;
  std::span<const std::byte>
      vertices;  ///< kBlock SceneVertex, ScenePoint or SceneBodyPoint for each of vertex_blocks
  std::vector<SceneTriangle> triangles;  ///< kBlock for each of triangle_blocks
};

struct SceneState {
  std::size_t points = 0;  ///< drawn; a raster may know more samples
  std::size_t triangles = 0, expanded = 0;
  std::size_t vertex_slots = 0, triangle_slots = 0;
  bool settled = false;
  bool waiting = false;  ///< removed parts are still drawn until a later frame
  double worst = 0.0;    ///< as in tri::ViewControl::Step
  std::size_t clusters = 0, stored_bytes = 0;  ///< read so far
};

struct SceneHit {
  stream::Point3 stored{};   ///< on the surface, or the point itself, in stored coordinates
  stream::Point3 place{};    ///< the same in the view frame
  unsigned level = 0;        ///< level of the nearest corner
  tri::ClusterId cluster{};  ///< the cluster that has that corner as a member
  /// The cluster to expand here: the coarsest collapsed one that the corner heads. If all samples
  /// around a raster's corner are known, its cluster of level 0, of which all samples will be
  /// shown.
  std::optional<tri::ClusterId> expandable{};
  double corner_distance =
      0;  ///< on a surface: upper bound of the metres to that corner; for points 0
  /// Stored values of that corner. Empty for rasters, and if the corner's cluster is no longer in
  /// memory.
  std::vector<double> attributes{};
};

/// A store under a camera as arrays to draw: triangles for rasters, with the few vertices that the
/// error needs (tri::ThinnedDelaunay2), points for other stores. In the module for bodies
/// (TERRACE_VIEWER_BODY) it is the surface that the points were scanned from. Bytes of the store
/// may be missing.
class Scene {
 public:
  /// Opens a store; `has_bytes` is as in terrain::StoreView. Throws stream::MissingBytes,
  /// stream::Error, and std::invalid_argument for a store without points.
  static std::unique_ptr<Scene> open(
      const stream::Store& store, const stream::LinearMap& ground, std::size_t max_points,
      const std::function<bool(const stream::ByteRange&)>& has_bytes = {});
  virtual ~Scene() = default;

  /// Works as terrain::StoreView::frame() does. The cost of the changes, here and in
  /// take_changes(), counts towards `seconds`. `time` is the time of this frame, at which new
  /// vertices start to slide into place.
  virtual SceneState frame(const tri::View& view, double seconds, double time) = 0;
  /// Returns the changes since the last call; the first call returns everything. Call it after each
  /// frame.
  virtual const SceneChanges& take_changes() = 0;
  [[nodiscard]] virtual std::span<const stream::ByteRange> missing() const = 0;
  /// Recomputes a surface in space from scratch, so that it depends only on the points; frames only
  /// update it. 3 us per point natively. Does nothing for other scenes. `time` is as in frame().
  virtual void restore(double time) = 0;
  /// Returns a hash of the triangulation, or of the set of points.
  [[nodiscard]] virtual std::uint64_t hash() const = 0;
  /// Returns where a ray first meets the surface; for points, the point nearest to the ray's line
  /// as seen from its origin, within `angle` radians. O(drawn vertices and triangles).
  [[nodiscard]] virtual std::optional<SceneHit> pick(const stream::Point3& origin,
                                                     const stream::Point3& direction,
                                                     double angle) const = 0;
  /// Keeps a cluster expanded or collapsed until release(), or until it is pinned the other way.
  /// The cluster of the coarsest level stays expanded.
  virtual void pin(tri::ClusterId cluster, tri::ViewPin pin) = 0;
  virtual void release() = 0;
  /// Returns the lines, as slots of their ends, around the triangles whose corners all belong to a
  /// cluster, that is, to its head or below it; for rasters, at least one corner. For points,
  /// returns the points themselves, each as both ends. Empty for clusters that are not expanded.
  /// O(drawn vertices and triangles).
  [[nodiscard]] virtual std::vector<std::array<std::uint32_t, 2>> outline(
      tri::ClusterId cluster) const = 0;
  /// Returns the attributes that can colour points; none for rasters.
  [[nodiscard]] virtual const CloudColours& colours() const = 0;
  /// Returns the bounding box of all points in the view frame.
  [[nodiscard]] virtual stream::Box3 box() const = 0;
};

}  // namespace terrace::viewer
