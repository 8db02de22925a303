// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <terrace/stream/given_bytes.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>
#include <terrace/tri/regional_delaunay2.hpp>
#include <terrace/tri/view.hpp>

namespace terrace::terrain {

struct ViewTraffic {
  std::uint64_t clusters = 0, points = 0;
  std::uint64_t bytes = 0;  ///< as stored
};

/// Maps `Shown` to the structure that a view builds from a store's points.
template <class Shown>
struct ViewTriangulation {
  using type = tri::Delaunay2<Shown>;
};
template <>
struct ViewTriangulation<tri::ThinnedDelaunay2> {
  using type = tri::ThinnedDelaunay2;
};
template <>
struct ViewTriangulation<tri::PointCloud> {
  using type = tri::PointCloud;
};
template <class Coord>
struct ViewTriangulation<tri::DynamicSurface<Coord>> {
  using type = tri::DynamicSurface<Coord>;
};
template <class Coord>
struct ViewTriangulation<tri::RegionalDelaunay2<Coord>> {
  using type = tri::RegionalDelaunay2<Coord>;
};

/// The metrics of a view's triangles. Only those of tri::RegionalDelaunay2 have any.
template <class Shown>
struct ViewMetrics {};
template <class Coord>
struct ViewMetrics<tri::RegionalDelaunay2<Coord>> {
  /// In stored coordinates, see metric_field(). Euclidean by default.
  tri::MetricField2 field{std::vector<tri::MetricField2::Region>{}};
};

/// Whether a store's points look like the scan of a body, to be shown by its surface. They do if
/// they are points without a CRS and without the classes of laser clouds, and if they are steep: at
/// the top, more than half of the area of the Delaunay triangles of their horizontal places is
/// steeper than 60 degrees. Triangles between two sides of a body are that steep. ground: the
/// linear map from stored coordinates to metres. O(n log n) for the n points of the top. Throws:
/// stream::Error if the top is damaged; stream::MissingBytes.
[[nodiscard]] bool is_scan(const stream::Store& store, const stream::LinearMap& ground);

/// A store seen by a camera. Clusters expand where the camera approaches and collapse where it has
/// left, frame by frame, under budgets of time and memory. tri::ViewControl decides, and this class
/// supplies it with clusters. Source: J. Skala, Algorithms for manipulating large geometric data,
/// section 8.4.
///
/// Cameras, regions and focuses are in the *view frame*: metres east, north and up, with the origin
/// above the middle of the store at height 0. The frame is flat: one linear map for the whole
/// store, with the CRS's scale at the middle. The triangulation itself stays in stored coordinates;
/// in_view_frame() converts its vertices.
///
/// Shown selects the structure: tri::ThinnedDelaunay2 for rasters, with only the vertices that the
/// error needs; std::int32_t for rasters with all samples of each expanded cluster; double for any
/// store; tri::RegionalDelaunay2 of either for triangles that follow regions of elliptical metrics;
/// tri::PointCloud for points without triangles; or tri::DynamicSurface<std::int32_t> for scans.
/// The last one is the surface in space that the points are on, without lids for open scans. The
/// surface takes part of a frame's budget. Its vertices are not in stored coordinates but rounded
/// to a lattice in the view frame, with a spacing that is a power of two metres, 2^-29 to 2^-28 of
/// the longest side of the store's box.
///
/// With tri::ThinnedDelaunay2 an error is vertical. The surface of a window whose samples are all
/// loaded (tri::ThinnedDelaunay2::Window::thinned) is within the error that the view asks for there
/// at every sample. Elsewhere the ranges of heights of clusters serve as estimates.
///
/// Shows all points of a store, even if a condition was set (stream::Store::where()).
///
/// One thread at a time may call members.
template <class Shown>
class StoreView {
 public:
  using Control = tri::ViewControl<typename ViewTriangulation<Shown>::type>;
  using Step = typename Control::Step;

  /// Who reads and decodes the clusters that a frame lacks.
  enum class Reader : std::uint8_t {
    thread,   ///< a separate thread; a frame uses what is loaded
    in_frame  ///< the calling thread, within the frame's time
  };

