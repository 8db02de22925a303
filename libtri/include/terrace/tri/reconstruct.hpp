// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "terrace/tri/metric3.hpp"
#include "terrace/tri/shape.hpp"
#include "terrace/tri/surface.hpp"

/// A surface from points, in one call.

namespace terrace::tri {

enum class SurfaceMethod : std::uint8_t {
  /// Shape3: tetrahedra peeled off from the hull. Closed; touches itself here and there; fast.
  kShape,
  /// CGAL's advancing front (D. Cohen-Steiner, F. Da, doi:10.1007/s00371-003-0217-z): smooth where
  /// samples are dense, manifold, open where there are none. Leaves out points. CGAL 5.5 breaks
  /// ties
  /// of equal radii by addresses in memory, so single faces can differ from run to run.
  kAdvancingFront,
  /// CGAL's alpha wrap (C. Portaneri et al., doi:10.1145/3528223.3530152): watertight, manifold,
  /// free of intersections, and strictly around all points at the distance of the offset. Its
  /// corners are new points.
  kAlphaWrap,
};

struct SurfaceOptions {
  SurfaceMethod method = SurfaceMethod::kShape;
  ShapeOptions shape;  ///< of kShape
  /// Of kShape: 0 triangulates the points as they are. 1 to 30: rounded to integers of so many bits
  /// over the longest side of their box, faster; 24 is finer than a float. Of points that become
  /// one the first stands for all. The surface has the given coordinates in any case.
  unsigned quantise_bits = 0;
  /// Of kShape: an elliptical metric in which the points are triangulated and the facets judged,
  /// see EllipticalShape3. Not together with quantise_bits.
  std::optional<LinearMap3> metric;
  /// Of kAdvancingFront, see CGAL: the larger, the rather a triangle is taken in spite of the
  /// radius of its sphere; and how much the surface may bend at an edge, in radians.
  double radius_ratio_bound = 5.0;
  double beta = 0.52;
  /// Of kAlphaWrap, in the points' unit: openings up to about this radius are closed, and the
  /// distance from the points. 0: alpha is the larger of d / 20 and 4 d / sqrt(n), d the diagonal
  /// of the points' box, and the offset alpha / 30. Larger openings let the wrap inside.
  double alpha = 0.0;
  double offset = 0.0;
};

struct ReconstructedSurface {
  Surface surface;
  /// The number of the input point that each point of the surface is. Empty with kAlphaWrap.
  std::vector<std::size_t> input;
};

/// Throws std::invalid_argument naming the index of a point that is not finite, or an option that
/// is not in its range (a metric with another method or with rounding among them). CGAL's two
/// methods construct points in doubles: they refuse coordinates beyond 1e100 in size and, unless
/// all are equal, boxes whose sides are all below 1e-100.
///
/// kShape and kAdvancingFront give no faces where all points (after any rounding) are in one plane;
/// kAlphaWrap gives none without points or where all are equal and alpha is 0. Duplicates do not
/// matter. But for the ties of the advancing front, the result depends on the points, their order
/// and the options alone. Components of the advancing front are turned so that their volume is
/// positive.
///
/// Cost: kShape a triangulation and a flood, 0.1 to 0.3 s per 100,000 points; the others several
/// seconds, see the benchmark.
ReconstructedSurface reconstruct_surface(std::span<const Point3> points,
                                         const SurfaceOptions& options = {});

}  // namespace terrace::tri
