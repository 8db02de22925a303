// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/point_tin.hpp>

#include "mesh/bounded/point_mesh_samples.hpp"

namespace terrace::terrain {

/// A height along a line.
struct ProfilePlace {
  double at = 0.0, height = 0.0;
  bool sample = false;  ///< lies there
};

/// The Delaunay triangulation of some samples as a surface.
class LocalSurface {
 public:
  /// duplicates: which of several samples at one place counts.
  LocalSurface(const MeshSamples& samples, tri::PointDuplicates duplicates);

  /// Nothing outside the samples' hull.
  [[nodiscard]] std::optional<double> height(const Point2& place) const;
  /// Where edges cross the line of `axis` = c (0: x, 1: y), ascending: between two such places the
  /// surface is straight.
  [[nodiscard]] std::vector<ProfilePlace> profile(unsigned axis, double c) const;

 private:
  tri::Delaunay2<double> delaunay_;
  std::vector<double> heights_;  ///< by slots of vertices
};

}  // namespace terrace::terrain
