// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <terrace/base/cluster.hpp>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/delaunay3.hpp"
#include "terrace/tri/dynamic_surface.hpp"
#include "terrace/tri/point_cloud.hpp"
#include "terrace/tri/thinned_delaunay2.hpp"

/// A triangulation whose detail is raised and lowered by expanding and collapsing the clusters of a
/// hierarchy, and the interface through which it reads that hierarchy from any storage.
///
/// Level 0 is full resolution. Levels grow coarser upward to the top. A cluster of level L is
/// headed by one point whose highest level is above L. Its members are points whose highest level
/// is exactly L. A point of highest level h heads one cluster on every level below h. The points of
/// the top level are the members of the root, which has no head.

namespace terrace::tri {

using base::cluster_id;
using base::ClusterId;
using base::level_of;
using base::ordinal_of;
using base::to_string;

/// Identifies a point for the lifetime of its source: member `index` of `cluster`. Its highest
/// level is level_of(cluster).
struct PointId {
  ClusterId cluster{};
  std::uint32_t index = 0;
  friend auto operator<=>(const PointId&, const PointId&) = default;
};

/// Returns true if `a` rather than `b` represents a vertex that both points share: the point of the
/// higher level does, then the one with the smaller id.
constexpr bool takes_precedence(const PointId& a, const PointId& b) {
  const unsigned la = level_of(a.cluster), lb = level_of(b.cluster);
  return la != lb ? la > lb : a < b;
}

/// Facts about a cluster that are known before its members are read.
struct ClusterRecord {
  Box3 box;  ///< of all descendants down to level 0, including the head
  /// upper bound of the distance of any descendant from the head, in ground metres
  double error = 0.0;
  std::uint64_t members = 0;  ///< number of members that read() will deliver

  /// Replaces the number of members if box and error are only bounds because the record itself has
  /// not been read.
  static constexpr std::uint64_t kUnread = ~std::uint64_t{0};
};

/// The members of a cluster, in the order that defines their ids. They are inserted in this order.
/// An order in which neighbours follow each other (row by row for rasters, a k-d tree's for clouds)
/// is 1.2 to 1.6 times as fast as a random one, and about as fast as a Hilbert curve. A member of
/// level L has L `children`: the ordinals of the clusters that it heads on levels 0, 1, ... L - 1.
/// Those of member i start at children[i * L]. The spans are valid until the next call of read().
struct ClusterMembers {
  std::span<const Point3> positions;
  std::span<const std::uint64_t> children;
  /// Other data of the members, the same number of bytes for each. The model ignores it. A view
  /// keeps it with the cluster.
  std::span<const std::byte> values{};
};

/// Delivers clusters. The model calls it from its own thread, one call at a time. Exceptions pass
/// through the model, which is then unchanged.
class ClusterSource {
 public:
  virtual ~ClusterSource() = default;

  /// The level of the root, cluster_id(top(), 0), or 0 if all points are on one level.
  [[nodiscard]] virtual unsigned top() const = 0;
  /// Number of clusters of a level below the top. Their ordinals are 0 .. cluster_count - 1.
  [[nodiscard]] virtual std::uint64_t cluster_count(unsigned level) const = 0;
  /// Never called for the root.
  virtual ClusterRecord record(ClusterId id) = 0;
  virtual ClusterMembers read(ClusterId id) = 0;
  /// Announces the ids with which read() will be called next, in that order, so that they can be
  /// fetched together.
  virtual void announce(std::span<const ClusterId> ids);
};

/// Thrown if the source contradicts itself (or delivers something that the triangulation cannot
/// hold). The message names the cluster and the member.
class HierarchyError : public std::runtime_error {
 public:
  HierarchyError(ClusterId cluster, const std::string& what)
      : std::runtime_error(to_string(cluster) + ": " + what), cluster_(cluster) {}
  [[nodiscard]] ClusterId cluster() const { return cluster_; }

