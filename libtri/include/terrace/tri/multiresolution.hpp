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
#include "terrace/tri/point_cloud.hpp"

/// A triangulation of a hierarchy of clusters whose detail is raised and lowered, and the interface
/// by which it reads that hierarchy, wherever it is stored.
///
/// Level 0 is full resolution; levels grow coarser upward to the top. A cluster of level L is
/// headed by one point whose highest level is above L and has as members points whose highest level
/// is exactly L. A point of highest level h heads one cluster on every level below h. The points of
/// the top level are the members of the root, which no point heads.

namespace terrace::tri {

/// Names a cluster for the life of its source: level in the upper 8 bits, ordinal in the lower 56.
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

/// Names a point for the life of its source: member `index` of `cluster`. Its highest level is
/// level_of(cluster).
struct PointId {
  ClusterId cluster{};
  std::uint32_t index = 0;
  friend auto operator<=>(const PointId&, const PointId&) = default;
};

/// Whether `a` stands for a vertex that both lie on: the higher level, then the smaller id.
constexpr bool stands_before(const PointId& a, const PointId& b) {
  const unsigned la = level_of(a.cluster), lb = level_of(b.cluster);
  return la != lb ? la > lb : a < b;
}

/// What is known of a cluster before its members are read.
struct ClusterRecord {
  Box3 box;                   ///< of all descendants down to level 0, the head included
  double error = 0.0;         ///< ground metres; no descendant is farther from the head
  std::uint64_t members = 0;  ///< that read() will deliver
};

/// The members of a cluster, in the order that gives their ids. They are inserted in this order:
/// one in which neighbours follow each other (row by row for rasters, a k-d tree's for clouds)
/// is 1.2 to 1.6 times as fast as a random one, and about as fast as a Hilbert curve. A member of
/// level L has L `children`: the ordinals of the clusters that it heads on levels 0, 1, ... L - 1;
/// those of member i start at children[i * L]. The spans are valid until the next call of read().
struct ClusterMembers {
  std::span<const Point3> positions;
  std::span<const std::uint64_t> children;
};

/// Delivers clusters. Calls come from the thread that uses the model, one at a time. What it throws
/// passes through the model, which is then unchanged.
class ClusterSource {
 public:
  virtual ~ClusterSource() = default;

  /// The level of the root, cluster_id(top(), 0); 0 if the points are one level.
  [[nodiscard]] virtual unsigned top() const = 0;
  /// Number of clusters of a level below the top. Their ordinals are smaller.
  [[nodiscard]] virtual std::uint64_t cluster_count(unsigned level) const = 0;
  /// Never asked of the root.
  virtual ClusterRecord record(ClusterId id) = 0;
  virtual ClusterMembers read(ClusterId id) = 0;
  /// The ids that read() will be asked for next, in that order: a chance to fetch them at once.
  virtual void announce(std::span<const ClusterId> ids);
};

/// The source contradicts itself (or the triangulation cannot hold what it delivers). The message
/// names the cluster and the member.
class HierarchyError : public std::runtime_error {
 public:
  HierarchyError(ClusterId cluster, const std::string& what)
      : std::runtime_error(to_string(cluster) + ": " + what), cluster_(cluster) {}
  [[nodiscard]] ClusterId cluster() const { return cluster_; }

 private:
  ClusterId cluster_;
};

/// A part of space that is wanted in finer detail.
struct Focus {
  Box3 box;
  unsigned level = 0;
};

/// How much detail is wanted where: all points of `level` and above, and in each focus those of its
/// level and above (all of them inside the box, and what shares a cluster with one inside).
struct Detail {
  static constexpr unsigned kTop = 255;  ///< any level that is not below the top means the top
  unsigned level = kTop;
  std::vector<Focus> focuses;
  /// Narrows focuses that are not boxes: whether the focus of that number needs what lies in the
  /// box, which meets the focus's own. Must also be true of every box that contains one of which it
  /// is true. Without it a focus needs all that meets its box.
  std::function<bool(std::size_t focus, const Box3& box)> needs{};
};

struct ModelOptions {
  /// false: no deltas are recorded, steps are faster and every Delta is empty.
  bool deltas = true;
  /// true: a Delta also tells the heights that were there before, for 8 bytes and a bit per vertex.
  bool old_heights = false;
};

/// A triangulation of a hierarchy of clusters that is coarse here and fine there. The points of the
/// top level are always in it; expanding a cluster adds its members, collapsing it takes them out
/// again. Source: J. Skala, Algorithms for manipulating large geometric data, chapter 8.
///
/// Laws, for clusters a, b that can be expanded:
///   expand(a), collapse(a)  gives back the very triangulation;
///   the triangulation is a function of the set of expanded clusters, however it came about.
/// Collapsing a cluster first collapses what is expanded below it.
///
/// Points of equal coordinates are one vertex, which lives as long as one of them. Of those that
/// are present the one of the highest level, then the smallest id, stands for it: gives its point
/// id, level and height.
///
/// Every change is a step: the clusters it needs are all read before the triangulation is touched.
/// If the source throws, or contradicts itself (HierarchyError), the model is unchanged.
/// std::bad_alloc during a step leaves a model that can only be destroyed.
///
/// Memory, beside the triangulation: 16 bytes per vertex and 4 per member, 48 per expanded cluster;
/// more for points above level 0. With clusters of 140 members about 21 bytes per
/// vertex.
///
/// Triangulation: Delaunay2 or Delaunay3, in any metric, or PointCloud.
template <class Triangulation>
class MultiresolutionModel {
 public:
  using Point = typename Triangulation::Point;

