// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrace/tri/multiresolution.hpp"

/// Level of detail by view: what is wanted (View), at what expense (ViewOptions, StepBudget), and
/// the control that drives a multiresolution model accordingly (ViewControl).

namespace terrace::tri {

/// The half space normal . p + offset >= 0; the normal has length 1.
struct Plane {
  Point3 normal{};
  double offset = 1.0;
};

/// What a camera sees: the intersection of five half spaces (the four sides of the picture and the
/// plane through the eye; there is no far plane), and how large things appear.
struct Camera {
  bool perspective = true;
  /// Perspective: the eye. Orthographic: a point on the axis of view; of clusters out of view those
  /// far from it are collapsed first.
  Point3 position{};
  Point3 direction{};  ///< axis of view, length 1
  std::array<Plane, 5> planes{};
  /// Pixels per ground unit: at distance 1 (perspective), or anywhere (orthographic).
  double pixels = 1.0;
  double height = 1.0;  ///< height of the picture in ground units; orthographic only
};

/// Where a camera is and in which direction it looks. `up` must not be parallel to `direction`;
/// neither needs to have length 1.
struct Pose {
  Point3 position{};
  Point3 direction{0.0, 0.0, -1.0};
  Point3 up{0.0, 1.0, 0.0};
};

/// aspect: width over height of the picture.
/// All throw std::invalid_argument if a number is not finite, an angle or extent not positive, or a
/// direction zero.
Camera perspective_camera(const Pose& pose, double fov_y_degrees, double aspect,
                          double viewport_height_pixels);
/// view_height: height of the picture, in ground units.
Camera orthographic_camera(const Pose& pose, double view_height, double aspect,
                           double viewport_height_pixels);
/// The camera of a matrix that maps ground coordinates (x, y, z, 1) to clip coordinates, row-major:
/// visible points have |x| <= w and |y| <= w there. Depth may be mapped in any way. The last row
/// distinguishes perspective from orthographic.
Camera matrix_camera(const std::array<double, 16>& view_projection, double viewport_height_pixels);

/// A part of space where no cluster with a greater error may stay collapsed.
struct ErrorRegion {
  Box3 box;
  double error = 0.0;  ///< ground units
};

/// Everything that is wanted. Each part asks for some clusters; a cluster is wanted if any of them
/// asks for it.
struct View {
  /// A cluster in view is wanted if its error may appear as more than `pixel_error` pixels: the
  /// error times camera.pixels divided by the distance from the eye to the nearest point of its
  /// box.
  std::optional<Camera> camera;
  double pixel_error = 2.0;
  /// Applies everywhere, in ground units.
  double ground_error = std::numeric_limits<double>::infinity();
  std::vector<ErrorRegion> regions;
  /// As in Detail.
  std::vector<Focus> focuses;
};

/// Directions of the normals of a cluster's surface.
struct NormalCone {
  Point3 axis{0.0, 0.0, 1.0};  ///< length 1
  double half_angle_degrees = 180.0;
};

/// The cone of a terrain no steeper than the height range of a cluster over the shorter side of its
/// box: an estimate, as only the box is known for a cluster that was never read.
NormalCone terrain_cone(const ClusterRecord& record);

struct ViewOptions {
  /// A cluster is expanded when its error exceeds the tolerance, and collapsed when it falls below
  /// this share of it. In between it stays as it is, so a jittering camera changes nothing. More
  /// than 0, at most 1.
  double collapse_below = 0.75;
  /// A cluster is out of view if it is outside the picture by more than this, as a share of its
  /// distance (perspective) or of the picture's height (orthographic); boxes of focuses and regions
  /// keep what they have expanded until it is outside by this share of their longest finite side. A
  /// cluster of level l counts as in view from l / (l + 1) of this on, so that those below it are
  /// known, and loaded, before they are seen.
  double guard = 0.05;
  /// Clusters are requested ahead of time: when their demand by the view widened by the guard
  /// exceeds this and is not below collapse_below. Infinity: never ahead of time.
  double ask_above = 0.85;
  /// Upper limit of points in the model. The root's points are always present.
  std::size_t max_points = std::size_t{1} << 28;
  /// Memory for given clusters that are kept, see ViewControl::give().
  std::size_t max_cached_bytes = std::size_t{1} << 28;
  /// Clusters that may show an outline, because one of their normals may be perpendicular to a line
  /// of sight, are held to this fraction of View::pixel_error. 1: all are treated alike.
  double silhouette = 1.0;
  /// Gives the normals of a cluster; called once, when its parent is expanded. Empty:
  /// terrain_cone().
  std::function<NormalCone(ClusterId, const ClusterRecord&)> cone;
  ModelOptions model;
};

/// What a step may spend. Whatever the budget, a step does at least one operation if any is due.
struct StepBudget {
  /// Clusters to expand or collapse. With this the same inputs give the same steps on any machine.
  std::size_t operations = std::numeric_limits<std::size_t>::max();
  /// Checked by `clock` between clusters; a cluster is left for the next step if, judging by
  /// previous ones, it would not be finished in time.
  double seconds = std::numeric_limits<double>::infinity();
  /// Seconds since any fixed moment; required if `seconds` is finite.
  std::function<double()> clock;
  /// Seconds that the caller will need after the step for each point that came, and for each that
  /// went; they are kept free.
  std::array<double, 2> after{};
};

/// Measures what a step spends and predicts what is still to come; all times are from
/// StepBudget::clock.
class StepMeter {
 public:
  /// Kinds of operations, which have rates of their own.
  static constexpr std::size_t kExpand = 0, kCollapse = 1;

