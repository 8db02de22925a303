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

/// A vertex as a graphics processor takes it: metres in the view frame of terrain::StoreView, but
/// heights count from the middle of Scene::box().
struct SceneVertex {
  static constexpr std::uint8_t kNone = 255;  ///< the level of a slot without a vertex

  float x = 0, y = 0, z = 0;
  std::array<std::int8_t, 3> normal{};  ///< upward, times 127
  std::uint8_t level = kNone;           ///< the highest of the point
  float start_z = 0;                    ///< where z slides from
  float start_time = -1e9F;             ///< and when it began, in the seconds of Scene::frame()
};
static_assert(sizeof(SceneVertex) == 24);

/// The same of a cloud, whose points do not slide.
struct ScenePoint {
  float x = 0, y = 0, z = 0;
  std::array<std::int8_t, 3> normal{};  ///< of a surface: outward, times 127; else 0
  std::uint8_t level = SceneVertex::kNone;
  std::array<std::uint8_t, 3> rgb{};
  std::uint8_t group = 0, intensity = 0;
};
static_assert(sizeof(ScenePoint) == 24);

/// The same of the surface of a scan. What follows has a place in the bytes that the point leaves.
struct SceneBodyPoint : ScenePoint {
  std::int8_t start_exponent = 0;       ///< a power of two metres
  std::array<std::int16_t, 3> start{};  ///< so many of these from x, y, z the slide begins
  float start_time = -1e9F;             ///< and when
};
static_assert(sizeof(SceneBodyPoint) == 32);

using SceneTriangle = std::array<std::uint32_t, 3>;  ///< slots of vertices; all 0: none

/// What a frame has changed of what is drawn: what has gone may be drawn on for a while, in slots
/// of its own before those of the model. In blocks of 64 slots: block b is slots 64 b ... 64 b
/// + 63.
struct SceneChanges {
  static constexpr std::size_t kBlock = 64;
  std::vector<std::uint32_t> vertex_blocks, triangle_blocks;
  std::span<const std::byte>
      vertices;  ///< kBlock SceneVertex, ScenePoint or SceneBodyPoint for each of vertex_blocks
  std::vector<SceneTriangle> triangles;  ///< likewise
};

struct SceneState {
  std::size_t points = 0, triangles = 0, expanded = 0;
  std::size_t vertex_slots = 0, triangle_slots = 0;
  bool settled = false;
  bool waiting = false;  ///< what has gone is drawn on; a later frame will exchange it
  double worst = 0.0;    ///< as in tri::ViewControl::Step
  std::size_t clusters = 0, stored_bytes = 0;  ///< read so far
};

struct SceneHit {
  stream::Point3 stored{};           ///< on the surface, or the point itself, in stored coordinates
  stream::Point3 place{};            ///< the same in the view frame
  unsigned level = 0;                ///< of the nearest corner
  tri::ClusterId cluster{};          ///< whose member that corner is
  double reach = 0;                  ///< on a surface: metres to that corner at most; of points 0
  std::vector<double> attributes{};  ///< of that corner, stored values; empty if no longer kept
};

/// A store under a camera as arrays to draw: triangles of rasters, of other stores the points; in
/// the module for bodies (TERRACE_VIEWER_BODY) the surface that points of any store were scanned
/// from. Bytes of the store may be missing.
class Scene {
 public:
  /// Throws: stream::MissingBytes; stream::Error; std::invalid_argument for a store without points.
  /// given: as in terrain::StoreView.
  static std::unique_ptr<Scene> open(
      const stream::Store& store, const stream::LinearMap& ground, std::size_t max_points,
      const std::function<bool(const stream::ByteRange&)>& given = {});
  virtual ~Scene() = default;

  /// As terrain::StoreView::frame(); what the changes cost, here and in take_changes(), is part of
  /// the seconds. time: of this frame, from which new vertices slide into place.
  virtual SceneState frame(const tri::View& view, double seconds, double time) = 0;
  /// The changes since the last call; all there is at first. To be called after each frame.
  virtual const SceneChanges& take_changes() = 0;
  [[nodiscard]] virtual std::span<const stream::ByteRange> missing() const = 0;
  /// Computes a surface in space from scratch, which frames only follow: then it depends on the
  /// points alone. 3 us per point natively. Nothing to do for others. time: as in frame().
  virtual void restore(double time) = 0;
  /// The hash of the triangulation, or of the set of points.
  [[nodiscard]] virtual std::uint64_t hash() const = 0;
  /// Where a ray meets the surface first; of points, the one nearest to the ray's line as seen from
  /// its origin, within `angle` (radians). O(what is drawn).
  [[nodiscard]] virtual std::optional<SceneHit> pick(const stream::Point3& origin,
                                                     const stream::Point3& direction,
                                                     double angle) const = 0;
  /// Expands the clusters that the vertex nearest to a hit heads, one level down; or collapses the
  /// cluster that it is a member of. They stay so until release().
  virtual void pin(const SceneHit& hit, tri::ViewPin how) = 0;
  virtual void release() = 0;
  /// The lines, as slots of their ends, around the triangles whose corners all belong to a cluster:
  /// its head and what lies below it. Of points these themselves, each as both ends. Empty for
  /// clusters that are not expanded. O(what is drawn).
  [[nodiscard]] virtual std::vector<std::array<std::uint32_t, 2>> outline(
      tri::ClusterId cluster) const = 0;
  /// What points can be drawn by; nothing for rasters.
  [[nodiscard]] virtual const CloudColours& colours() const = 0;
  /// The box of all points in the view frame.
  [[nodiscard]] virtual stream::Box3 box() const = 0;
};

}  // namespace terrace::viewer
