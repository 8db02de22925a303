// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "mesh.hpp"
#include "pool.hpp"
#include "terrace/tri/point_tin.hpp"

/// The steps before refinement: samples are checked and sorted, and the first mesh is made.

namespace terrace::tri::tin::points {

struct SampleList {
  /// In the order of a curve, so that consecutive samples are close to each other. Every position
  /// occurs once, or with kAll twice if heights differ.
  Pool<Sample> all;
  std::size_t duplicates = 0;
  double duplicate_range = 0;  ///< the largest difference between heights at one position
};

/// Checks, sorts and merges; throws as point_tin() does.
SampleList take_samples(std::span<const double> x, std::span<const double> y,
                        std::span<const double> z, PointDuplicates duplicates);

/// Makes the first mesh of the frame's vertices alone. Throws as point_tin() does if the frame is
/// not a convex polygon.
PointMesh start_with_frame(std::span<const Point3> frame);

/// Makes the first mesh of the corners of the samples' hull. Empty if all samples are collinear.
PointMesh start_with_hull(Pool<Sample>& samples);

}  // namespace terrace::tri::tin::points
