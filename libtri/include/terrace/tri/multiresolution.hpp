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

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/delaunay3.hpp"
#include "terrace/tri/dynamic_surface.hpp"
#include "terrace/tri/point_cloud.hpp"

/// A triangulation of a hierarchy of clusters whose detail is raised and lowered, and the interface
/// through which it reads that hierarchy, wherever it is stored.
///
/// Level 0 is full resolution; levels grow coarser upward to the top. A cluster of level L is
/// headed by one point whose highest level is above L; its members are points whose highest level
/// is exactly L. A point of highest level h heads one cluster on every level below h. The points of
/// the top level are the members of the root, which has no head.

namespace terrace::tri {

/// Identifies a cluster for the lifetime of its source: level in the upper 8 bits, ordinal in the
/// lower 56.
enum class ClusterId : std::uint64_t {};

constexpr ClusterId cluster_id(unsigned level, std::uint64_t ordinal) {
  return ClusterId{(std::uint64_t{level} << 56) | ordinal};
}
constexpr unsigned level_of(ClusterId id) {
  return static_cast<unsigned>(static_cast<std::uint64_t>(id) >> 56);
}
constexpr std::uint64_t ordinal_of(ClusterId id) {
  return static_cast<std::uint64_t>(id) & ((std::uint64_t{1} << 56) - 1);
}
/// For messages: "cluster 12 of level 3".
std::string to_string(ClusterId id);

/// Identifies a point for the lifetime of its source: member `index` of `cluster`. Its highest
/// level is level_of(cluster).
struct PointId {
  ClusterId cluster{};
  std::uint32_t index = 0;
  friend auto operator<=>(const PointId&, const PointId&) = default;
};

/// Whether `a` represents a vertex that both points share: the higher level wins, then the smaller
/// id.
constexpr bool stands_before(const PointId& a, const PointId& b) {
  const unsigned la = level_of(a.cluster), lb = level_of(b.cluster);
  return la != lb ? la > lb : a < b;
}

/// What is known about a cluster before its members are read.
struct ClusterRecord {
  Box3 box;  ///< of all descendants down to level 0, including the head
  /// ground metres; upper bound of the distance of any descendant from the head
  double error = 0.0;
  std::uint64_t members = 0;  ///< the number that read() will deliver

  /// In place of the number: box and error are bounds, and the record itself has not been read.
  static constexpr std::uint64_t kUnread = ~std::uint64_t{0};
};

/// The members of a cluster, in the order that defines their ids. They are inserted in this order:
/// one in which neighbours follow each other (row by row for rasters, a k-d tree's for clouds) is
/// 1.2 to 1.6 times as fast as a random order, and about as fast as a Hilbert curve. A member of
/// level L has L `children`: the ordinals of the clusters that it heads on levels 0, 1, ... L - 1;
/// those of member i start at children[i * L]. The spans are valid until the next call of read().
struct ClusterMembers {
  std::span<const Point3> positions;
  std::span<const std::uint64_t> children;
  /// What else belongs to the members, the same number of bytes for each: the model does not look
  /// at it, a view keeps it with the cluster.
  std::span<const std::byte> values{};
};

/// Delivers clusters. Calls come from the thread that uses the model, one at a time. Exceptions
/// pass through the model, which is then unchanged.
class ClusterSource {
 public:
  virtual ~ClusterSource() = default;

  /// The level of the root, cluster_id(top(), 0); 0 if all points are on one level.
  [[nodiscard]] virtual unsigned top() const = 0;
  /// Number of clusters of a level below the top; their ordinals are 0 .. cluster_count - 1.
  [[nodiscard]] virtual std::uint64_t cluster_count(unsigned level) const = 0;
  /// Never called for the root.
  virtual ClusterRecord record(ClusterId id) = 0;
  virtual ClusterMembers read(ClusterId id) = 0;
  /// The ids for which read() will be called next, in that order: a chance to fetch them at once.
  virtual void announce(std::span<const ClusterId> ids);
};

/// The source contradicts itself (or delivers what the triangulation cannot hold). The message
/// names the cluster and the member.
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
};

