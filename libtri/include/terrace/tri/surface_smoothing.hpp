// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/tri/shape.hpp"

/// Removes the noise of a scan from a surface in space. smoothing.hpp does it for heights.

namespace terrace::tri {

enum class SurfaceSmoothing : std::uint8_t {
  /// Moves every vertex half-way to the mean of its neighbours, then a little farther away from it
  /// (G. Taubin, "A signal processing approach to fair surface design",
  /// doi:10.1145/218380.218473). Removes roughness, rounds edges and preserves the volume: wide
  /// features, below an eigenvalue of 0.05 of the Laplacian, grow by at most 0.02 % per iteration.
  /// Neighbours have equal weights. They also even out the triangles, and are less sensitive to
  /// thin triangles than cotangents of the angles.
  taubin,
  /// Replaces the normal of every triangle by a mean of those around it that have similar normals,
  /// then moves the vertices so that the triangles get these normals (Y. Zheng, H. Fu, O. Au,
  /// C. Tai, "Bilateral normal filtering for mesh denoising", doi:10.1109/TVCG.2010.264, the local
  /// scheme). Preserves edges and corners.
  bilateral,
};

struct SurfaceSmoothingOptions {
  SurfaceSmoothing method = SurfaceSmoothing::taubin;
  /// taubin: pairs of steps. bilateral: passes over the normals; the vertices then move in 20
  /// steps.
  unsigned iterations = 10;
  /// No vertex moves farther than this, in the unit of the points. Default: the spacing, which is
  /// the median length of the triangles' sides. 0 moves nothing; infinity moves without a limit.
  std::optional<double> limit{};
  /// 0: one per core. The result does not depend on it.
  unsigned threads = 1;
  base::StopCheck check_stop = {};
};

/// How far vertices moved, in the unit of the points.
struct SurfaceMoves {
  double limit = 0.0;  ///< as given, or the default
  double mean = 0.0;   ///< over all points of the surface
  double largest = 0.0;
  std::size_t limited = 0;  ///< number of vertices that the limit holds back at the end
};

struct SmoothedPoints {
  std::vector<Point3> points;  ///< in place of Surface::points; the faces stay valid
  SurfaceMoves moves;
};

/// Returns new positions of a surface's points.
///
/// Points on an edge with one face (the border of an open surface) stay, and so do points without a
/// face. Edges with more than two faces, coincident points and faces without area are allowed. A
/// face with two equal corners counts as absent. Each step reads only the positions before it and
/// visits neighbours in the order of the faces, so the result follows a renumbering of the points.
///
/// The limit holds exactly for the distance computed in doubles between a point and its new
/// position. A vertex that would move farther stops at the limit in each step, so its neighbours
/// adapt to it.
///
/// Throws std::invalid_argument naming a point that is not finite or a face with a corner that is
/// not the index of a point, and for a limit that is negative or NaN. Time O(faces * iterations): 3
/// (taubin) and 18 (bilateral) seconds per million points and 10 iterations on one core. Memory:
/// 200 (taubin) and 600 (bilateral) bytes per point.
[[nodiscard]] SmoothedPoints smooth(const Surface& surface,
                                    const SurfaceSmoothingOptions& options = {});

}  // namespace terrace::tri
