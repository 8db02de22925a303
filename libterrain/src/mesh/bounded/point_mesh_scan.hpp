// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <terrace/stream/store.hpp>

#include "mesh/bounded/point_mesh_samples.hpp"
#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {

/// What one pass over the samples of a region tells.
struct PointMeshScan {
  std::uint64_t samples = 0;
  std::optional<MeshSamples> whole;  ///< all, where they are few
  // Else:
  std::vector<Point2> some;  ///< every `period`-th place
  std::uint64_t period = 1;
  std::vector<Point2> hull;  ///< as convex_hull() of all
};

/// Reads all samples once, in the order of the store. few: how many at most are kept. Memory: of
/// `few` samples, of up to a million places, and of the hull.
/// Throws: stream::Error on a damaged store.
PointMeshScan scan_point_mesh(const stream::Store& store, const Detail& detail, std::size_t few);

}  // namespace terrace::terrain
