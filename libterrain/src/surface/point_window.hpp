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
#include "surface/lattice_surface.hpp"
#include "surface/point_voids.hpp"
#include "surface/store_window.hpp"
#include "surface/surface_corner.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Whether a triangle, with counter-clockwise corners, meets a box; exact.
bool triangle_meets(const std::array<Point2, 3>& corner, const StoredBox& box);

/// Computes the Delaunay triangulation in x and y of all points of a level and above, window by
/// window, with exactly the triangles of the whole triangulation. tri::Delaunay2 breaks ties by the
/// points alone, so a triangle belongs to the whole if and only if it belongs to the triangulation
/// of any subset that contains all points in its closed circumcircle.
///
/// Coordinates are stored coordinates: x and y, or column and row of a raster's coarser levels.
///
/// Points at equal x and y are one vertex. The first of them in the order of StoreWindow::points()
/// (higher levels first, within a level by id) determines its height in every window.
///
/// One object per thread; any number of them share a Store.
class PointWindow {
 public:
  /// Thrown by load() if memory_bytes do not suffice; says how much memory is needed.
  class NoRoom : public stream::Error {
    using Error::Error;
  };
  /// Peak memory in bytes per point, for a window that is large compared with its border.
  static constexpr std::uint64_t kBytesPerPoint = 120;

  /// memory_bytes: limit for one window; 0: no limit. voids: shared by windows of this store and
  /// level; null: its own. The store must outlive this object.
  PointWindow(const stream::Store& store, unsigned level, std::uint64_t memory_bytes,
              std::shared_ptr<PointVoids> voids = nullptr);
  PointWindow(const PointWindow&) = delete;
  PointWindow& operator=(const PointWindow&) = delete;

