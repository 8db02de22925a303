// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/delaunay3.hpp"
#include "terrace/tri/multiresolution_owners.hpp"
#include "terrace/tri/multiresolution_source.hpp"
#include "terrace/tri/multiresolution_tree.hpp"

namespace terrace::tri {

/// What the model asks of a triangulation; Delaunay2 and Delaunay3 have it. The result of any
/// sequence of calls must be a function of the point set alone: then collapse is the exact inverse
/// of expand. Point is an array of 2 or 3 coordinates, integers of at most 30 bits or doubles.
template <class T>
concept DynamicTriangulation = requires(T t, const T& c, std::span<const typename T::Point> points,
                                        std::span<typename T::Insertion> results, VertexId hint,
                                        std::span<const VertexId> vertices,
                                        typename T::Changes& changes) {
  { t.build(points) } -> std::same_as<std::vector<VertexId>>;
  t.insert(points, results, hint);
  t.remove(vertices);
  t.start_journal();
  t.take_changes(changes);
  { c.vertex_count() } -> std::convertible_to<std::size_t>;
  { results[0].vertex } -> std::convertible_to<VertexId>;
  { changes.removed_vertices } -> std::convertible_to<std::span<const VertexId>>;
  { changes.added_vertices } -> std::convertible_to<std::span<const VertexId>>;
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
/// see ClusterTree for points above level 0. With clusters of 140 members about 21 bytes per
/// vertex.
template <DynamicTriangulation Triangulation>
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
  /// `empty`: the triangulation to fill, where it has options of its own (a metric).
  /// Throws: what the source throws, HierarchyError, std::length_error.
  explicit MultiresolutionModel(ClusterSource& source, const Detail& start = {},
                                ModelOptions options = {}, Triangulation empty = Triangulation());

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

  [[nodiscard]] const Triangulation& triangulation() const { return triangulation_; }
  [[nodiscard]] unsigned top() const { return tree_.top(); }
  /// Points present; more than vertices where some have equal coordinates.
  [[nodiscard]] std::size_t point_count() const { return points_; }

  /// Of the point that stands for a living vertex. O(1).
  [[nodiscard]] PointId point_id(VertexId vertex) const;
  [[nodiscard]] unsigned level(VertexId vertex) const;
  [[nodiscard]] double height(VertexId vertex) const { return owners_.height(vertex); }
  /// The clusters that the points on a vertex head, those of the standing point first, the coarsest
  /// first. Replaces `clusters`.
  void heads(VertexId vertex, std::vector<ClusterId>& clusters) const;

  [[nodiscard]] std::size_t expanded_count() const { return tree_.expanded_count(); }
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
  using Slot = ClusterTree::Slot;
  using Verdict = ClusterTree::Verdict;
  static constexpr std::size_t kMaxVertices = (std::size_t{1} << 29) - 2;

  static constexpr std::size_t kKeptPoints = 1 << 16;

  template <DynamicTriangulation>
  friend class ViewControl;  // it decides by the tree

  struct Staged {
    Slot slot;
    std::size_t first;  // of its points in points and heights
  };
  // What a step has read and not yet inserted.
  struct Stage {
    std::vector<Staged> clusters;
    std::vector<Point> points;
    std::vector<double> heights;
  };

  [[nodiscard]] ClusterTree::Take take();
  [[nodiscard]] ClusterTree::Judge judge(const Detail& detail);
  const Delta& change_region(const Box3& region, unsigned level, bool refine, bool coarsen);
  const Delta& apply(const ClusterTree::Plan& plan);
  void check_room() const;
  void remove_cluster(Slot cluster);
  void insert_clusters(bool list_created);
  void build_clusters();
  void note(VertexOwners::Change change, VertexId vertex, double height_before);
  void start_delta();
  void finish_delta();
  void finish_reassigned();
  void finish_heights();
  [[nodiscard]] ChildRef find(ClusterId cluster) const;

  Triangulation triangulation_;
  ClusterTree tree_;
  VertexOwners owners_;
  std::size_t points_ = 0;
  bool deltas_, old_heights_;
  bool open_ = false;  // between open_step() and close_step()
  Delta delta_;
  Stage stage_;
  std::vector<VertexId> created_;                            // in a step that also collapses
  std::vector<bool> marks_;                                  // scratch of finish_delta(), all false
  std::vector<double> heights_before_;                       // with old_heights, by slot
  std::vector<bool> noted_;                                  // those of heights_before_ that hold
  std::vector<VertexId> noted_vertices_;                     // the same as a list
  std::vector<VertexId> gone_;                               // scratch of remove_cluster()
  std::vector<typename Triangulation::Insertion> inserted_;  // scratch of insert_clusters()
};

/// The model of points in the plane: std::int32_t for rasters in column and row, else double.
template <class Coord>
using Multiresolution2 = MultiresolutionModel<Delaunay2<Coord>>;
/// The model of points in space: tetrahedra in place of triangles; a height is the z of a vertex.
template <class Coord>
using Multiresolution3 = MultiresolutionModel<Delaunay3<Coord>>;

}  // namespace terrace::tri

#include "terrace/tri/multiresolution_impl.hpp"  // IWYU pragma: keep
