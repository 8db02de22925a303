// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <terrace/cluster/metric.hpp>
#include <terrace/stream/point.hpp>

namespace terrace::terrain {

/// The metric that points are clustered by. Semi-axes are in ground units (metres), boxes in the
/// coordinates of the CRS.
struct MetricChoice {
  struct Region {
    std::optional<stream::Box3> box;  ///< none: everywhere
    cluster::Elliptical metric;
  };
  enum class Kind : unsigned char { euclidean, squared, minkowski, elliptical };

  std::string text = "euclidean";  ///< as it was given
  Kind kind = Kind::euclidean;
  double p = 2.0;               ///< of minkowski
  std::vector<Region> regions;  ///< of elliptical; the first that holds a point counts

  /// euclidean, squared, minkowski:P (P from 0 up, or inf) or elliptical:FILE. The file is JSON:
  ///   {"regions": [{"box": [minx, miny, maxx, maxy], "semi_axes": [a, b], "angle": DEGREES},
  ///                {"box": [minx, miny, minz, maxx, maxy, maxz], "semi_axes": [a, b, c],
  ///                 "rotation": [[x, y, z], [x, y, z], [x, y, z]]}]}
  /// angle: of the first semi-axis, counter-clockwise from +x; rotation: the directions of the
  /// three semi-axes. Without a box the region is everywhere; outside all regions the metric is
  /// Euclidean. Throws: UsageError for another name, stream::Error for a bad file, naming region
  /// and member.
  static MetricChoice parse(const std::string& text);

  /// Without names of files: what the regions are, as JSON in one line. For records.
  [[nodiscard]] std::string canonical() const;
  /// True where boxes make the metric depend on the place.
  [[nodiscard]] bool has_boxes() const;

  /// The metric between points ground = map * (position - origin), where positions are in the CRS:
  /// a region holds a point if its box holds the position. map: invertible, but that heights may
  /// count for nothing; x and y are not mixed with them.
  [[nodiscard]] cluster::Metric on_ground(const stream::Point3& origin,
                                          const cluster::LinearMap& map) const;
};

}  // namespace terrace::terrain