  void start(const StepBudget& budget);
  /// Whether one more operation on this many points may begin: if it fits, or is the first one.
  [[nodiscard]] bool has(std::size_t points, std::size_t kind = kExpand) const {
    return operations_ == 0 || fits(points, kind);
  }
  /// Whether one more operation on this many points fits.
  [[nodiscard]] bool fits(std::size_t points, std::size_t kind = kExpand) const;
  /// The same for an operation of which it is not known yet on how many.
  [[nodiscard]] bool has_usual(std::size_t kind) const {
    return has(static_cast<std::size_t>(usual_points_[kind]), kind);
  }
  /// Whether so much time has gone by since the last operation that what only prepares later steps
  /// should wait for these. Asks the clock.
  [[nodiscard]] bool dwelt() const { return timed_ && now() - last_ > kDwell * budget_->seconds; }
  /// To be called after each operation.
  void spend(std::size_t points, std::size_t kind = kExpand);
  /// To be called before the first operation.
  void ready() { last_ = now(); }
  /// To be called after work that takes about as long in each step, whatever it changes.
  void fixed();
  /// To be called at the end of the step.
  void end();

 private:
  /// Share of a step's seconds.
  static constexpr double kDwell = 0.1;

  [[nodiscard]] double now() const { return timed_ ? budget_->clock() : 0.0; }

  const StepBudget* budget_ = nullptr;
  bool timed_ = false;
  double begin_ = 0.0, last_ = 0.0;
  std::size_t operations_ = 0;
  std::array<std::size_t, 2> points_{};  ///< by kind
  bool fixed_done_ = false;
  // Seconds per point of operations by kind and of the end, seconds of the fixed work, and points
  // of an operation by kind, estimated from previous steps.
  std::array<double, 2> operation_rate_{}, usual_points_{};
  double end_rate_ = 0.0, fixed_ = 0.0;
};

/// A cluster as delivered by its loader.
struct GivenCluster {
  ClusterId cluster{};
  /// As in ClusterMembers.
  std::vector<Point3> positions;
  std::vector<std::uint64_t> children;
  std::vector<std::byte> values{};
  /// Above level 0: the records of the clusters one level down headed by each member, in order,
  /// then by the cluster's own head (ViewRequest::head_child); the root has no head. Those that
  /// are slow to come by may be bounds (ClusterRecord::kUnread), unless there are outlines to be
  /// told (ViewOptions::silhouette).
  std::vector<ClusterRecord> child_records;
};

/// A missing cluster.
struct ViewRequest {
  ClusterId cluster{};
  ClusterId head_child{};  ///< above level 0: the cluster that its head heads one level down
  /// From its record. ClusterRecord::kUnread: that is what is missing, by which it may be seen that
  /// the cluster is wanted; see ViewControl::give_record().
  std::uint64_t members = 0;
  double importance = 0.0;  ///< its error over the tolerance
};

/// Reads a cluster from a source, with everything that give() needs; blocks while the source does.
/// Throws what the source throws; HierarchyError if it is too damaged to continue.
GivenCluster load(ClusterSource& source, const ViewRequest& request);
/// Reads the root.
GivenCluster load_root(ClusterSource& source);

enum class ViewPin : std::uint8_t { expanded, collapsed };

/// Level of detail by view: a multiresolution model that follows a camera under budgets of memory
/// and time, and never waits for data. Each step reports which clusters are missing; the caller
/// loads them in any way and gives them when they arrive.
///
/// With S the set of expanded clusters, a view that does not change, sufficient budgets and all
/// clusters given, steps converge to
///     { c : want(c) > 1 }  and  { c in S : keep(c) >= collapse_below }
/// whatever interrupts them, where want and keep are the demands of the view and of the view
/// widened by the guard, each no greater than that of the cluster above. So a step never undoes
/// what the previous one did. (J. Skala, Algorithms for manipulating large geometric data, section
/// 8.4, expands by closeness alone.)
///
/// Order of a step: the clusters with the greatest demand are expanded first. If there would be too
/// many points, clusters of less than collapse_below times that demand are collapsed to make room:
/// first those out of view, the farthest first, then those of the least demand. The remaining time
/// goes to collapsing clusters that are no longer wanted, in the same order; once they hold a
/// quarter of the points, this comes before expanding. Under max_points the outcome depends on
/// sizes, but it is also stable once reached.
///
/// Cost of a step without changes: O(expanded clusters + collapsed clusters next to wanted ones).
/// Memory beside the model: 85 bytes per expanded cluster and 65 per cluster that could be expanded
/// (with outlines 32 more each), and the given clusters that are kept.
///
/// Triangulation: Delaunay2, for points in the plane with heights; RegionalDelaunay2, for the same
/// with elliptical metrics in regions; DynamicSurface, for scans of
/// surfaces in space, whose shape is then part of what a step may spend; PointCloud, for points in
/// space alone.
template <class Triangulation>
class ViewControl {
 public:
  using Model = MultiresolutionModel<Triangulation>;
  using Delta = typename Model::Delta;
  using Pin = ViewPin;

