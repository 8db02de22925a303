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
  bool wire = false;  ///< draws the edges over the faces, which are then lit flat
  unsigned threads = 1;
};

/// Draws the triangles of `mesh` (positions in metres on the ground) in the vertices' colours.
/// Hidden surfaces are hidden by depth; edges are anti-aliased, and fade where triangles are only a
/// few pixels large. O(triangles + samples).
void draw_triangles(const TriangleMesh& mesh, const std::vector<Rgb>& colours, const Camera& camera,
                    const Light& light, const DrawOptions& options, Canvas& canvas);

/// Draws a cloud of points as discs just large enough to close the gaps at the cloud's density, or,
/// where some parts are coarser than others, at each part's. Lit by the points' own normals, else
/// by normals estimated from the depths around.
void draw_points(const TriangleMesh& cloud, const std::vector<Rgb>& colours, const Camera& camera,
                 const Light& light, const DrawOptions& options, Canvas& canvas);

/// Marks positions (metres on the ground) with small dark discs over what has been drawn, unless
/// something lies in front of them.
void draw_marks(const std::vector<stream::Point3>& positions, const Camera& camera,
                const DrawOptions& options, Canvas& canvas);

/// Draws a dendrogram, leaves at the bottom, heights linear; subtrees below 0.7 of the top in
/// colours of their own. O(points + samples drawn).
void draw_dendrogram(const cluster::Dendrogram& tree, Canvas& canvas);

/// Draws a matching on white paper: its points as dots, those that no line reaches as rings, and
/// its lines from red, level 1, to black, level `top`, the lower ones over the higher. In a crowd
/// the higher ones are over the lower, and there are no dots. Widths follow from the usual length
/// of a pair. O(points + lines log(lines) + samples drawn).
void draw_matching(const MatchingPicture& picture, const Camera& camera, const DrawOptions& options,
                   Canvas& canvas);

/// Draws lines, runs of `positions` (metres on the ground), on white paper, each piece in the
/// colour of its first vertex; without colours dark. O(vertices + samples drawn).
void draw_lines(const std::vector<stream::Point3>& positions,
                const std::vector<LineSet::Line>& lines, const std::vector<Rgb>& colours,
                const Camera& camera, const DrawOptions& options, Canvas& canvas);

/// The smallest whole view of all positions: sets scale and centre for the size of `canvas`, with a
/// margin of 2 %.
void fit(Camera& camera, const std::vector<stream::Point3>& positions, const Canvas& canvas);

/// After fit(), for draw_points(): as much smaller as keeps the discs of few points in the picture.
void fit_discs(Camera& camera, const std::vector<stream::Point3>& positions, const Canvas& canvas);

}  // namespace terrace::tools