  /// Requires a raster if Shown is std::int32_t (also with metrics) or tri::ThinnedDelaunay2.
  /// Throws: stream::Error if the root is damaged; std::invalid_argument for options out of range.
  explicit StoreView(const stream::Store& store, const tri::ViewOptions& options = {},
                     Reader reader = Reader::thread, ViewMetrics<Shown> metrics = {});
  /// For stores with missing bytes (stream::GivenBytes), read by the calling thread within the
  /// frame's time. ground: the linear map from stored coordinates to metres, as the other
  /// constructor computes it and ground() returns it. has_bytes: as GivenBytes::has(); with it a
  /// frame finds out faster that bytes are still missing. Needs neither threads nor PROJ. Throws:
  /// as above, and stream::MissingBytes.
  StoreView(const stream::Store& store, const stream::LinearMap& ground,
            const tri::ViewOptions& options,
            std::function<bool(const stream::ByteRange&)> has_bytes = {});
  ~StoreView();
  StoreView(const StoreView&) = delete;
  StoreView& operator=(const StoreView&) = delete;

  /// Brings the model closer to what `view` asks for. Takes at most about `seconds`, less `after`
  /// for each point that was added and removed (tri::StepBudget). The step lists the triangles
  /// added and removed. Throws: stream::Error once a cluster could not be read; stream::Stopped if
  /// the store was asked to stop.
  const Step& frame(const tri::View& view, double seconds, const std::array<double, 2>& after = {});
  /// Recomputes the surface of a scan from scratch, for a camera at rest. Frames only update it.
  /// See tri::ViewControl::restore(). The delta is valid until the next frame.
  const typename Control::Delta& restore(unsigned threads = 1);
  /// Whether another frame with the same view would change nothing, now or later.
  [[nodiscard]] bool settled() const;
  /// The byte ranges that the last frame lacked, the most important first. The next frame continues
  /// with those that have arrived. Always empty with a reading thread. O(1).
  [[nodiscard]] std::span<const stream::ByteRange> missing() const;

  /// As in tri::ViewControl.
  void pin(tri::ClusterId cluster, tri::ViewPin kind);
  void unpin(tri::ClusterId cluster);

  [[nodiscard]] const Control& control() const;
  [[nodiscard]] const typename Control::Model& model() const { return control().model(); }

  /// Number of points that are shown.
  [[nodiscard]] std::size_t points() const;

  /// Maps a difference in stored coordinates to metres.
  [[nodiscard]] const stream::LinearMap& ground() const;
  /// Returns a vertex in stored coordinates; for a surface, up to the lattice's rounding.
  [[nodiscard]] stream::Point3 stored(tri::VertexId vertex) const;
  /// Returns a point in stored coordinates as metres east, north and up.
  [[nodiscard]] stream::Point3 in_view_frame(const stream::Point3& stored) const;
  [[nodiscard]] stream::Point3 in_view_frame(tri::VertexId vertex) const;
  /// Returns a position in the model's coordinates, which geomorphs use (tri::Geomorph), as metres
  /// east, north and up.
  [[nodiscard]] stream::Point3 model_in_view_frame(const stream::Point3& place) const;

  /// Whether a triangle of a raster spans samples without data; false for other stores. Such a
  /// triangle's corners are not neighbours in columns and rows, and its centroid is farther than a
  /// cell from the boxes of all collapsed clusters. Never true if every sample has data. Does not
  /// find gaps narrower than the clusters next to them. Takes 0.03 to 0.6 us.
  [[nodiscard]] bool spans_gap(tri::TriangleId triangle) const;
  /// Whether spans_gap() can be true for any triangle.
  [[nodiscard]] bool has_gaps() const;

  /// The attributes of a vertex's point, as a record of the store's schema; empty if its cluster is
  /// no longer in the cache. Attributes of points that a frame added are available until the next
  /// frame, those of the root always.
  [[nodiscard]] std::span<const std::byte> attributes(tri::VertexId vertex) const;

  /// The traffic until now, the root included.
  [[nodiscard]] ViewTraffic traffic() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

extern template class StoreView<tri::ThinnedDelaunay2>;
extern template class StoreView<std::int32_t>;
extern template class StoreView<double>;
extern template class StoreView<tri::RegionalDelaunay2<std::int32_t>>;
extern template class StoreView<tri::RegionalDelaunay2<double>>;
extern template class StoreView<tri::PointCloud>;
extern template class StoreView<tri::DynamicSurface<std::int32_t>>;

}  // namespace terrace::terrain