/// How much detail is wanted where: all points of `level` and above, and in each focus those of its
/// level and above (all points inside the box, and those that share a cluster with one inside).
struct Detail {
  static constexpr unsigned kTop = 255;  ///< any level at or above the top means the top
  unsigned level = kTop;
  std::vector<Focus> focuses;
  /// Narrows focuses that are not boxes: whether the focus with this index needs the contents of
  /// the box, which meets the focus's own. If true for a box it must be true for every box that
  /// contains it. Empty: a focus needs everything that meets its box.
  std::function<bool(std::size_t focus, const Box3& box)> needs{};
};

struct ModelOptions {
  /// false: no deltas are recorded, steps are faster and every Delta is empty.
  bool deltas = true;
  /// true: a Delta also reports the former heights, for 8 bytes and a bit per vertex.
  bool old_heights = false;
  /// Memory is reserved for this many vertices, so that no step has to move what is there.
  std::size_t reserve = 0;
};

/// A triangulation of a hierarchy of clusters that is coarse in some places and fine in others. The
/// points of the top level are always in it; expanding a cluster adds its members, collapsing it
/// removes them again. Source: J. Skala, Algorithms for manipulating large geometric data, chapter
/// 8.
///
/// Laws, for clusters a, b that can be expanded:
///   expand(a), collapse(a)  restores exactly the same triangulation;
///   the triangulation is a function of the set of expanded clusters, however it was reached.
/// Collapsing a cluster first collapses the expanded clusters below it.
///
/// Points of equal coordinates share one vertex, which lives as long as one of them is present. Of
/// those present, the point of the highest level, then of the smallest id, represents the vertex:
/// it determines its point id, level and height.
///
/// Every change is a step: the clusters it needs are all read before the triangulation is touched.
/// If the source throws, or contradicts itself (HierarchyError), the model is unchanged. After
/// std::bad_alloc during a step the model can only be destroyed.
///
/// Memory, beside the triangulation: 16 bytes per vertex and 4 per member, 48 per expanded cluster;
/// more for points above level 0. With clusters of 140 members about 21 bytes per
/// vertex.
///
/// Triangulation: Delaunay2 or Delaunay3, in any metric; RegionalDelaunay2, with a metric per
/// region; DynamicSurface, or PointCloud.
template <class Triangulation>
class MultiresolutionModel {
 public:
  using Point = typename Triangulation::Point;

  /// The changes of a step. Apply removals first: a reused handle is on both sides.
  struct Delta {
    /// Vertices and triangles, see Delaunay2::Changes.
    typename Triangulation::Changes changes;
    /// Vertices that stayed but are now represented by another point: update their heights.
    std::vector<VertexId> reassigned;
    /// With ModelOptions::old_heights, otherwise empty: the heights before the step of
    /// changes.removed_vertices and of reassigned, in parallel.
    std::vector<double> removed_heights, reassigned_heights;
  };

  /// Starts with the points of the given detail, built in one go. The first delta covers the
  /// changes after that: begin by reading the whole triangulation. The source must outlive the
  /// model.
  /// `empty`: the triangulation to fill, which supplies the metric or the field of metrics.
  /// Throws: what the source throws, HierarchyError, std::length_error.
  explicit MultiresolutionModel(ClusterSource& source, const Detail& start = {},
                                ModelOptions options = {}, Triangulation empty = Triangulation());
  ~MultiresolutionModel();
  /// A moved-from model can only be destroyed or assigned to.
  MultiresolutionModel(MultiresolutionModel&&) noexcept;
  MultiresolutionModel& operator=(MultiresolutionModel&&) noexcept;

  // ---- Steps ----------------------------------------------------------------------------------
  // All return the delta, which is valid until the next step, and throw what the source throws,
  // HierarchyError, and std::length_error if there would be more vertices than handles.

