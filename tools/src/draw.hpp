// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "canvas.hpp"

namespace terrace::tools {

struct DrawOptions {
  bool wire = false;  ///< draws the edges over the faces, which are then lit flat
  unsigned threads = 1;
};

/// Draws the triangles of `mesh` (positions in metres on the ground) in the vertices' colours.
/// Hidden surfaces are hidden by depth; edges are anti-aliased, and fade where triangles are only a
/// few pixels large. O(triangles + samples).
void draw_triangles(const TriangleMesh& mesh, const std::vector<Rgb>& colours, const Camera& camera,
                    const Light& light, const DrawOptions& options, Canvas& canvas);

/// Draws a cloud of points as discs just large enough to close the gaps at the cloud's density. Lit
/// by the points' own normals, else by normals estimated from the depths around.
void draw_points(const TriangleMesh& cloud, const std::vector<Rgb>& colours, const Camera& camera,
                 const Light& light, const DrawOptions& options, Canvas& canvas);

/// The smallest whole view of all positions: sets scale and centre for the size of `canvas`, with a
/// margin of 2 %.
void fit(Camera& camera, const std::vector<stream::Point3>& positions, const Canvas& canvas);

}  // namespace terrace::tools
