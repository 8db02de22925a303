// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include <terrace/stream/store.hpp>

#include "surface/filled_grid.hpp"

namespace terrace::terrain {

/// Heights everywhere around the points of a store, from a grid of their means: for where no
/// surface through them reaches. It depends on the store alone.
class PointFill {
 public:
  /// Reads the finest level that is not too large. Memory: at most 20 MiB, 4 MiB of them to stay.
  /// Throws: stream::Error on a damaged store, or if no point has a height.
  explicit PointFill(const stream::Store& store);

  /// The stored height at stored x, y; far outside that of the border.
  [[nodiscard]] double height(double x, double y) const;

 private:
  std::array<double, 2> from_{}, cells_per_unit_{};
  std::optional<FilledGrid> grid_;
};

}  // namespace terrace::terrain
