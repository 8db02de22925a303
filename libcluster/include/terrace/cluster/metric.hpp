// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "terrace/cluster/point.hpp"

/// Distances between points. A distance is always measured *from a facility to a client*. In a
/// field of metrics it uses the map of the facility's region, so it need not be symmetric.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 4.1 and 7.4.

namespace terrace::cluster {

/// A linear map of vectors, row-major.
using LinearMap = std::array<double, 9>;

inline constexpr LinearMap kIdentityMap{1, 0, 0, 0, 1, 0, 0, 0, 1};

/// sqrt(sum of squares). The thesis uses this metric unless it names another.
struct Euclidean {};

/// The square of the Euclidean distance, as summed by k-means. Violates the triangle inequality.
struct SquaredEuclidean {};

/// (|dx|^p + |dy|^p + |dz|^p)^(1/p). Equation 4.2 of the thesis omits the absolute values and the
/// sum. p = 1 is the city-block distance, p = infinity the maximum distance. Below 1 the triangle
/// inequality does not hold.
struct Minkowski {
  double p = 2.0;  ///< positive; may be infinite
};

/// The length of M (client - facility), where M maps an ellipsoid onto the unit sphere. It is
/// symmetric and obeys the triangle inequality. Its unit is that of the points divided by that of
/// the semi-axes.
class Elliptical {
 public:
  /// Creates an ellipsoid with a vertical axis. Semi-axis `a` points along `angle_degrees`,
  /// counter-clockwise from +x, `b` is horizontal and perpendicular to it, and `c` is vertical, all
  /// in the unit of the points. M12 is (1/a - 1/b) sin cos. Equation 4.5 of the thesis as printed
  /// has the opposite sign, which belongs to a clockwise angle. Throws: std::invalid_argument for a
  /// semi-axis that is not positive and finite or whose reciprocal is infinite, or an angle that is
  /// not finite.
  Elliptical(double a, double b, double angle_degrees, double c = 1.0);
  /// Creates an ellipsoid whose semi-axis i points along row i of `axes`, an orthonormal matrix.
  /// Throws: std::invalid_argument as above, and if the rows are not orthonormal to 1e-9.
  Elliptical(const Point3& semi_axes, const LinearMap& axes);
  /// Creates an ellipsoid from its matrix, as map() returns it. Throws: std::invalid_argument if it
  /// is not finite, symmetric and positive definite.
  explicit Elliptical(const LinearMap& map);

  /// Returns M, which is symmetric and positive definite. For the Euclidean metric M is the
  /// identity.
  [[nodiscard]] const LinearMap& map() const { return map_; }
  /// Returns the reciprocal of the longest semi-axis; of a metric that was created from its matrix,
  /// at least 0.57 times that. For every vector v, |M v| is at least this number times |v|.
  [[nodiscard]] double least_scale() const { return least_scale_; }

 private:
  LinearMap map_;
  double least_scale_;
};

/// An elliptical metric in each region and the Euclidean metric elsewhere (7.4). Where regions
/// overlap, the first in the list applies. A distance is measured with the map of the region of its
/// *facility*, so distances between regions are not symmetric and violate the triangle inequality.
class EllipticalField {
 public:
  struct Region {
    Box3 box;  ///< closed
    Elliptical metric;
  };
  /// The coordinate frame of the boxes, if it differs from that of the points: map * point +
  /// offset.
  struct Frame {
    LinearMap map = kIdentityMap;
    Point3 offset{};
  };
  /// Throws: std::invalid_argument for a box that is empty or contains a NaN (infinite sides are
  /// allowed). The message gives its index.
  explicit EllipticalField(std::vector<Region> regions,
                           const std::optional<Frame>& frame = std::nullopt);

  /// Returns the map at a position: the field as a function from positions to symmetric matrices.
  [[nodiscard]] const LinearMap& operator()(const Point3& position) const;
  /// Returns Elliptical::least_scale() at that position, or 1 outside all regions.
  [[nodiscard]] double least_scale(const Point3& position) const;
  /// Returns the map that applies in all of `box`, or nullopt if there are several. If there is
  /// only one, distances within the box are symmetric and obey the triangle inequality, and the map
  /// makes them Euclidean. With a frame, the result may be nullopt for a uniform box near the
  /// border of a region.
  [[nodiscard]] std::optional<LinearMap> uniform_in(const Box3& box) const;
  [[nodiscard]] const std::vector<Region>& regions() const { return regions_; }

 private:
  [[nodiscard]] Point3 to_frame(const Point3& position) const;
  [[nodiscard]] const Region* find(const Point3& position) const;
  std::vector<Region> regions_;
  std::optional<Frame> frame_;
};

/// A distance function supplied by the caller. Distances must be finite, not negative, and 0 from a
/// point to itself.
struct CustomMetric {
  std::function<double(const Point3& facility, const Point3& client)> distance;
  bool symmetric = false;            ///< distance(a, b) == distance(b, a) always
  bool triangle_inequality = false;  ///< distance(a, c) <= distance(a, b) + distance(b, c) always
};

using Metric =
    std::variant<Euclidean, SquaredEuclidean, Minkowski, Elliptical, EllipticalField, CustomMetric>;

/// Returns whether distance(a, b) always equals distance(b, a).
[[nodiscard]] bool is_symmetric(const Metric& metric);
/// Returns whether distance(a, c) never exceeds distance(a, b) + distance(b, c).
[[nodiscard]] bool obeys_triangle_inequality(const Metric& metric);
/// Returns the map that makes all distances between points of `box` Euclidean, or nullopt if there
/// is none.
[[nodiscard]] std::optional<LinearMap> linear_map(const Metric& metric, const Box3& box);
/// Returns the points, mapped by the linear_map() of their bounding box, or nullopt if the box has
/// none.
[[nodiscard]] std::optional<std::vector<Point3>> linear_points(const Metric& metric,
                                                               std::span<const Point3> points);

/// Returns the name for messages and files: "euclidean", "squared", "minkowski:P", "elliptical",
/// "elliptical field" or "custom".
[[nodiscard]] std::string name_of(const Metric& metric);

/// Throws: std::invalid_argument for a Minkowski p that is not positive, and for a missing
/// function.
void check(const Metric& metric);

/// Returns the distance from a facility to a client.
[[nodiscard]] double distance(const Metric& metric, const Point3& facility, const Point3& client);

/// Returns the length of the longest diagonal of a box in the metric, or in the Euclidean metric
/// for a field; 0 for an empty box. Facility costs are multiples of it.
[[nodiscard]] double diagonal(const Metric& metric, const Box3& box);

/// Attributes of points (colour, intensity, curvature) that become further axes of the distance.
/// The weight of a channel is the number of ground units that one unit of the attribute is worth.
/// Euclidean and elliptical distances add the squares of channels under the root, the other metrics
/// add squares or p-th powers to their sum. Symmetry and the triangle inequality are preserved.
struct Channels {
  std::span<const double> values;   ///< points x weights.size(), row by row; finite
  std::span<const double> weights;  ///< one per channel; finite and not negative
  [[nodiscard]] std::size_t size() const { return weights.size(); }
};

}  // namespace terrace::cluster
