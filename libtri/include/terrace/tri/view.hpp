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

/// Level of detail by view: what is asked for (View), with what means (ViewOptions, StepBudget),
/// and what drives a multiresolution model by it (ViewControl).

namespace terrace::tri {

/// The half space normal . p + offset >= 0; the normal has length 1.
struct Plane {
  Point3 normal{};
  double offset = 1.0;
};

/// What a camera sees: the inside of five half spaces (the four sides of the picture and the plane
/// of the eye; there is no far plane), and how large things appear.
struct Camera {
  bool perspective = true;
  /// Perspective: the eye. Orthographic: a point on the axis of view; of clusters out of view those
  /// far from it go first.
  Point3 position{};
  Point3 direction{};  ///< of the axis, length 1
  std::array<Plane, 5> planes{};
  /// Pixels per ground unit: at distance 1 (perspective), or anywhere (orthographic).
  double pixels = 1.0;
  double height = 1.0;  ///< of the picture, in ground units; orthographic only
};

/// Where a camera is and which way it looks. `up` must not be parallel to `direction`; neither need
/// have length 1.
struct Pose {
  Point3 position{};
  Point3 direction{0.0, 0.0, -1.0};
  Point3 up{0.0, 1.0, 0.0};
};

/// aspect: width over height of the picture.
/// All throw std::invalid_argument where a number is not finite, an angle or extent not positive,
/// or a direction null.
Camera perspective_camera(const Pose& pose, double fov_y_degrees, double aspect,
                          double viewport_height_pixels);
/// view_height: of the picture, in ground units.
Camera orthographic_camera(const Pose& pose, double view_height, double aspect,
                           double viewport_height_pixels);
/// The camera of a matrix that takes ground coordinates (x, y, z, 1) to clip coordinates, row by
/// row: what is seen has |x| <= w and |y| <= w there. Depth may be mapped in any manner. The last
/// row tells perspective from orthographic.
Camera matrix_camera(const std::array<double, 16>& view_projection, double viewport_height_pixels);

/// A part of space where no cluster of a greater error may stay collapsed.
struct ErrorRegion {
  Box3 box;
  double error = 0.0;  ///< ground units
};

/// All that is wanted. Each part asks for some clusters; what one of them asks for is wanted.
struct View {
  /// A cluster in view is wanted where its error may show as more than `pixel_error` pixels: the
  /// error times camera.pixels over the distance from the eye to the nearest point of its box.
  std::optional<Camera> camera;
  double pixel_error = 2.0;
  /// Anywhere, in ground units.
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
/// box: an estimate, as boxes are all that is known of a cluster that was never read.
NormalCone terrain_cone(const ClusterRecord& record);

struct ViewOptions {
  /// A cluster is expanded when its error is above what is tolerated, and collapsed when it falls
  /// below this share of it. Between the two it stays as it is, so a jittering camera changes
  /// nothing. More than 0, at most 1.
  double collapse_below = 0.75;
  /// A cluster is out of view when it is outside the picture by more than this, as a share of its
  /// distance (perspective) or of the picture's height (orthographic); boxes of focuses and regions
  /// hold what they have expanded until it is outside by this share of their longest finite side.
  /// A cluster of level l is taken to be in view from l / (l + 1) of this on, so that those below
  /// it are known, and loaded, before they are seen.
  double guard = 0.05;
  /// Clusters are asked for before they are wanted: when their demand by the view widened by the
  /// guard is above this, and not below collapse_below. Infinity: never ahead of time.
  double ask_above = 0.85;
  /// Upper limit of points in the model. The root's are always there.
  std::size_t max_points = std::size_t{1} << 28;
  /// Memory for clusters that were given and are kept, see ViewControl::give().
  std::size_t max_cached_bytes = std::size_t{1} << 28;
  /// Clusters that may show an outline, because a normal of theirs may be perpendicular to a line
  /// of sight, are held to this fraction of View::pixel_error. 1: all are alike.
  double silhouette = 1.0;
  /// Gives the normals of a cluster, asked once, when its parent is expanded. Empty:
  /// terrain_cone().
  std::function<NormalCone(ClusterId, const ClusterRecord&)> cone;
  ModelOptions model;
};

/// What a step may spend. Whatever the budget, a step does at least one operation if any is due.
struct StepBudget {
  /// Clusters to be expanded or collapsed. The same inputs then give the same steps on any machine.
  std::size_t operations = std::numeric_limits<std::size_t>::max();
  /// Checked by `clock` between clusters; a cluster is left for the next step if, judging by those
  /// before, it would not be done in time.
  double seconds = std::numeric_limits<double>::infinity();
  /// Seconds since any moment; required if `seconds` is finite.
  std::function<double()> clock;
};

/// What a step needs to spend; all times are of StepBudget::clock.
class StepMeter {
 public:
  void start(const StepBudget& budget);
  /// Whether one more operation on this many points fits. The first one always does.
  [[nodiscard]] bool has(std::size_t points) const;
  /// Call it after each operation.
  void spend(std::size_t points);
  /// Call it before the first operation, and at the end of the step.
  void ready() { last_ = now(); }
  void end();

 private:
  [[nodiscard]] double now() const { return timed_ ? budget_->clock() : 0.0; }

