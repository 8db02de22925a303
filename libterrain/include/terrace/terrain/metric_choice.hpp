// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <terrace/cluster/metric.hpp>
#include <terrace/stream/point.hpp>

namespace terrace::terrain {

/// The metric for clustering points. Semi-axes are in ground units (metres), boxes in the
/// coordinates of the CRS.
struct MetricChoice {
  struct Region {
    std::optional<stream::Box3> box;  ///< nullopt: everywhere
    cluster::Elliptical metric;
  };
  enum class Kind : unsigned char { euclidean, squared, minkowski, elliptical };

  std::string text = "euclidean";  ///< as the user wrote it
  Kind kind = Kind::euclidean;
  double p = 2.0;               ///< exponent of minkowski
  std::vector<Region> regions;  ///< regions of elliptical; the first that contains a point applies

  /// Parses euclidean, squared, minkowski:P (P at least 0, or inf) or elliptical:FILE. The file is
  /// JSON:
  ///   {"regions": [{"box": [minx, miny, maxx, maxy], "semi_axes": [a, b], "angle": DEGREES},
  ///                {"box": [minx, miny, minz, maxx, maxy, maxz], "semi_axes": [a, b, c],
  ///                 "rotation": [[x, y, z], [x, y, z], [x, y, z]]}]}
  /// angle: direction of the first semi-axis, counter-clockwise from +x. rotation: the directions
  /// of the three semi-axes. A region without a box is everywhere; outside all regions the metric
  /// is Euclidean. Throws: UsageError for another name; stream::Error for an invalid file, naming
  /// region and member.
  static MetricChoice parse(const std::string& text);

  /// Returns the metric as one line without file names, for the record in a store.
  [[nodiscard]] std::string canonical() const;
  /// Returns the metric that canonical() recorded. Throws: UsageError for any other text.
  static MetricChoice recorded(const std::string& text);
  /// Whether the metric depends on the place, because regions have boxes.
  [[nodiscard]] bool has_boxes() const;

  /// Returns the metric between points ground = map * (position - origin), with positions in the
  /// CRS. A region contains a point if its box contains the position. map: invertible, except that
  /// the weight of heights may be 0; it does not mix heights with x and y.
  [[nodiscard]] cluster::Metric on_ground(const stream::Point3& origin,
                                          const cluster::LinearMap& map) const;
};

}  // namespace terrace::terrain
