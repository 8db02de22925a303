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
#include "terrace/tri/thinned_delaunay2.hpp"

/// Level of detail by view: the wanted detail (View), the limits (ViewOptions, StepBudget), and the
/// control that drives a multiresolution model accordingly (ViewControl).

namespace terrace::tri {

/// The half space normal . p + offset >= 0. The normal has length 1.
struct Plane {
  Point3 normal{};
  double offset = 1.0;
  bool operator==(const Plane&) const = default;
};

/// A camera's field of view and scale. The field of view is the intersection of five half spaces:
/// the four sides of the picture and the plane through the eye. There is no far plane.
struct Camera {
  bool perspective = true;
  /// Perspective: the eye. Orthographic: a point on the axis of view. Clusters out of view are
  /// collapsed in order of their distance from it, the farthest first.
  Point3 position{};
  Point3 direction{};  ///< axis of view, length 1
  std::array<Plane, 5> planes{};
  /// Pixels per ground unit: at distance 1 (perspective), or anywhere (orthographic).
  double pixels = 1.0;
  double height = 1.0;  ///< of the picture, in ground units (orthographic only)
  bool operator==(const Camera&) const = default;
};

/// Position and viewing direction of a camera. `up` must not be parallel to `direction`. Neither
/// needs to have length 1.
struct Pose {
  Point3 position{};
  Point3 direction{0.0, 0.0, -1.0};
  Point3 up{0.0, 1.0, 0.0};
};

/// aspect: width over height of the picture. All camera functions throw std::invalid_argument if a
/// number is not finite, an angle or extent is not positive, or a direction is zero.
Camera perspective_camera(const Pose& pose, double fov_y_degrees, double aspect,
                          double viewport_height_pixels);
/// view_height: height of the picture, in ground units.
Camera orthographic_camera(const Pose& pose, double view_height, double aspect,
                           double viewport_height_pixels);
/// The camera of a row-major matrix that maps ground coordinates (x, y, z, 1) to clip coordinates,
/// in which visible points have |x| <= w and |y| <= w. The depth mapping is arbitrary. The last row
/// distinguishes perspective from orthographic.
Camera matrix_camera(const std::array<double, 16>& view_projection, double viewport_height_pixels);

/// A part of space in which no cluster with a greater error may stay collapsed.
struct ErrorRegion {
  Box3 box;
  double error = 0.0;  ///< ground units
  bool operator==(const ErrorRegion&) const = default;
};

/// The wanted detail. Each part asks for some clusters. A cluster is wanted if any of them asks for
/// it.
struct View {
  /// A cluster in view is wanted if its error may appear as more than `pixel_error` pixels. The
  /// error in pixels is the error times camera.pixels divided by the distance from the eye to the
  /// nearest point of the cluster's box.
  std::optional<Camera> camera{};
  double pixel_error = 2.0;
  /// Applies everywhere, in ground units.
  double ground_error = std::numeric_limits<double>::infinity();
  std::vector<ErrorRegion> regions{};
  /// As in Detail.
  std::vector<Focus> focuses{};
  bool operator==(const View&) const = default;
};

/// Directions of the normals of a cluster's surface.
struct NormalCone {
  Point3 axis{0.0, 0.0, 1.0};  ///< length 1
  double half_angle_degrees = 180.0;
};

/// The cone of a terrain no steeper than the height range of a cluster over the shorter side of its
/// box. This is an estimate, because only the box of a cluster is known before it is read.
NormalCone terrain_cone(const ClusterRecord& record);

/// Maps columns, rows and heights of a raster to ground coordinates.
struct RasterFrame {
  std::array<double, 9> linear{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row-major, not singular
  Point3 origin{};  ///< ground coordinates of column 0, row 0, height 0

  [[nodiscard]] Point3 operator()(const Point3& p) const;
  /// The box around a mapped box.
  [[nodiscard]] Box3 operator()(const Box3& box) const;
  /// Ground units of height per unit of the raster's heights.
  [[nodiscard]] double height_scale() const { return linear[8] < 0 ? -linear[8] : linear[8]; }
  /// The columns and rows in a box on the ground, up to rounding. Its heights are not changed.
  [[nodiscard]] Box3 cells(const Box3& ground) const;
};

struct ViewOptions {
  /// A cluster is expanded when its error exceeds the tolerance, and collapsed when it falls below
  /// this share of it. In between it stays as it is, so a jittering camera changes nothing. 0 <
  /// collapse_below <= 1.
  double collapse_below = 0.75;
  /// A cluster is out of view if it is outside the picture by more than this, as a share of its
  /// distance (perspective) or of the picture's height (orthographic). Boxes of focuses and regions
  /// keep expanded clusters until these are outside by this share of the box's longest finite side.
  /// A cluster of level l counts as in view from l / (l + 1) of this on, so that the clusters below
  /// it are known, and loaded, before they come into view.
  double guard = 0.05;
  /// Clusters are requested ahead of time when their demand, by the view widened by the guard,
  /// exceeds this and is not below collapse_below. Infinity: never ahead of time.
  double ask_above = 0.85;
  /// Maximum number of points in the model. The root's points are always present.
  /// ThinnedDelaunay2: maximum number of vertices. At most 16 times as many points are loaded.
  std::size_t max_points = std::size_t{1} << 28;
  /// Memory for the delivered clusters that are kept, see ViewControl::give().
  std::size_t max_cached_bytes = std::size_t{1} << 28;
  /// Tolerance of clusters that may show an outline, because one of their normals may be
  /// perpendicular to a line of sight, as a fraction of View::pixel_error. 1: all are treated
  /// alike.
  double silhouette = 1.0;
  /// Returns the normals of a cluster. Called once, when its parent is expanded. Empty:
  /// terrain_cone().
  std::function<NormalCone(ClusterId, const ClusterRecord&)> cone{};
  /// ThinnedDelaunay2 only: the raster's frame, and whether samples are missing inside it.
  RasterFrame raster{};
  bool raster_has_gaps = false;
  ModelOptions model{};
};

/// Limits of a step. Whatever the budget, a step performs at least one operation if any is due.
struct StepBudget {
  /// Clusters to expand or collapse. With this limit alone, the same inputs give the same steps on
  /// any machine.
  std::size_t operations = std::numeric_limits<std::size_t>::max();
  /// Checked by `clock` between clusters. A cluster is left for the next step if, judging by
  /// previous ones, it would not be finished in time.
  double seconds = std::numeric_limits<double>::infinity();
  /// Seconds since any fixed moment. Required if `seconds` is finite.
  std::function<double()> clock{};
  /// Seconds that the caller needs after the step for each point added and for each point removed.
  /// The step leaves this time unused.
  std::array<double, 2> after{};
};

/// Measures the time that a step spends and predicts the rest. All times are from
/// StepBudget::clock.
class StepMeter {
 public:
  /// Kinds of operations, each with its own rates.
  static constexpr std::size_t kExpand = 0, kCollapse = 1, kThin = 2;
  /// Expansions whose points are not vertices yet, so that they cost nothing after the step.
  static constexpr std::size_t kLoad = 3;
  static constexpr std::size_t kKinds = 4;