  /// What a step has changed. Apply removals first: a handle that was used again is on both sides.
  struct Delta {
    /// Vertices and triangles, see Delaunay2::Changes.
    typename Triangulation::Changes changes;
    /// Vertices that stayed, for which another point stands now: look at their height again.
    std::vector<VertexId> reassigned;
    /// With ModelOptions::old_heights, else empty: the heights before the step of
    /// changes.removed_vertices and of reassigned, in parallel.
    std::vector<double> removed_heights, reassigned_heights;
  };

  /// Starts with the points of the given detail, built in one go. The first delta covers what comes
  /// after: begin with a look at the triangulation. The source must outlive the model.
  /// `empty`: the triangulation to fill, which brings the metric.
  /// Throws: what the source throws, HierarchyError, std::length_error.
  explicit MultiresolutionModel(ClusterSource& source, const Detail& start = {},
                                ModelOptions options = {}, Triangulation empty = Triangulation());
  ~MultiresolutionModel();
  /// A moved-from model can only be destroyed or assigned to.
  MultiresolutionModel(MultiresolutionModel&&) noexcept;
  MultiresolutionModel& operator=(MultiresolutionModel&&) noexcept;

  // ---- Steps ----------------------------------------------------------------------------------
  // All return the delta, which lives until the next step, and throw what the source throws,
  // HierarchyError, and std::length_error when there would be more vertices than handles.

  /// Requires that the cluster is expanded or can be (can_expand()), else std::invalid_argument.
  /// Expanding an expanded cluster changes nothing; so does collapsing a collapsed one.
  const Delta& expand(ClusterId cluster);
  const Delta& collapse(ClusterId cluster);

  /// Expands the clusters of `level` and above that intersect the region: all points inside that
  /// have that level or a higher one are then present.
  const Delta& refine(const Box3& region, unsigned level);
  /// Collapses the clusters below `level` that lie wholly inside the region: nothing outside is
  /// lost.
  const Delta& coarsen(const Box3& region, unsigned level);
  /// Both in one step.
  const Delta& set_region(const Box3& region, unsigned level);
  /// Everything: expands and collapses until exactly the clusters wanted are expanded.
  const Delta& set_detail(const Detail& detail);
  const Delta& set_level(unsigned level) { return set_detail({level, {}}); }

  /// Makes one step of several: until close_step() the functions above change the triangulation at
  /// once, but what they return means nothing; close_step() returns the delta of them all. Of a
  /// vertex whose point went and came back in between, `reassigned` may tell though it is the same.
  void open_step();
  const Delta& close_step();

  // ---- Reading --------------------------------------------------------------------------------

  [[nodiscard]] const Triangulation& triangulation() const;
  [[nodiscard]] unsigned top() const;
  /// Points present; more than vertices where some have equal coordinates.
  [[nodiscard]] std::size_t point_count() const;

  /// These tell about the point that stands for a living vertex. O(1).
  [[nodiscard]] PointId point_id(VertexId vertex) const;
  [[nodiscard]] unsigned level(VertexId vertex) const;
  [[nodiscard]] double height(VertexId vertex) const;
  /// The clusters that the points on a vertex head, those of the standing point first, the coarsest
  /// first. Replaces `clusters`.
  void heads(VertexId vertex, std::vector<ClusterId>& clusters) const;

  [[nodiscard]] std::size_t expanded_count() const;
  /// The expanded clusters in ascending order, the root not among them.
  [[nodiscard]] std::vector<ClusterId> expanded() const;
  [[nodiscard]] bool is_expanded(ClusterId cluster) const;
  /// Whether it is a child of an expanded cluster and not expanded.
  [[nodiscard]] bool can_expand(ClusterId cluster) const;
  /// The clusters below an expanded one (or the root), one level down. Replaces `clusters`.
  /// Throws: std::invalid_argument if it is not expanded.
  void children(ClusterId cluster, std::vector<ClusterId>& clusters) const;
  /// The vertex of the point that heads a cluster that is expanded or can be.
  [[nodiscard]] VertexId head_vertex(ClusterId cluster) const;
  /// The record of such a cluster; asks the source once.
  [[nodiscard]] const ClusterRecord& record(ClusterId cluster);

  /// Bytes held beside the triangulation.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  template <class>
  friend class ViewControl;  // it decides by the tree

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The model of points in the plane: std::int32_t for rasters in column and row, else double.
template <class Coord, class Metric = Euclidean>
using Multiresolution2 = MultiresolutionModel<Delaunay2<Coord, Metric>>;
/// The model of points in space: tetrahedra in place of triangles; a height is the z of a vertex.
template <class Coord, class Metric = Euclidean>
using Multiresolution3 = MultiresolutionModel<Delaunay3<Coord, Metric>>;

extern template class MultiresolutionModel<Delaunay2<std::int32_t>>;
extern template class MultiresolutionModel<PointCloud>;
extern template class MultiresolutionModel<Delaunay2<double>>;
extern template class MultiresolutionModel<Delaunay3<std::int32_t>>;
extern template class MultiresolutionModel<Delaunay3<double>>;

}  // namespace terrace::tri
