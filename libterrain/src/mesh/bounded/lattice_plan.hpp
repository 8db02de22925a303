// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <terrace/stream/store.hpp>

#include "surface/store_window.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The samples of a raster store that a region needs: those inside and the next ones outside, so
/// that every triangle of neighbouring samples that reaches inside has its corners. Without a
/// region all. Of no size where the region misses the raster.
LatticeWindow lattice_of(const stream::Store& store, const std::optional<Region>& region);

/// A rectangle of samples cut into windows that share their sides: the last column of one is the
/// first of the next.
class LatticePlan {
 public:
  /// whole: at least 1 sample each way. cells: how many cells a window should have each way;
  /// windows are equal to within one cell and have at most 1.5 times as many.
  LatticePlan(const LatticeWindow& whole, std::int64_t cells);

  [[nodiscard]] const LatticeWindow& whole() const { return whole_; }
  [[nodiscard]] std::size_t across() const { return columns_.size() - 1; }
  [[nodiscard]] std::size_t down() const { return rows_.size() - 1; }
  [[nodiscard]] std::size_t size() const { return across() * down(); }
  /// Window i, counted along rows from the first row on.
  [[nodiscard]] LatticeWindow window(std::size_t i) const;

 private:
  LatticeWindow whole_;
  std::vector<std::int64_t> columns_, rows_;  ///< of the sides
};

}  // namespace terrace::terrain
