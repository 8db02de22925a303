// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/interpolation.hpp>

#include "surface/box_tree.hpp"
#include "surface/circle_cover.hpp"
#include "surface/cluster_frontier.hpp"
#include "surface/corner.hpp"
#include "surface/point_cloud.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Whether a triangle, with counter-clockwise corners, meets a box; exact.
bool triangle_meets(const std::array<Point2, 3>& corner, const StoredBox& box);

/// Computes the Delaunay triangulation in x and y of all points of a cloud, window by window, with
/// exactly the triangles of the whole triangulation. tri::Delaunay2 breaks ties by the points
/// alone, so a triangle belongs to the whole if and only if it belongs to the triangulation of any
/// subset that contains all points in its closed circumcircle.
///
/// For work on all triangles of a box. PointSurface finds the triangles at single places.
///
/// Coordinates are stored coordinates: x and y, or column and row of a raster's coarser levels.
///
/// Points at equal x and y are one vertex. The first of them in the order of StoreWindow::points()
/// (higher levels first, within a level by id) determines its height in every window.
///
/// One object per thread; any number of them share a PointCloud.
class PointWindow {
 public:
  /// Thrown by load() if memory_bytes do not suffice; says how much memory is needed.
  class NoRoom : public stream::Error {
    using Error::Error;
  };
  /// Peak memory in bytes per point, for a window that is large compared with its border.
  static constexpr std::uint64_t kBytesPerPoint = 120;

  /// memory_bytes: limit for one window; 0: no limit. The cloud must outlive this object.
  explicit PointWindow(PointCloud& cloud, std::uint64_t memory_bytes = 0);
  PointWindow(const PointWindow&) = delete;
  PointWindow& operator=(const PointWindow&) = delete;

  /// Loads a closed box. Afterwards every triangle of the whole triangulation that meets the box is
  /// in triangulation() and certain. There are others around it, certain or not.
  ///
  /// Reads the clusters that meet the box and triangulates their points in the box in bulk, then
  /// those in a border as wide as most circumcircles extend, and the corners of the hull. Then it
  /// adds points as long as one may be missing in the circumcircle of a triangle that meets the
  /// box. It takes a point that was read, otherwise it reads the clusters whose boxes meet the
  /// circle, coarse levels first, and more at a time the longer nothing is found. So no width is
  /// guessed, and voids only cost a few additional clusters of coarse levels. Where they cost too
  /// much, as along a winding swath, their border is found once for all windows, see PointVoids.
  /// About 0.4 us per point in the box. Clusters of unordered points overlap, and all that meet the
  /// box are read, at 30 ns per point; the larger the box, the smaller their share. A box that
  /// contains the store needs no further points.
  ///
  /// Throws: NoRoom if memory_bytes do not suffice; stream::Error on a damaged store;
  /// stream::Stopped. After an exception it can only be loaded again or destroyed.
  void load(const StoredBox& box);
  /// For PointVoids: appends the points of the box with a triangle whose circumcircle is not within
  /// the returned distance, each place once. Afterwards the window can only be loaded or destroyed.
  /// Throws: as load().
  double find_border(const StoredBox& box, std::vector<SurfaceCorner>& border);
  [[nodiscard]] std::uint64_t memory_bytes() const { return memory_bytes_; }

  /// The triangulation of the last load(). Vertices have no numbers except those in it.
  [[nodiscard]] const tri::Delaunay2<double>& triangulation() const { return triangulation_; }
  /// Whether a triangle belongs to the whole triangulation. Requires a living triangle.
  [[nodiscard]] bool is_certain(tri::TriangleId triangle) const {
    return is_complete_ || states_[tri::slot(triangle)] == State::certain;
  }
  /// In the store's vertical unit (scale and offset of the channel applied).
  [[nodiscard]] double height(tri::VertexId vertex) const { return heights_[tri::slot(vertex)]; }
  /// By vertex slot, as libtri requires.
  [[nodiscard]] const std::vector<double>& heights() const { return heights_; }

  [[nodiscard]] SurfaceCorner corner(tri::VertexId vertex) const;
  /// Counter-clockwise.
  [[nodiscard]] SurfaceTriangle corners_with_heights(tri::TriangleId triangle) const;

