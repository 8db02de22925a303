// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>

#include "front.hpp"
#include "terrace/tri/thinned_delaunay2.hpp"
#include "terrace/tri/view.hpp"

namespace terrace::tri {

/// The errors of the windows of a thinned raster, as far as its clusters are known.
///
/// A window can be thinned only once all clusters that meet it are expanded. Therefore the clusters
/// are measured by their windows: aligned() extends a cluster's box to whole windows and raises its
/// error to the greatest one that the clusters of level 0 have in any of them. Then a cluster of a
/// window is wanted whenever another one in it is.
class ViewWindows final : public ClusterAlignment {
 public:
  explicit ViewWindows(const RasterFrame& frame) : frame_(frame) {}

  /// Adds a cluster of level 0, whose error is the range of its heights. Returns true if that
  /// changes what aligned() returns for others in the same windows.
  bool add(const ClusterRecord& record) override;
  /// The record by which to measure a cluster.
  [[nodiscard]] ClusterRecord aligned(const ClusterRecord& record, unsigned level) const override;
  /// True if the box of a cluster meets the window, sides included.
  [[nodiscard]] bool meets(const Box3& ground, const ThinnedDelaunay2::Window& window) const;
  /// The box of a window on the ground.
  [[nodiscard]] Box3 box_of(const ThinnedDelaunay2::Window& window) const;
  [[nodiscard]] std::size_t memory() const { return known_.size() * 64; }

 private:
  struct Known {
    double error = 0.0;
    double low, high;  ///< of the heights on the ground
  };
  struct Range {
    std::int64_t first[2], last[2];
  };
  /// The windows that a box meets.
  [[nodiscard]] Range range_of(const Box3& ground) const;

  RasterFrame frame_;
  std::unordered_map<std::uint64_t, Known> known_;
};

}  // namespace terrace::tri
