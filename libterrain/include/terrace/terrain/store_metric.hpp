// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/stream/store.hpp>
#include <terrace/tri/metric.hpp>

#include "terrace/terrain/metric_choice.hpp"

/// Metrics for triangulations of a store's points in stored coordinates.

namespace terrace::terrain {

/// Returns the map from differences of stored coordinates to metres on the ground (east, north,
/// up), about the middle of the store's bounds. It is the metric of tetrahedra, whose edges combine
/// x, y and height:
///
///   using Tetrahedra = tri::Delaunay3<double, tri::EllipticalMetric3>;
///   StoreSource source(store);
///   tri::MultiresolutionModel<Tetrahedra> model(source, {}, {}, Tetrahedra(ground_map(store)));
///
/// Throws: stream::Error that names a stored point beyond a pole.
[[nodiscard]] tri::LinearMap3 ground_map(const stream::Store& store);

/// Returns the metric of triangles over x and y (of a raster: columns and rows) for a choice that
/// is euclidean or elliptical. Ellipses are in metres on the ground, about the middle of their box:
///
///   tri::MultiresolutionModel<tri::RegionalDelaunay2<double>> model(source, {}, {},
///                                                                   metric_field(choice, store));
///
/// Throws: UsageError for another metric, and for boxes on a rotated raster.
[[nodiscard]] tri::MetricField2 metric_field(const MetricChoice& metric,
                                             const stream::Store& store);

}  // namespace terrace::terrain
