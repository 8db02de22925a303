// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/tri/shape.hpp"

/// A tree over the vertices of a surface from which surfaces of any detail, also of detail that
/// varies, are extracted without tearing (D. Luebke, C. Erikson, "View-dependent simplification of
/// arbitrary polygonal environments", SIGGRAPH 1997).
///
/// A *cut* is a set of vertices, called active, with the parent of each. The surface of a cut has
/// the triangles of the full surface whose corners have three different nearest active ancestors,
/// with these as corners.

namespace terrace::tri {

/// A tree of clusters over the vertices of a surface. Each vertex is in one leaf, a cluster of
/// level 0, and in those above it.
struct VertexClusters {
  /// No cluster, or no vertex.
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct Cluster {
    std::uint32_t parent = kNone;  ///< kNone for the root
    /// The vertex of the cluster that is also one of its parent's; kNone if it is not on the
    /// surface.
    std::uint32_t representative = kNone;
    std::uint8_t level = 0;  ///< one less than the parent's
  };
  std::vector<Cluster> clusters;
  std::vector<std::uint32_t> leaf;  ///< of each vertex
};

/// The values of each vertex of a surface.
struct VertexTree {
  /// The vertex onto which it moves; VertexClusters::kNone for those that are in every cut.
  std::vector<std::uint32_t> parents;
  /// The error of the surface without the vertex, in the unit of the coordinates: the largest
  /// distance of SimplifiedSurface::max_distance up to its collapse. Never smaller than that of its
  /// descendants. Infinite for vertices without a parent.
  std::vector<double> errors;
  /// The level of the cluster from which the collapse removed it; of the root for vertices without
  /// a parent. The vertex is active if that cluster is expanded.
  std::vector<std::uint8_t> levels;
};

/// Builds the tree by the edge collapses of simplify_surface(), restricted so that a cluster that
/// is not expanded needs no data: a vertex moves only onto a vertex of the same cluster, never a
/// representative while it is in the cluster that it represents. A cluster is finished when no
/// vertex of it has an allowed collapse and all clusters below it are finished. What then remains
/// of it, the representative and vertices that no collapse may remove without changing the
/// topology or turning a triangle over, takes part among the vertices of its parent.
///
/// So the parent of a vertex is active in every cut that is a set of expanded clusters (with each
/// the one above), and the vertices with an error above any bound are those after a sequence of
/// collapses: that surface has the topology of the full one and, where that is a manifold, is one.
/// Surfaces of other cuts are closed where the full one is: their edges, with their triangles
/// counted modulo 2, are.
///
/// The result does not depend on the machine. O(n log n). Memory: about 400 bytes per vertex.
/// Throws: std::invalid_argument for clusters that are not as described and as simplify_surface()
/// does; the exceptions of check_stop.
[[nodiscard]] VertexTree vertex_tree(const Surface& surface, const VertexClusters& clusters,
                                     const base::StopCheck& check_stop = {});

/// The cut of least error with at most this many vertices of the full surface's, or the smallest.
/// Returns the bound for cut_by_error().
[[nodiscard]] double error_of_points(const VertexTree& tree, std::size_t max_points);
/// The vertices whose error is above a bound: a surface within the bound of the full one, in the
/// sense of SimplifiedSurface::max_distance.
[[nodiscard]] std::vector<bool> cut_by_error(const VertexTree& tree, double max_error);
/// The vertices of all clusters of a level and above.
[[nodiscard]] std::vector<bool> cut_by_level(const VertexTree& tree, unsigned level);

struct SurfaceOfCut {
  Surface surface;
  std::vector<std::uint32_t> input;  ///< the index in the full surface of each vertex, ascending
};

/// Extracts the surface of a cut. Active vertices without a triangle are left out. O(n). Throws:
/// std::invalid_argument if a vertex has no active ancestor, or a size does not match.
[[nodiscard]] SurfaceOfCut surface_of_cut(const Surface& surface,
                                          const std::vector<std::uint32_t>& parents,
                                          const std::vector<bool>& active);

}  // namespace terrace::tri