  void start(const StepBudget& budget);
  /// True if one more operation on this many points may begin, because it fits or is the first one.
  [[nodiscard]] bool has_time(std::size_t points, std::size_t kind = kExpand) const {
    return operations_ == 0 || fits(points, kind);
  }
  /// True if one more operation on this many points fits.
  [[nodiscard]] bool fits(std::size_t points, std::size_t kind = kExpand) const;
  /// The same for an operation whose number of points is not known yet.
  [[nodiscard]] bool has_time_for_usual(std::size_t kind) const {
    return has_time(static_cast<std::size_t>(usual_points_[kind]), kind);
  }
  /// True if so much time has passed since the last operation that work for later steps should
  /// wait. Reads the clock.
  [[nodiscard]] bool is_late() const { return timed_ && now() - last_ > kDwell * budget_->seconds; }
  /// Call after each operation.
  void spend(std::size_t points, std::size_t kind = kExpand);
  /// Call before the first operation.
  void start_operations() { last_ = now(); }
  /// Call after the work that takes about as long in each step, whatever the step changes.
  void end_fixed_work();
  /// Call at the end of the step.
  void end();

 private:
  /// Share of a step's seconds.
  static constexpr double kDwell = 0.1;

  [[nodiscard]] double now() const { return timed_ ? budget_->clock() : 0.0; }