  /// Loads a closed box. Afterwards every triangle of the whole triangulation that meets the box is
  /// in triangulation() and certain. There are others around it, certain or not.
  ///
  /// Reads the clusters that meet the box and triangulates their points in the box in bulk, then
  /// those in a border as wide as most circumcircles extend. Then it adds points as long as one may
  /// be missing: in the circumcircle of a triangle that meets the box, or in the half-plane of a
  /// hull edge that the box sees from outside. It takes a point that was read, otherwise it reads
  /// the clusters whose boxes meet the circle or half-plane, coarse levels first, and more at a
  /// time the longer nothing is found. So no width is guessed, and voids and hulls only cost a few
  /// additional clusters of coarse levels. Where they cost too much, as along a winding swath,
  /// their border is found once for all windows, see PointVoids. About 0.4 us per point in the box.
  /// Clusters of unordered points overlap, and all that meet the box are read, at 30 ns per point;
  /// the larger the box, the smaller their share. A box that contains the store needs no further
  /// points.
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
    return is_whole_ || state(triangle) == kCertain;
  }
  /// In the store's vertical unit (scale and offset of the channel applied).
  [[nodiscard]] double height(tri::VertexId vertex) const { return heights_[tri::slot(vertex)]; }
  /// By vertex slot, as libtri requires.
  [[nodiscard]] const std::vector<double>& heights() const { return heights_; }

  [[nodiscard]] SurfaceCorner corner(tri::VertexId vertex) const;
  /// Counter-clockwise.
  [[nodiscard]] SurfaceTriangle corners_with_heights(tri::TriangleId triangle) const;

  void set_limit(TooLong too_long) { too_long_ = std::move(too_long); }

  /// The linear surface at a place in the box. On an edge or a vertex, the height is computed from
  /// the points there alone, and the gradient is the mean over the triangles that meet there. NaN
  /// outside the hull. If all points are collinear, or there is only one, the hull is the segment
  /// between the outermost points; it has heights but no gradients. With a limit, triangles beyond
  /// it are left out; shorter edges and vertices that have no other triangle have heights but no
  /// gradients. The same bits in every window.
  [[nodiscard]] SurfacePoint at(const Point2& place) const {
    tri::VertexId near = tri::kNoVertex;
    return at(place, near);
  }
  /// The same, faster for places close to the previous one: `near` is a vertex close to that, or
  /// kNoVertex, and becomes one close to this place.
  SurfacePoint at(const Point2& place, tri::VertexId& near) const;

  /// Whether two places are so close that a walk between them is as short as from a hint.
  [[nodiscard]] bool are_close(const Point2& a, const Point2& b) const {
    return std::abs(a[0] - b[0]) * hint_scale_[0] < 1.0 &&
           std::abs(a[1] - b[1]) * hint_scale_[1] < 1.0;
  }

  /// Whether a place is in the interior of an edge, exactly.
  [[nodiscard]] bool is_on_edge(const Point2& place) const;

 private:
  using Triangulation = tri::Delaunay2<double>;
  /// The origin of a vertex: the index of its cluster in read_, and its own index in the cluster.
  struct Origin {
    std::uint32_t cluster = kNowhere, index = 0;
  };
  static constexpr std::uint32_t kNowhere = 0xFFFFFFFF;
  /// The minimum number of initial points, taken from around inner_ if necessary.
  static constexpr std::size_t kFirstPoints = 48;
  /// Data of a point to be inserted.
  struct Taken {
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
  /// A group of nearby points of one cluster: pending_[begin] and the following; or, if it has no
  /// points itself, the groups that follow, up to `next`.
  struct Group {
    StoredBox box;
    std::size_t begin = 0, count = 0, next = 0;
  };
  /// The points of one cluster outside inner_. Those not taken are divided into groups when they
  /// are first searched.
  struct Outer {
    StoredBox box;
    std::size_t begin = 0, count = 0;  ///< range in pending_
    std::size_t first_group = 0, end_group = 0;
    bool is_parted = false;
  };
  /// A triangle, or its hull edge, that needs all points in its cover.
  struct Suspect {
    static constexpr std::uint8_t kNone = 3;
    CircleCover cover;
    tri::TriangleId triangle = tri::kNoTriangle;
    std::uint8_t edge = kNone;
  };
  /// State of a triangle; the higher bits say which edges are certainly on the hull.
  enum State : std::uint8_t { kCertain, kSuspect, kUnknown, kTriangleState = 3, kHullEdge = 4 };
  [[nodiscard]] std::uint8_t state(tri::TriangleId triangle) const {
    return states_[tri::slot(triangle)] & kTriangleState;
  }

  void clear();
  /// Clears, then reads all clusters that meet the box; inner_ then contains all points of it.
  void begin(const StoredBox& box);
  void load_with_border();
  void take(const stream::StoreQuery::Node& node);
  void take(Pending& point);
  void grow_inner(const StoredBox& box);
  void take_nearest(std::size_t count);
  void insert_taken();
  [[nodiscard]] bool keeps_taken() const;
  [[nodiscard]] bool stands_before(const Origin& a, const Origin& b) const;
  void check_memory(std::size_t more) const;
  [[nodiscard]] double margin() const;

  void settle();
  void examine_all();
  void examine_changes();
  void find_hull();
  void examine(tri::TriangleId triangle);
  void find_suspect_hull();
  /// Enlarges inner_ to contain most circles of suspects; returns false if there are few or it
  /// would not help.
  bool widen();
  /// Returns false if nothing is missing, or if looking for it takes too long.
  bool add_missing();
  bool read_missing();
  bool find_missing(const Suspect& suspect);
  void make_trees();
  void part(Outer& outer);
  void add_groups(std::size_t begin, std::size_t count);
  [[nodiscard]] CircleCover circle(tri::TriangleId triangle) const;

  void make_hints();
  [[nodiscard]] std::size_t hint_cell(const Point2& place) const;
  [[nodiscard]] SurfacePoint at_edge(tri::TriangleId triangle, std::size_t edge,
                                     const Point2& place) const;
  [[nodiscard]] SurfacePoint at_vertex(tri::VertexId vertex, tri::TriangleId triangle) const;
  [[nodiscard]] std::array<Point2, 3> corners(tri::TriangleId triangle) const;

  const stream::Store& store_;
  std::uint64_t memory_bytes_;
  double scale_, offset_;  ///< of heights
  TooLong too_long_;
  std::shared_ptr<PointVoids> voids_;
  std::uint64_t looks_ = 0;  ///< not yet counted in voids_
  bool takes_too_long_ = false;
  ClusterFrontier frontier_;
  StoredBox box_{}, inner_{};  ///< loaded; box with all points inserted
  bool is_whole_ = false;      ///< whether all points of the store are inserted
  Triangulation triangulation_;
  std::vector<double> heights_;               ///< by vertex slot
  std::vector<Origin> origins_;               ///< by vertex slot
  std::vector<std::uint8_t> states_;          ///< by triangle slot, see State
  std::vector<stream::ClusterId> read_;       ///< in reading order
  std::vector<Triangulation::Point> places_;  ///< to be inserted
  std::vector<Taken> taken_;                  ///< for places_
  std::vector<Pending> pending_;
  std::size_t left_ = 0;  ///< of pending_, not taken
  std::vector<Outer> outer_;
  std::vector<Group> groups_;
  std::vector<Triangulation::Insertion> inserted_;
  std::vector<Suspect> suspects_;  ///< hull edges follow the first suspect_triangles_
  std::size_t suspect_triangles_ = 0;
  std::vector<tri::TriangleId> hull_;  ///< triangles that have or had a hull edge
  std::vector<std::uint32_t> chosen_;
  BoxTree outer_tree_, open_tree_;  ///< outer_ outside inner_; frontier_.open()
  std::size_t read_in_trees_ = 0;   ///< size of read_ when the trees were made
  std::vector<std::pair<double, std::size_t>> by_distance_;  ///< for pending_, or for clusters
  std::size_t clusters_at_once_ = 1;                         ///< for a suspect
  std::vector<double> reaches_;
  Triangulation::Changes changes_;
  bool has_triangles_ = false;  ///< cached, because counting goes around the hull
  // A vertex near each cell of a grid over the box.
  std::vector<tri::VertexId> hints_;
  std::uint32_t hint_columns_ = 1, hint_rows_ = 1;
  std::array<double, 2> hint_scale_{};
};

}  // namespace terrace::terrain