 private:
  using Triangulation = tri::Delaunay2<double>;
  /// The origin of a vertex: the index of its cluster in read_, and its own index in the cluster.
  struct Origin {
    std::uint32_t cluster = kNowhere, index = 0;
  };
  static constexpr std::uint32_t kNowhere = 0xFFFFFFFF;
  /// The height of points whose clusters were not read.
  static constexpr double kUnknownHeight = std::numeric_limits<double>::quiet_NaN();
  /// Data of a point to be inserted.
  struct NewPoint {
    double height = 0;
    Origin origin;
  };
  /// A point that was read and is outside inner_; once taken for insertion, its cluster is
  /// kNowhere.
  struct Pending {
    Triangulation::Point place{};
    double height = 0;
    Origin origin;
  };
  /// The points of one cluster outside inner_. Those not taken are divided into groups when they
  /// are first searched.
  struct Outer {
    StoredBox box;
    std::size_t begin = 0, count = 0;  ///< range in pending_
    BoxForest::Tree groups{};
  };
  /// A triangle that needs all points in its cover.
  struct Suspect {
    CircleCover cover;
    tri::TriangleId triangle = tri::kNoTriangle;
  };
  enum class State : std::uint8_t { certain, suspect, unknown };

  void clear();
  /// Clears, then reads all clusters that meet the box; inner_ then contains all points of it.
  void begin(const StoredBox& box);
  void load_with_border();
  void take(const stream::StoreQuery::Node& node);
  void take(Pending& point);
  /// Takes a point from elsewhere, unless inner_ contains it.
  void take_distant(const SurfaceCorner& corner);
  void grow_inner(const StoredBox& box);
  void insert_new_points();
  [[nodiscard]] bool keeps_buffer() const;
  [[nodiscard]] bool precedes(const Origin& a, const Origin& b) const;
  void check_memory(std::size_t more) const;
  [[nodiscard]] double margin() const;

  void settle();
  void examine_all();
  void examine_changes();
  [[nodiscard]] std::vector<tri::TriangleId> triangles_at_hull() const;
  void examine(tri::TriangleId triangle);
  void drop_settled();
  /// Enlarges inner_ to contain most circles of suspects; returns false if there are few or it
  /// would not help.
  bool widen();
  /// Returns false if nothing is missing, or if looking for it takes too long.
  bool add_missing();
  bool read_missing();
  bool find_missing(const Suspect& suspect);
  void make_trees();
  void part(Outer& outer);
  [[nodiscard]] CircleCover circle(tri::TriangleId triangle) const {
    return CircleCover::of_triangle(corners(triangle));
  }
  [[nodiscard]] std::array<Point2, 3> corners(tri::TriangleId triangle) const;

  PointCloud& cloud_;
  std::uint64_t memory_bytes_;
  double scale_, offset_;    ///< scale and offset of heights
  std::uint64_t looks_ = 0;  ///< not yet counted in the voids
  bool takes_too_long_ = false;
  ClusterFrontier frontier_;
  StoredBox box_{}, inner_{};  ///< loaded; box with all points inserted
  bool is_complete_ = false;   ///< whether all points of the store are inserted
  Triangulation triangulation_;
  std::vector<double> heights_;               ///< by vertex slot
  std::vector<Origin> origins_;               ///< by vertex slot
  std::vector<State> states_;                 ///< by triangle slot
  std::vector<stream::ClusterId> read_;       ///< in reading order
  std::vector<Triangulation::Point> places_;  ///< to be inserted
  std::vector<NewPoint> new_points_;          ///< one for each of places_
  std::vector<Pending> pending_;
  std::size_t pending_count_ = 0;  ///< number of pending_ that are not taken
  std::vector<Outer> outer_;
  BoxForest groups_;  ///< groups of pending_
  std::vector<Triangulation::Insertion> inserted_;
  std::vector<Suspect> suspects_;
  std::vector<std::uint32_t> chosen_;
  BoxTree outer_tree_, open_tree_;  ///< outer_ outside inner_; frontier_.open()
  std::size_t read_in_trees_ = 0;   ///< size of read_ when the trees were made
  std::vector<std::pair<double, std::uint32_t>> by_depth_;  ///< indices in frontier_.open()
  std::size_t clusters_at_once_ = 1;  ///< number of clusters read at once for a suspect
  std::vector<double> reaches_;
  Triangulation::Changes changes_;
};

}  // namespace terrace::terrain