  const StepBudget* budget_ = nullptr;
  bool timed_ = false;
  double begin_ = 0.0, last_ = 0.0;
  std::size_t operations_ = 0;
  std::array<std::size_t, kKinds> points_{};  ///< by kind
  bool fixed_done_ = false;
  // Estimates from previous steps: seconds per point of operations by kind and of the end, seconds
  // of the fixed work, and points of an operation by kind.
  std::array<double, kKinds> operation_rate_{}, usual_points_{};
  double end_rate_ = 0.0, fixed_ = 0.0;
};

/// A cluster as delivered by its loader.
struct LoadedCluster {
  ClusterId cluster{};
  /// As in ClusterMembers.
  std::vector<Point3> positions;
  std::vector<std::uint64_t> children;
  std::vector<std::byte> values{};
  /// Above level 0: the records of the clusters one level down headed by each member, in order,
  /// then by the cluster's own head (ViewRequest::head_child). The root has no head. Records that
  /// are slow to read may be bounds (ClusterRecord::kUnread), unless outlines are wanted
  /// (ViewOptions::silhouette).
  std::vector<ClusterRecord> child_records;
};

/// A missing cluster.
struct ViewRequest {
  ClusterId cluster{};
  ClusterId head_child{};  ///< above level 0: the cluster that its head heads one level down
  /// The number of members from its record. ClusterRecord::kUnread: the record itself is missing,
  /// which is needed to decide whether the cluster is wanted. See ViewControl::give_record().
  std::uint64_t members = 0;
  double importance = 0.0;  ///< the cluster's error divided by the tolerance
};

/// Reads a cluster from a source, with everything that give() needs. Blocks while the source does.
/// Throws whatever the source throws, and HierarchyError if the cluster is too damaged to continue.
LoadedCluster load(ClusterSource& source, const ViewRequest& request);
/// Reads the root.
LoadedCluster load_root(ClusterSource& source);

enum class ViewPin : std::uint8_t { expanded, collapsed };

/// Level of detail by view: a multiresolution model that follows a camera under budgets of memory
/// and time, and never waits for data. Each step reports which clusters are missing. The caller
/// loads them in any way and delivers them when they arrive.
///
/// Let S be the set of expanded clusters. With a view that does not change, sufficient budgets and
/// all clusters delivered, steps converge to
///     { c : want(c) > 1 }  and  { c in S : keep(c) >= collapse_below }
/// whatever interrupts them. Here want and keep are the demands of the view and of the view widened
/// by the guard, each limited to its value for the cluster above. A step therefore never undoes the
/// previous one. (J. Skala, Algorithms for manipulating large geometric data, section 8.4, expands
/// by closeness alone.)
///
/// Order of a step: the clusters with the greatest demand are expanded first. If there would be too
/// many points, clusters of less than collapse_below times that demand are collapsed to make room:
/// first those out of view, the farthest first, then those of the least demand. The remaining time
/// goes to collapsing clusters that are no longer wanted, in the same order. If these clusters have
/// more than a quarter of the points, they are collapsed before others are expanded. Under
/// max_points the outcome depends on sizes, but it is also stable once reached.
///
/// Cost of a step without changes: O(expanded clusters + collapsed clusters next to wanted ones).
/// Memory besides the model: 85 bytes per expanded cluster and 65 per cluster that could be
/// expanded (with outlines 32 more each), and the delivered clusters that are kept.
///
/// Triangulation: one of
/// - Delaunay2, for points in the plane with heights
/// - ThinnedDelaunay2, for rasters. Errors are ranges of heights, and the vertices are only those
///   that View asks for in each window. View::ground_error and View::regions hold at every sample,
///   for which the clusters that they concern are all expanded.
/// - RegionalDelaunay2, for the same with elliptical metrics in regions
/// - DynamicSurface, for scans of surfaces in space. Its shape is part of the cost of a step.
/// - PointCloud, for points in space alone
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
  /// The result of a step and the clusters it lacks. Valid until the next step.
  struct Step {
    const Delta* delta = nullptr;
    std::size_t expanded = 0, collapsed = 0;  ///< clusters
    /// Windows whose vertices were chosen again (ThinnedDelaunay2 only).
    std::size_t thinned = 0;
    /// Wanted clusters that remain collapsed. missing: not delivered yet. pending: delivered, but
    /// the step's budget was spent, or not examined for that reason. blocked: no room under
    /// max_points or max_cached_bytes.
    std::size_t missing = 0, pending = 0, blocked = 0;
    /// The greatest demand among these. If it is at most 1, the view is as detailed as it should
    /// be.
    double worst = 0.0;
    /// True if another step with the same view and no new clusters would change nothing.
    bool settled = false;
    /// At most a thousand missing clusters that are worth loading, most important first, as far as
    /// max_points and max_cached_bytes leave room for them. Then as many that may be wanted soon,
    /// as far as the budget leaves time to find them. Clusters of which only the record is missing
    /// are among them, by an estimate of their importance.
    std::vector<ViewRequest> wanted;
    /// Those of `wanted` that no step has named before, or only before they were withdrawn or
    /// forgotten. For a caller that starts loading at once.
    std::vector<ViewRequest> requests;
    /// Clusters requested before and no longer needed, in ascending order.
    std::vector<ClusterId> withdrawn;
    /// Clusters that contradict themselves. They stay collapsed until they are delivered again.
    std::vector<Fault> faults;
  };