 private:
  ClusterId cluster_;
};

/// A part of space where finer detail is wanted.
struct Focus {
  Box3 box;
  unsigned level = 0;
  bool operator==(const Focus&) const = default;
};

/// The detail wanted in each place: all points of `level` and above, and in each focus those of its
/// level and above (all points inside the box, and those that share a cluster with one inside).
struct Detail {
  static constexpr unsigned kTop = 255;  ///< any level at or above the top means the top
  unsigned level = kTop;
  std::vector<Focus> focuses;
  /// Narrows focuses that are not boxes. Returns true if the focus with this index needs the
  /// contents of the box, which meets the focus's own box. If it is true for a box it must be true
  /// for every box that contains it. Empty: a focus needs everything that meets its box.
  std::function<bool(std::size_t focus, const Box3& box)> needs{};
};

struct ModelOptions {
  /// false: steps are faster, and every Delta is empty.
  bool deltas = true;
  /// true: a Delta also reports the former heights, which takes 8 bytes and a bit per vertex.
  bool old_heights = false;
  /// Reserves memory for this many vertices, so that no step has to move existing data.
  std::size_t reserve = 0;
};

/// A triangulation of a hierarchy of clusters that is coarse in some places and fine in others. The
/// points of the top level are always present. Expanding a cluster adds its members, collapsing it
/// removes them again. Source: J. Skala, Algorithms for manipulating large geometric data, chapter
/// 8.
///
/// Laws, for clusters a, b that can be expanded:
///   expand(a), collapse(a)  restores exactly the same triangulation;
///   the triangulation is a function of the set of expanded clusters, however it was reached.
/// Collapsing a cluster first collapses the expanded clusters below it.
///
/// Points of equal coordinates share one vertex, which exists as long as one of them is present. Of
/// those present, the point of the highest level, then of the smallest id, represents the vertex:
/// it determines the vertex's point id, level and height.
///
/// Every change is a step. A step reads all clusters that it needs before it touches the
/// triangulation. If the source throws or contradicts itself (HierarchyError), the model is
/// unchanged. After std::bad_alloc during a step the model can only be destroyed.
///
/// Memory, besides the triangulation: 16 bytes per vertex, 4 per member and 48 per expanded
/// cluster, and more for points above level 0. With clusters of 140 members this is about 21 bytes
/// per vertex.
///
/// Triangulation: Delaunay2 or Delaunay3 in any metric, RegionalDelaunay2 with a metric per region,
/// DynamicSurface, or PointCloud.
template <class Triangulation>
class MultiresolutionModel {
 public:
  using Point = typename Triangulation::Point;

  /// The changes of a step. Apply removals first, as a reused handle is on both sides.
  struct Delta {
    /// Vertices and triangles, see Delaunay2::Changes.
    typename Triangulation::Changes changes;
    /// Vertices that stayed but that another point now represents: update their heights.
    std::vector<VertexId> reassigned;
    /// The heights before the step of changes.removed_vertices and of reassigned, in parallel.
    /// Empty without ModelOptions::old_heights.
    std::vector<double> removed_heights, reassigned_heights;
  };

  /// Starts with the points of the given detail, built in one go. The first delta covers only the
  /// changes after that, so begin by reading the whole triangulation. The source must outlive the
  /// model. `empty`: the triangulation to fill, which supplies the metric or the field of metrics.
  /// Throws whatever the source throws, HierarchyError and std::length_error.
  explicit MultiresolutionModel(ClusterSource& source, const Detail& start = {},
                                ModelOptions options = {}, Triangulation empty = Triangulation());
  ~MultiresolutionModel();
  /// A moved-from model can only be destroyed or assigned to.
  MultiresolutionModel(MultiresolutionModel&&) noexcept;
  MultiresolutionModel& operator=(MultiresolutionModel&&) noexcept;

  // ---- Steps ----------------------------------------------------------------------------------
  // All return the delta, which is valid until the next step. All throw whatever the source throws,
  // HierarchyError, and std::length_error if there would be more vertices than handles.

  /// Requires that the cluster is expanded or can be (can_expand()), otherwise throws
  /// std::invalid_argument. Expanding an expanded cluster changes nothing, nor does collapsing a
  /// collapsed one.
  const Delta& expand(ClusterId cluster);
  const Delta& collapse(ClusterId cluster);

