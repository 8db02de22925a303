// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "terrace/tri/multiresolution.hpp"
#include "terrace/tri/multiresolution_source.hpp"

/// What a view of a multiresolution model asks for, see ViewControl.

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
  /// Of a ground unit: at distance 1 (perspective), or anywhere (orthographic).
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
  /// below this share of it. Between the two it stays as it is: a camera that trembles changes
  /// nothing. More than 0, at most 1.
  double collapse_below = 0.75;
  /// A cluster is out of view when it is outside the picture by more than this, as a share of its
  /// distance (perspective) or of the picture's height (orthographic); boxes of focuses and regions
  /// hold what they have expanded until it is outside by this share of their longest finite side.
  /// A cluster of level l is taken to be in view from l / (l + 1) of this on, so that those below
  /// it are known, and loaded, before they are seen.
  double guard = 0.05;
  /// Clusters are asked for before they are wanted: when their demand by the view widened by the
  /// guard is above this, and not below collapse_below. Infinity: none are.
  double ask_above = 0.85;
  /// Points of the model, the most there may be. The root's are always there.
  std::size_t max_points = std::size_t{1} << 28;
  /// Of the clusters given and kept, see ViewControl::give().
  std::size_t max_cached_bytes = std::size_t{1} << 28;
  /// Clusters that may show an outline, because a normal of theirs may be perpendicular to a line
  /// of sight, are held to this fraction of View::pixel_error. 1: all are alike.
  double silhouette = 1.0;
  /// Tells the normals of a cluster, once when the one above it is expanded; none: terrain_cone().
  std::function<NormalCone(ClusterId, const ClusterRecord&)> cone;
  ModelOptions model;
};

/// What a step may spend. Whatever the budget, a step does one operation at least, if there is one.
struct StepBudget {
  /// Clusters to be expanded or collapsed. The same inputs then give the same steps on any machine.
  std::size_t operations = std::numeric_limits<std::size_t>::max();
  /// Asked of `clock`, between clusters; the next one is left for the next step where it would, by
  /// what the ones before took, not be done in time.
  double seconds = std::numeric_limits<double>::infinity();
  /// Seconds since any moment; must be there if `seconds` is finite.
  std::function<double()> clock;
};

}  // namespace terrace::tri