  /// counts: number of clusters of each level below the top, as from ClusterSource::cluster_count.
  /// root: cluster_id(counts.size(), 0) with all its data. empty: as in MultiresolutionModel.
  /// Throws HierarchyError, std::length_error, and std::invalid_argument for options out of range.
  ViewControl(std::vector<std::uint64_t> counts, LoadedCluster root, ViewOptions options = {},
              Triangulation empty = Triangulation());
  ~ViewControl();
  ViewControl(const ViewControl&) = delete;
  ViewControl& operator=(const ViewControl&) = delete;

  [[nodiscard]] const Model& model() const;
  [[nodiscard]] const ViewOptions& options() const;

  /// Brings the model closer to the view. Throws std::invalid_argument, having changed nothing, for
  /// a tolerance that is negative or NaN, or seconds without a clock. Clock and cone must not
  /// throw.
  const Step& step(const View& view, const StepBudget& budget = {});
  /// Computes from scratch the parts that steps update only locally, as
  /// MultiresolutionModel::restore() does. Call it while the camera rests, as no budget limits it.
  /// A step's delta is valid until then.
  const Delta& restore(unsigned threads = 1);

  /// Delivers a cluster, requested or not. It is kept, as far as max_cached_bytes allows, even
  /// after it was expanded, in case it is needed again. Returns false if it is larger than the
  /// budget. Throws HierarchyError if the counts of members, children, values and records do not
  /// agree.
  bool give(LoadedCluster cluster);
  /// The delivered cluster if it is kept, otherwise null. Clusters that a step has expanded are
  /// kept until the next give(). O(1).
  [[nodiscard]] const LoadedCluster* cached_cluster(ClusterId cluster) const;
  /// Delivers the record of a cluster of which only bounds were known. Does nothing if it is no
  /// longer needed. O(log n).
  void give_record(ClusterId cluster, const ClusterRecord& record);
  /// The record, or its bounds, of the cluster that an existing vertex represents: the coarsest
  /// collapsed cluster that it heads. nullopt if it represents only itself. O(its level).
  [[nodiscard]] std::optional<ClusterRecord> represented_cluster(VertexId vertex) const;
  /// True if the box of a collapsed cluster, or its bounds, meets the given box. O(children of the
  /// expanded clusters that meet it).
  [[nodiscard]] bool meets_collapsed(const Box3& box) const;
  /// Reports that loading failed or was cancelled, so that the cluster may be requested again.
  void forget(ClusterId cluster);

  /// Overrides the view. A cluster pinned expanded is expanded as soon as its parent is, and then
  /// its ancestors stay expanded. A cluster pinned collapsed keeps everything below it collapsed.
  void pin(ClusterId cluster, Pin state);
  void unpin(ClusterId cluster);

  /// Memory of the kept clusters, in bytes.
  [[nodiscard]] std::size_t cached_bytes() const;
  /// Memory in bytes besides the triangulation and the kept clusters.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The view control of points in the plane with heights.
template <class Coord>
using ViewControl2 = ViewControl<Delaunay2<Coord>>;

extern template class ViewControl<Delaunay2<std::int32_t>>;
extern template class ViewControl<ThinnedDelaunay2>;
extern template class ViewControl<PointCloud>;
extern template class ViewControl<Delaunay2<double>>;
extern template class ViewControl<DynamicSurface<std::int32_t>>;
extern template class ViewControl<DynamicSurface<double>>;

}  // namespace terrace::tri
