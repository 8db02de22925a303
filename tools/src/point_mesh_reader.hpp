// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/tri/point_tin.hpp>

#include "point_mesh_plan.hpp"
#include "region.hpp"
#include "store_window.hpp"
#include "world.hpp"

namespace terrace::tools {

/// Samples in the CRS's coordinates.
struct MeshSamples {
  std::vector<double> x, y, z;

  [[nodiscard]] std::size_t size() const { return x.size(); }
  void add(const stream::Point3& p) {
    x.push_back(p[0]);
    y.push_back(p[1]);
    z.push_back(p[2]);
  }
};

/// Reads the samples of a region out of a store, box by box, always in the order of the store: of
/// its levels from the top down, in each by id. One object per thread.
class PointMeshReader {
 public:
  PointMeshReader(const stream::Store& store, const std::optional<Region>& region);

  /// Replaces `out` by the samples in the box. Throws: stream::Error on a damaged store.
  void read(const PlaneBox& box, MeshSamples& out);

 private:
  const std::optional<Region>& region_;
  Placement placement_;
  stream::Box3 bounds_;  ///< in the CRS
  StoreWindow window_;
};

/// The height that stands for several samples at one place, as tri::point_tin() takes it. With
/// kError that of the first. heights: in order, not empty.
double merged_height(std::span<const double> heights, tri::PointDuplicates duplicates);

}  // namespace terrace::tools