  /// Requires that the cluster is expanded or can be (can_expand()), otherwise
  /// std::invalid_argument. Expanding an expanded cluster changes nothing; nor does collapsing a
  /// collapsed one.
  const Delta& expand(ClusterId cluster);
  const Delta& collapse(ClusterId cluster);

  /// Expands the clusters of `level` and above that intersect the region: afterwards all points
  /// inside it that have this level or a higher one are present.
  const Delta& refine(const Box3& region, unsigned level);
  /// Collapses the clusters below `level` that lie wholly inside the region: nothing outside is
  /// lost.
  const Delta& coarsen(const Box3& region, unsigned level);
  /// Both in one step.
  const Delta& set_region(const Box3& region, unsigned level);
  /// Applies to everything: expands and collapses until exactly the wanted clusters are expanded.
  const Delta& set_detail(const Detail& detail);
  const Delta& set_level(unsigned level) { return set_detail({level, {}}); }

  /// Combines several steps into one: until close_step() the functions above change the
  /// triangulation at once, but their return values have no meaning; close_step() returns the
  /// combined delta. `reassigned` may include an unchanged vertex whose point went and came back in
  /// between.
  void open_step();
  const Delta& close_step();
  /// Not within a step: computes from scratch what steps only follow, the surface of a
  /// DynamicSurface. Of other triangulations an empty delta: they are always exact. Throws nothing
  /// of the source's.
  const Delta& restore(unsigned threads = 1);

  // ---- Reading --------------------------------------------------------------------------------

  [[nodiscard]] const Triangulation& triangulation() const;
  [[nodiscard]] unsigned top() const;
  /// Points present; more than vertices if some have equal coordinates.
  [[nodiscard]] std::size_t point_count() const;

  /// Properties of the point that represents a living vertex. O(1).
  [[nodiscard]] PointId point_id(VertexId vertex) const;
  [[nodiscard]] unsigned level(VertexId vertex) const;
  [[nodiscard]] double height(VertexId vertex) const;
  /// The clusters that the points on a vertex head, those of the representing point first, the
  /// coarsest first. Replaces `clusters`.
  void heads(VertexId vertex, std::vector<ClusterId>& clusters) const;

  [[nodiscard]] std::size_t expanded_count() const;
  /// The expanded clusters in ascending order, without the root.
  [[nodiscard]] std::vector<ClusterId> expanded() const;
  [[nodiscard]] bool is_expanded(ClusterId cluster) const;
  /// Whether the cluster is a child of an expanded cluster and not itself expanded.
  [[nodiscard]] bool can_expand(ClusterId cluster) const;
  /// The clusters directly below an expanded one (or the root). Replaces `clusters`. Throws:
  /// std::invalid_argument if the cluster is not expanded.
  void children(ClusterId cluster, std::vector<ClusterId>& clusters) const;
  /// The vertex of the point that heads a cluster that is expanded or can be.
  [[nodiscard]] VertexId head_vertex(ClusterId cluster) const;
  /// The record of such a cluster; queries the source once.
  [[nodiscard]] const ClusterRecord& record(ClusterId cluster);

  /// Bytes held besides the triangulation.
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
/// The model of points in space: tetrahedra instead of triangles; a height is the z of a vertex. Of
/// points scanned from a surface, MultiresolutionModel<DynamicSurface<Coord>> keeps that, too.
template <class Coord, class Metric = Euclidean>
using Multiresolution3 = MultiresolutionModel<Delaunay3<Coord, Metric>>;

extern template class MultiresolutionModel<Delaunay2<std::int32_t>>;
extern template class MultiresolutionModel<PointCloud>;
extern template class MultiresolutionModel<Delaunay2<double>>;
extern template class MultiresolutionModel<Delaunay3<std::int32_t>>;
extern template class MultiresolutionModel<Delaunay3<double>>;
extern template class MultiresolutionModel<DynamicSurface<std::int32_t>>;
extern template class MultiresolutionModel<DynamicSurface<double>>;

}  // namespace terrace::tri
