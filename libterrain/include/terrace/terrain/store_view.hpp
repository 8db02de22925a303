// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include <terrace/stream/given_bytes.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>
#include <terrace/tri/view.hpp>

namespace terrace::terrain {

struct ViewTraffic {
  std::uint64_t clusters = 0, points = 0;
  std::uint64_t bytes = 0;  ///< as they are stored
};

/// What a view makes of a store's points.
template <class Shown>
struct ViewTriangulation {
  using type = tri::Delaunay2<Shown>;
};
template <>
struct ViewTriangulation<tri::PointCloud> {
  using type = tri::PointCloud;
};
template <class Coord>
struct ViewTriangulation<tri::DynamicSurface<Coord>> {
  using type = tri::DynamicSurface<Coord>;
};

/// Whether the points of a store are taken for the scan of a body, to be shown by its surface: no
/// raster, triangles or lines, in no reference system, without classes as laser clouds have them,
/// and the Delaunay triangles of their horizontal places, at the top, are steeper than 60 degrees
/// by more than half of their area, as those between the two sides of a body are. ground: the
/// linear map from stored coordinates to metres. O(n log n) for the n points of the top.
/// Throws: stream::Error if the top is damaged; stream::MissingBytes.
[[nodiscard]] bool is_scan(const stream::Store& store, const stream::LinearMap& ground);

/// A store under a camera: clusters expand where the camera comes near and collapse where it has
/// been, frame by frame, under budgets of time and memory. (J. Skala, Algorithms for manipulating
/// large geometric data, section 8.4; the control is tri::ViewControl, which this feeds.)
///
/// Cameras, regions and focuses are in the *view frame*: metres east, north and up, its origin
/// above the middle of the store at height 0. It is flat: one linear map for the whole store, of
/// the CRS's scale at the middle. The triangulation itself stays in stored coordinates;
/// in_view_frame() tells where its vertices are.
///
/// Shown: std::int32_t for rasters, whose triangulation is exact on integers; double for any store;
/// tri::PointCloud for the points alone; tri::DynamicSurface<std::int32_t> for scans: the surface
/// in space that the points lie on, of open scans without lids (tri::DynamicSurface), which is part
/// of what a frame may spend. Its vertices are not in stored coordinates but on a lattice in the
/// view frame, of a power of two metres, 2^-29 to 2^-28 of the longest side of the store's box, to
/// which points are rounded.
///
/// All points of a store are shown, whatever condition it was given (stream::Store::where()).
///
/// Members may be called by one thread at a time.
template <class Shown>
class StoreView {
 public:
  using Control = tri::ViewControl<typename ViewTriangulation<Shown>::type>;
  using Step = typename Control::Step;

  /// Who reads and decodes what a frame lacks.
  enum class Reader : std::uint8_t {
    thread,   ///< a thread of its own; a frame takes what is there
    in_frame  ///< the calling thread, within the frame's time
  };

  /// Throws: stream::Error if the root is damaged; std::invalid_argument for options out of range.
  /// Requires a raster if Shown is std::int32_t.
  explicit StoreView(const stream::Store& store, const tri::ViewOptions& options = {},
                     Reader reader = Reader::thread);
  /// For stores of which some bytes may be missing (stream::GivenBytes), read by the calling thread
  /// within the frame's time. ground: the linear map from stored coordinates to metres, as the
  /// other constructor finds it and ground() tells. given: as GivenBytes::has(), by which a
  /// frame tells faster that bytes are still missing. Needs neither threads nor PROJ.
  /// Throws: as above, and stream::MissingBytes.
  StoreView(const stream::Store& store, const stream::LinearMap& ground,
            const tri::ViewOptions& options,
            std::function<bool(const stream::ByteRange&)> given = {});
  ~StoreView();
  StoreView(const StoreView&) = delete;
  StoreView& operator=(const StoreView&) = delete;

  /// Brings the model nearer to what `view` asks for, which takes about `seconds` at most, less
  /// `after` for each point that came and that went (tri::StepBudget). The step tells which
  /// triangles came and went. Throws: stream::Error once a cluster could not be read;
  /// stream::Stopped if the store is to stop.
  const Step& frame(const tri::View& view, double seconds, const std::array<double, 2>& after = {});
  /// Computes from scratch what frames only follow, see tri::ViewControl::restore(): the surface of
  /// a scan, for a camera that rests. The delta is valid until the next frame.
  const typename Control::Delta& restore(unsigned threads = 1);
  /// Whether another frame with the view of the last one would change nothing, now or later.
  [[nodiscard]] bool settled() const;
  /// The bytes that the last frame lacked for what is wanted, the most important first; a frame
  /// after they were given goes on. Always empty with a reader of its own. O(1).
  [[nodiscard]] std::span<const stream::ByteRange> missing() const;

  /// As in tri::ViewControl.
  void pin(tri::ClusterId cluster, tri::ViewPin how);
  void unpin(tri::ClusterId cluster);

  [[nodiscard]] const Control& control() const;
  [[nodiscard]] const typename Control::Model& model() const { return control().model(); }

  /// From a step in stored coordinates to metres.
  [[nodiscard]] const stream::LinearMap& ground() const;
  /// A vertex in stored coordinates; of a surface up to the lattice's rounding.
  [[nodiscard]] stream::Point3 stored(tri::VertexId vertex) const;
  /// Metres east, north and up of a point in stored coordinates.
  [[nodiscard]] stream::Point3 in_view_frame(const stream::Point3& stored) const;
  [[nodiscard]] stream::Point3 in_view_frame(tri::VertexId vertex) const;
  /// The same of a place in the model's coordinates, in which slides are (tri::Geomorph).
  [[nodiscard]] stream::Point3 model_in_view_frame(const stream::Point3& place) const;

  /// Whether a triangle of a raster spans samples without data; false for other stores. Its corners
  /// are then not neighbours in columns and rows, and its centroid is farther than a cell from the
  /// boxes of all collapsed clusters. Never true where every sample has data; gaps narrower than
  /// the clusters beside them are not seen. 0.03 to 0.6 us.
  [[nodiscard]] bool spans_gap(tri::TriangleId triangle) const;
  /// Whether that can be true of any triangle.
  [[nodiscard]] bool has_gaps() const;

  /// The attributes of a vertex's point, a record of the store's schema; empty if its cluster is no
  /// longer kept. Those of what a frame has added are there until the next frame, those of the root
  /// always.
  [[nodiscard]] std::span<const std::byte> attributes(tri::VertexId vertex) const;

  /// What has been read so far, the root included.
  [[nodiscard]] ViewTraffic traffic() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

extern template class StoreView<std::int32_t>;
extern template class StoreView<double>;
extern template class StoreView<tri::PointCloud>;
extern template class StoreView<tri::DynamicSurface<std::int32_t>>;

}  // namespace terrace::terrain
