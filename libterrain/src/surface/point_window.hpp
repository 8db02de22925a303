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

/// Whether a triangle, its corners counter-clockwise, meets a box: exact.
bool triangle_meets(const std::array<Point2, 3>& corner, const StoredBox& box);

/// The Delaunay triangulation in x,y of all points of a level and above, part by part: exactly the
/// triangles that the whole has. tri::Delaunay2 breaks ties by the points alone, so a triangle
/// belongs to the whole if and only if it belongs to the triangulation of some of the points, among
/// them all those in its closed circumcircle.
///
/// Coordinates are stored ones: x and y, or column and row of a raster's coarser levels.
///
/// Points at equal x,y are one vertex. The first of them in the order of StoreWindow::points()
/// (higher levels first, within a level by id) gives its height, whatever the window.
///
/// One object per thread; any number of them share a Store.
class PointWindow {
 public:
  /// What load() throws where memory_bytes do not suffice. It says what would be needed.
  class NoRoom : public stream::Error {
    using Error::Error;
  };
  /// Peak bytes per point of a window that is large beside its border.
  static constexpr std::uint64_t kBytesPerPoint = 120;

  /// memory_bytes: what one window may take; 0: as much as there is. voids: shared by windows of
  /// this store and level; none: its own. The store must outlive this.
  PointWindow(const stream::Store& store, unsigned level, std::uint64_t memory_bytes,
              std::shared_ptr<PointVoids> voids = nullptr);
  PointWindow(const PointWindow&) = delete;
  PointWindow& operator=(const PointWindow&) = delete;

  /// Afterwards every triangle of the whole triangulation that meets the box, which is closed, is
  /// in triangulation() and certain. There are others around, certain or not.
  ///
  /// Reads the clusters that meet the box and triangulates their points in the box in bulk, then
  /// those in a border as wide as most circumcircles reach over it; then, while a triangle that
  /// meets the box has a circumcircle, or a hull edge that the box sees from outside has a
  /// half-plane, in which a point may be missing, adds one: of what was read, or else of the
  /// clusters whose boxes it meets, coarse levels first, and the more at once the longer nothing is
  /// found. So no width is guessed, and voids and hulls cost a few clusters of coarse levels more.
  /// Where they cost too much, as along a swath that winds, their border is found once for all
  /// windows, see PointVoids. About 0.4 us per point in the box. Clusters of unordered points
  /// overlap, and all that meet the box are read, 30 ns per point: the larger the box, the less
  /// they count. A box that holds the store has nothing to settle.
  ///
  /// Throws: NoRoom where memory_bytes do not suffice; stream::Error on a damaged store;
  /// stream::Stopped. After that it can only be loaded again or destroyed.
  void load(const StoredBox& box);
  /// For PointVoids: appends the points of the box of which not all triangles have circumcircles
  /// that lie within the distance that it returns, each place once. Afterwards the window can only
  /// be loaded or destroyed. Throws as load() does.
  double find_border(const StoredBox& box, std::vector<SurfaceCorner>& border);
  [[nodiscard]] std::uint64_t memory_bytes() const { return memory_bytes_; }

  /// As it was loaded last. Vertices have no other order or number than this one gives them.
  [[nodiscard]] const tri::Delaunay2<double>& triangulation() const { return triangulation_; }
  /// Whether it is a triangle of the whole. Requires a living triangle.
  [[nodiscard]] bool is_certain(tri::TriangleId triangle) const {
    return is_whole_ || state(triangle) == kCertain;
  }
  /// In the store's vertical unit (scale and offset of the channel applied).
  [[nodiscard]] double height(tri::VertexId vertex) const { return heights_[tri::slot(vertex)]; }
  /// By slot of vertex, as libtri wants them.
  [[nodiscard]] const std::vector<double>& heights() const { return heights_; }

  [[nodiscard]] SurfaceCorner corner(tri::VertexId vertex) const;
  /// Counter-clockwise.
  [[nodiscard]] SurfaceTriangle corners_with_heights(tri::TriangleId triangle) const;

  void set_limit(TooLong too_long) { too_long_ = std::move(too_long); }

  /// The linear surface at a place of the box. On an edge and on a vertex the height comes from the
  /// points there alone and the gradient is the mean of the triangles that meet there. NaN outside
  /// the hull. While all points are on one line, or there is only one, the hull is the segment
  /// between the outermost; there are heights but no gradients. With a limit, triangles beyond it
  /// are left out; shorter edges and vertices that have no other have heights but no gradients.
  /// The same bits whatever the window.
  [[nodiscard]] SurfacePoint at(const Point2& place) const {
    tri::VertexId near = tri::kNoVertex;
    return at(place, near);
  }
  /// The same, faster for places that are close to the one before: `near` is a vertex close to it,
  /// or none, and becomes one close to this.
  SurfacePoint at(const Point2& place, tri::VertexId& near) const;