  /// Expands the clusters of `level` and above that intersect the region. Afterwards all points
  /// inside it with this level or a higher one are present.
  const Delta& refine(const Box3& region, unsigned level);
  /// Collapses the clusters below `level` that are entirely inside the region. Nothing outside is
  /// lost.
  const Delta& coarsen(const Box3& region, unsigned level);
  /// Does both in one step.
  const Delta& set_region(const Box3& region, unsigned level);
  /// Applies the detail everywhere: expands and collapses until exactly the wanted clusters are
  /// expanded.
  const Delta& set_detail(const Detail& detail);
  const Delta& set_level(unsigned level) { return set_detail({level, {}}); }

  /// Combines several steps into one. Until close_step() the functions above change the
  /// triangulation at once, but their return values have no meaning. close_step() returns the
  /// combined delta. `reassigned` may include an unchanged vertex whose point was removed and added
  /// again in between.
  void open_step();
  const Delta& close_step();
  /// Computes from scratch the surface of a DynamicSurface, which steps update only locally. Must
  /// not be called within a step. Returns an empty delta for other triangulations, which are always
  /// exact. Never calls the source.
  const Delta& restore(unsigned threads = 1);

  // ---- Reading --------------------------------------------------------------------------------

  [[nodiscard]] const Triangulation& triangulation() const;
  [[nodiscard]] unsigned top() const;
  /// Number of points present. Larger than the number of vertices if some have equal coordinates.
  [[nodiscard]] std::size_t point_count() const;

  /// Properties of the point that represents an existing vertex. O(1).
  [[nodiscard]] PointId point_id(VertexId vertex) const;
  [[nodiscard]] unsigned level(VertexId vertex) const;
  [[nodiscard]] double height(VertexId vertex) const;
  /// Replaces `clusters` with those headed by the points on a vertex: those of the representing
  /// point first, the coarsest first.
  void heads(VertexId vertex, std::vector<ClusterId>& clusters) const;

  [[nodiscard]] std::size_t expanded_count() const;
  /// The expanded clusters in ascending order, without the root.
  [[nodiscard]] std::vector<ClusterId> expanded() const;
  [[nodiscard]] bool is_expanded(ClusterId cluster) const;
  /// Returns true if the cluster is a child of an expanded cluster and not itself expanded.
  [[nodiscard]] bool can_expand(ClusterId cluster) const;
  /// Replaces `clusters` with those directly below an expanded cluster (or the root). Throws
  /// std::invalid_argument if the cluster is not expanded.
  void children(ClusterId cluster, std::vector<ClusterId>& clusters) const;
  /// The vertex of the point that heads a cluster that is expanded or can be.
  [[nodiscard]] VertexId head_vertex(ClusterId cluster) const;
  /// The record of such a cluster. Asks the source once.
  [[nodiscard]] const ClusterRecord& record(ClusterId cluster);

  /// Memory in bytes besides the triangulation.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  template <class>
  friend class ViewControl;  // uses the tree for its decisions

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The model of points in the plane: std::int32_t for rasters in column and row, otherwise double.
template <class Coord, class Metric = Euclidean>
using Multiresolution2 = MultiresolutionModel<Delaunay2<Coord, Metric>>;
/// The model of points in space, with tetrahedra instead of triangles. The height of a vertex is
/// its z. For points scanned from a surface, MultiresolutionModel<DynamicSurface<Coord>> also
/// maintains the surface.
template <class Coord, class Metric = Euclidean>
using Multiresolution3 = MultiresolutionModel<Delaunay3<Coord, Metric>>;

extern template class MultiresolutionModel<Delaunay2<std::int32_t>>;
extern template class MultiresolutionModel<ThinnedDelaunay2>;
extern template class MultiresolutionModel<PointCloud>;
extern template class MultiresolutionModel<Delaunay2<double>>;
extern template class MultiresolutionModel<Delaunay3<std::int32_t>>;
extern template class MultiresolutionModel<Delaunay3<double>>;
extern template class MultiresolutionModel<DynamicSurface<std::int32_t>>;
extern template class MultiresolutionModel<DynamicSurface<double>>;

}  // namespace terrace::tri
