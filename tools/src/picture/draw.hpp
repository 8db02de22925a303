// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "picture/canvas.hpp"
#include "picture/color.hpp"
#include "terrace/terrain/detail_lines.hpp"

namespace terrace::cluster {
struct Dendrogram;
}

namespace terrace::tools {

struct MatchingPicture;

struct DrawOptions {
  bool wire = false;  ///< draws edges over faces with flat lighting
  unsigned threads = 1;
};

/// Draws the triangles of `mesh` (positions in metres on the ground) in the colours of their
/// vertices, with a depth buffer. Edges are anti-aliased and fade where triangles are only a few
/// pixels large. O(triangles + samples).
void draw_triangles(const terrain::TriangleMesh& mesh, const std::vector<Rgb>& colours,
                    const Camera& camera, const Light& light, const DrawOptions& options,
                    Canvas& canvas);

/// Draws a point cloud as discs just large enough to close the gaps at the cloud's density, or at
/// each part's density if some parts are coarser. Lighting uses the points' normals if they have
/// any, otherwise normals estimated from the surrounding depths.
void draw_points(const terrain::TriangleMesh& cloud, const std::vector<Rgb>& colours,
                 const Camera& camera, const Light& light, const DrawOptions& options,
                 Canvas& canvas);

/// Marks positions (metres on the ground) with small dark discs on top of the picture, unless
/// something is in front of them.
void draw_marks(const std::vector<stream::Point3>& positions, const Camera& camera,
                const DrawOptions& options, Canvas& canvas);

/// Draws a dendrogram with the leaves at the bottom and a linear height axis. Each subtree below
/// 0.7 of the top gets its own colour. O(points + samples drawn).
void draw_dendrogram(const cluster::Dendrogram& tree, Canvas& canvas);

/// Draws a matching on white: points as dots, points without a line as rings, and lines from red
/// (level 1) to black (level `top`), lower levels on top. In a crowded picture higher levels are on
/// top and there are no dots. Line widths depend on the usual length of a pair. O(points + lines
/// log(lines) + samples drawn).
void draw_matching(const MatchingPicture& picture, const Camera& camera, const DrawOptions& options,
                   Canvas& canvas);

/// Draws lines, which are runs of `positions` (metres on the ground), on white. Each piece has the
/// colour of its first vertex, or is dark without colours. O(vertices + samples drawn).
void draw_lines(const std::vector<stream::Point3>& positions,
                const std::vector<terrain::LineSet::Line>& lines, const std::vector<Rgb>& colours,
                const Camera& camera, const DrawOptions& options, Canvas& canvas);

/// Sets scale and centre so that all positions just fit onto `canvas`, with a margin of 2 %.
void fit(Camera& camera, const std::vector<stream::Point3>& positions, const Canvas& canvas);

/// After fit(), for draw_points(): reduces the scale so that large discs, which few points have,
/// stay within the picture.
void fit_discs(Camera& camera, const std::vector<stream::Point3>& positions, const Canvas& canvas);

}  // namespace terrace::tools