  /// Whether two places are so close that a walk from one to the other is as short as from a hint.
  [[nodiscard]] bool are_close(const Point2& a, const Point2& b) const {
    return std::abs(a[0] - b[0]) * hint_scale_[0] < 1.0 &&
           std::abs(a[1] - b[1]) * hint_scale_[1] < 1.0;
  }

  /// Whether a place lies inside an edge, exactly.
  [[nodiscard]] bool is_on_edge(const Point2& place) const;

 private:
  using Triangulation = tri::Delaunay2<double>;
  /// Where a vertex comes from: the sequence of its cluster in read_, and its place in that.
  struct Origin {
    std::uint32_t cluster = kNowhere, index = 0;
  };
  static constexpr std::uint32_t kNowhere = 0xFFFFFFFF;
  /// Points to begin with, if need be from around inner_.
  static constexpr std::size_t kFirstPoints = 48;
  /// What is kept of a point that is to be inserted.
  struct Taken {
    double height = 0;
    Origin origin;
  };
  /// A point that was read and lies outside inner_; taken for inserting where its cluster is no
  /// number.
  struct Pending {
    Triangulation::Point place{};
    double height = 0;
    Origin origin;
  };
  /// Some of one cluster that lie together: pending_[begin] and the next ones; or, without any of
  /// its own, those of the groups from the next one on up to `next`.
  struct Group {
    StoredBox box;
    std::size_t begin = 0, count = 0, next = 0;
  };
  /// What lies outside inner_ of one cluster. What is not taken of it is parted into groups when
  /// it is first looked into.
  struct Outer {
    StoredBox box;
    std::size_t begin = 0, count = 0;  ///< in pending_
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
  /// State of a triangle; the bits above tell which edges are certain to be on the hull.
  enum State : std::uint8_t { kCertain, kSuspect, kUnknown, kTriangleState = 3, kHullEdge = 4 };
  [[nodiscard]] std::uint8_t state(tri::TriangleId triangle) const {
    return states_[tri::slot(triangle)] & kTriangleState;
  }

  void clear();
  /// Clears and reads what meets the box, of which inner_ holds all points.
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
  /// Lets inner_ hold most circles of suspects; false: there are few, or it would not help.
  bool widen();
  /// False: nothing is missing, or looking for it is taking too long.
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
  std::uint64_t looks_ = 0;  ///< not counted in voids_ yet
  bool takes_too_long_ = false;
  ClusterFrontier frontier_;
  StoredBox box_{}, inner_{};  ///< loaded; where all points are inserted
  bool is_whole_ = false;      ///< all points of the store are inserted
  Triangulation triangulation_;
  std::vector<double> heights_;               ///< by slot of vertex
  std::vector<Origin> origins_;               ///< by slot of vertex
  std::vector<std::uint8_t> states_;          ///< by slot of triangle, see State
  std::vector<stream::ClusterId> read_;       ///< in their order
  std::vector<Triangulation::Point> places_;  ///< to be inserted
  std::vector<Taken> taken_;                  ///< of places_
  std::vector<Pending> pending_;
  std::size_t left_ = 0;  ///< of pending_, not taken
  std::vector<Outer> outer_;
  std::vector<Group> groups_;
  std::vector<Triangulation::Insertion> inserted_;
  std::vector<Suspect> suspects_;  ///< hull edges behind the first suspect_triangles_
  std::size_t suspect_triangles_ = 0;
  std::vector<tri::TriangleId> hull_;  ///< triangles that have or had a hull edge
  std::vector<std::uint32_t> chosen_;
  BoxTree outer_tree_, open_tree_;  ///< of outer_ that inner_ does not hold; of frontier_.open()
  std::size_t read_in_trees_ = 0;   ///< so many were read when the trees were made
  std::vector<std::pair<double, std::size_t>> by_distance_;  ///< of pending_, or of clusters
  std::size_t clusters_at_once_ = 1;                         ///< for a suspect
  std::vector<double> reaches_;
  Triangulation::Changes changes_;
  bool has_triangles_ = false;  ///< counting them goes round the hull
  // A vertex near each cell of a grid over the box.
  std::vector<tri::VertexId> hints_;
  std::uint32_t hint_columns_ = 1, hint_rows_ = 1;
  std::array<double, 2> hint_scale_{};
};

}  // namespace terrace::terrain