  const StepBudget* budget_ = nullptr;
  bool timed_ = false;
  double begin_ = 0.0, last_ = 0.0;
  std::size_t operations_ = 0, points_ = 0;
  // Seconds per point of operations and of the end, as in the steps before.
  double operation_rate_ = 0.0, end_rate_ = 0.0;
};

/// A cluster as its loader hands it over.
struct GivenCluster {
  ClusterId cluster{};
  /// As in ClusterMembers.
  std::vector<Point3> positions;
  std::vector<std::uint64_t> children;
  /// Above level 0: the records of the clusters one level down headed by each member, in order, and
  /// then by the cluster's own head (ViewRequest::head_child); the root has no head.
  std::vector<ClusterRecord> child_records;
};

/// A cluster that is missing.
struct ViewRequest {
  ClusterId cluster{};
  ClusterId head_child{};     ///< above level 0: what its head heads one level down
  std::uint64_t members = 0;  ///< by its record
  double importance = 0.0;    ///< its error over what is tolerated
};

/// Reads a cluster from a source, with all that give() needs, and blocks while the source does.
/// Throws what the source throws; HierarchyError if it is too damaged to continue.
GivenCluster load(ClusterSource& source, const ViewRequest& request);
/// The root.
GivenCluster load_root(ClusterSource& source);

enum class ViewPin : std::uint8_t { expanded, collapsed };

/// Level of detail by view: a multiresolution model that follows a camera under budgets of memory
/// and time, and never waits for data. Each step it tells which clusters it lacks; whoever drives
/// it loads them in any manner and gives them, whenever they are there.
///
/// With S the expanded clusters, a view that stays, enough budgets and all clusters given, steps
/// end at
///     { c : want(c) > 1 }  and  { c in S : keep(c) >= collapse_below }
/// whatever interrupts them, want and keep being the demands of the view and of the view widened by
/// the guard, each no greater than that of the cluster above. So what a step has done the next one
/// does not undo. (J. Skala, Algorithms for manipulating large geometric data, section 8.4, expands
/// by closeness alone.)
///
/// Order of a step: what is wanted most is expanded first. Where the points would be too many,
/// clusters of less than collapse_below times its demand are collapsed for it: out of view first,
/// the farthest of them first, then those of the least demand. What time is left goes to collapsing
/// what is no longer wanted, in the same order; once that is a quarter of the points, it comes
/// before expanding. Under max_points the outcome depends on sizes, but it is stable too once
/// reached.
///
/// Cost of a step without changes: O(expanded clusters + collapsed clusters next to wanted ones).
/// Memory beside the model: 85 bytes per expanded cluster and 65 per cluster that could be expanded
/// (with outlines 32 more each), and the given clusters that are kept.
///
/// Triangulation: Delaunay2, for points in the plane with heights; PointCloud, for points in space.
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
  /// What a step did and what it lacks. Lives until the next step.
  struct Step {
    const Delta* delta = nullptr;
    std::size_t expanded = 0, collapsed = 0;  ///< clusters
    /// Wanted clusters that remain collapsed: not given yet; given, but the step's budget was
    /// spent; no room under max_points or max_cached_bytes.
    std::size_t missing = 0, pending = 0, blocked = 0;
    /// The greatest demand among these; at most 1: the view is as detailed as it should be.
    double worst = 0.0;
    /// Whether another step with the same view and no new clusters would change nothing.
    bool settled = false;
    /// The missing ones that are worth loading, most important first, as far as max_points and
    /// max_cached_bytes have room for them; then those that may be wanted soon.
    std::vector<ViewRequest> wanted;
    /// The ones among these that no step has named before, or only before they were withdrawn or
    /// forgotten: for a caller who starts loading at once.
    std::vector<ViewRequest> requests;
    /// Named before and no longer needed, in ascending order.
    std::vector<ClusterId> withdrawn;
    /// Clusters that contradict themselves; they stay collapsed until they are given again.
    std::vector<Fault> faults;
  };

  /// counts: clusters of each level below the top, as ClusterSource::cluster_count tells. root: all
  /// of cluster_id(counts.size(), 0).
  /// Throws: HierarchyError, std::length_error; std::invalid_argument for options out of range.
  ViewControl(std::vector<std::uint64_t> counts, GivenCluster root, ViewOptions options = {});
  ~ViewControl();
  ViewControl(const ViewControl&) = delete;
  ViewControl& operator=(const ViewControl&) = delete;

  [[nodiscard]] const Model& model() const;
  [[nodiscard]] const ViewOptions& options() const;

  /// Brings the model nearer to what the view asks for. Throws std::invalid_argument for a
  /// tolerance that is negative or not a number, or seconds without a clock; nothing has changed
  /// then. Clock and cone must not throw.
  const Step& step(const View& view, const StepBudget& budget = {});

  /// Hands over a cluster, asked for or not. It is kept, as far as max_cached_bytes goes, also
  /// after it was expanded, for when it comes back. False: it is larger than the budget.
  /// Throws HierarchyError where counts of members, children and records do not agree.
  bool give(GivenCluster cluster);
  /// Loading it failed or was cancelled: it may be requested again.
  void forget(ClusterId cluster);

  /// Overrides the view: a cluster pinned expanded is expanded as soon as its parent is, and then
  /// its ancestors stay expanded; one pinned collapsed keeps everything below it collapsed.
  void pin(ClusterId cluster, Pin how);
  void unpin(ClusterId cluster);

  /// Bytes of the given clusters.
  [[nodiscard]] std::size_t cached_bytes() const;
  /// Bytes held beside the triangulation and the given clusters.
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

}  // namespace terrace::tri
