// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/tri/shape.hpp>

#include "mesh/scene.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/metric_choice.hpp"

namespace terrace::tools {

using namespace terrain;

enum class SurfaceMethod : std::uint8_t { kShape, kAdvancingFront, kAlphaWrap };

struct SurfaceCriterion {
  SurfaceMethod method = SurfaceMethod::kShape;
  tri::RestoreOptions restore;  ///< of kShape
  double alpha = 0.0;           ///< of kAlphaWrap, metres, see alpha_wrap_surface()
};

/// What --criterion says: edge, edge:FACTOR, gabriel, advancing-front, alpha-wrap or
/// alpha-wrap:ALPHA (metres). Throws: UsageError.
SurfaceCriterion parse_criterion(const std::string& text);

/// The one elliptical metric of a surface, between positions in metres; none where it is Euclidean.
/// Throws: UsageError for another kind of metric, one with boxes, or with a method of CGAL's.
std::optional<tri::EllipticalMetric3> surface_metric(const MetricChoice& metric,
                                                     const SurfaceCriterion& criterion);

/// A surface, or the tetrahedra inside it. Positions are in the store's CRS.
struct SurfaceOutcome {
  TriangleMesh mesh;
  std::vector<std::array<std::uint32_t, 4>> tetrahedra;  ///< where asked for, in place of triangles
  tri::SurfaceMeasures measures;                         ///< of the surface, in metres
};

/// The surface of the points that `detail` wants, restored in metres on the ground: of points in
/// degrees about the middle of their box. Throws: UsageError where the method has no tetrahedra,
/// stream::Error on a damaged store, and where the points do not fit into memory_bytes, saying what
/// they need.
SurfaceOutcome surface_of_store(const stream::Store& store, const Detail& detail,
                                const SurfaceCriterion& criterion, bool tetrahedra,
                                std::uint64_t memory_bytes);

}  // namespace terrace::tools