  struct Fault {
    ClusterId cluster{};
    std::string what;
  };
  /// What a step did and what is missing. Valid until the next step.
  struct Step {
    const Delta* delta = nullptr;
    std::size_t expanded = 0, collapsed = 0;  ///< clusters
    /// Wanted clusters that remain collapsed: not given yet; given, but the step's budget was
    /// spent, or not looked at because it was; no room under max_points or max_cached_bytes.
    std::size_t missing = 0, pending = 0, blocked = 0;
    /// The greatest demand among these; if at most 1, the view is as detailed as it should be.
    double worst = 0.0;
    /// Whether another step with the same view and no new clusters would change nothing.
    bool settled = false;
    /// The missing clusters that are worth loading, most important first, as far as max_points and
    /// max_cached_bytes leave room for them, a thousand at most; then those that may be wanted
    /// soon, likewise, and as far as the budget leaves time to tell them. Among them the clusters
    /// of which only the record is missing, by an estimate of their importance.
    std::vector<ViewRequest> wanted;
    /// The ones among these that no step has named before, or only before they were withdrawn or
    /// forgotten: for a caller that starts loading at once.
    std::vector<ViewRequest> requests;
    /// Requested before and no longer needed, in ascending order.
    std::vector<ClusterId> withdrawn;
    /// Clusters that contradict themselves; they stay collapsed until they are given again.
    std::vector<Fault> faults;
  };

  /// counts: clusters of each level below the top, as from ClusterSource::cluster_count. root:
  /// everything about cluster_id(counts.size(), 0). empty: as in MultiresolutionModel.
  /// Throws: HierarchyError, std::length_error; std::invalid_argument for options out of range.
  ViewControl(std::vector<std::uint64_t> counts, GivenCluster root, ViewOptions options = {},
              Triangulation empty = Triangulation());
  ~ViewControl();
  ViewControl(const ViewControl&) = delete;
  ViewControl& operator=(const ViewControl&) = delete;

  [[nodiscard]] const Model& model() const;
  [[nodiscard]] const ViewOptions& options() const;

  /// Brings the model closer to what the view asks for. Throws std::invalid_argument for a
  /// tolerance that is negative or NaN, or seconds without a clock; then nothing has changed. Clock
  /// and cone must not throw.
  const Step& step(const View& view, const StepBudget& budget = {});
  /// Computes from scratch what steps only follow, as MultiresolutionModel::restore() does: for a
  /// camera that rests. Not bounded by a budget. A step's delta is valid until then.
  const Delta& restore(unsigned threads = 1);

  /// Delivers a cluster, requested or not. It is kept, as far as max_cached_bytes allows, even
  /// after it was expanded, in case it is needed again. Returns false if it is larger than the
  /// budget. Throws HierarchyError if counts of members, children, values and records do not agree.
  bool give(GivenCluster cluster);
  /// A cluster that is kept, null for others. What a step has expanded is kept until the next
  /// give(). O(1).
  [[nodiscard]] const GivenCluster* given(ClusterId cluster) const;
  /// Delivers the record of a cluster of which only bounds were given. Nothing happens if it is no
  /// longer needed. O(log n).
  void give_record(ClusterId cluster, const ClusterRecord& record);
  /// The record, or its bounds, of the cluster that a living vertex stands for: the coarsest
  /// collapsed one that it heads. nullopt if it stands for itself alone. O(its level).
  [[nodiscard]] std::optional<ClusterRecord> stands_for(VertexId vertex) const;
  /// Whether the box of a collapsed cluster, or the bounds of it, meets a box. O(children of the
  /// expanded clusters that do).
  [[nodiscard]] bool meets_collapsed(const Box3& box) const;
  /// Loading failed or was cancelled: the cluster may be requested again.
  void forget(ClusterId cluster);

  /// Overrides the view: a cluster pinned expanded is expanded as soon as its parent is, and then
  /// its ancestors stay expanded; one pinned collapsed keeps everything below it collapsed.
  void pin(ClusterId cluster, Pin how);
  void unpin(ClusterId cluster);

  /// Bytes of the given clusters.
  [[nodiscard]] std::size_t cached_bytes() const;
  /// Bytes held besides the triangulation and the given clusters.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The view control of points in the plane with heights.
template <class Coord>
using ViewControl2 = ViewControl<Delaunay2<Coord>>;

extern template class ViewControl<Delaunay2<std::int32_t>>;
extern template class ViewControl<PointCloud>;
extern template class ViewControl<Delaunay2<double>>;
extern template class ViewControl<DynamicSurface<std::int32_t>>;
extern template class ViewControl<DynamicSurface<double>>;

}  // namespace terrace::tri
