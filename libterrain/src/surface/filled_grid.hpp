// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrace::terrain {

/// A grid of means with gaps that are filled from those around: a smooth surface made by averaging
/// upward and filling downward over halved grids (S. J. Gortler et al., The Lumigraph, 1996,
/// doi:10.1145/237170.237200, "pull-push").
class FilledGrid {
 public:
  /// sum, weight: by rows, columns * rows of each; a cell without weight is a gap. Requires a cell
  /// that is none.
  FilledGrid(std::size_t columns, std::size_t rows, std::vector<double> sum,
             std::vector<double> weight);

  /// Bilinear between the centres of cells; x, y in cells, the first cell's centre at 0.5. Outside
  /// the grid the height at its border.
  [[nodiscard]] double height(double x, double y) const;

  /// A number of what height() depends on for places from `first` to `last`, both included: of two
  /// grids of equal size with the same number it gives the same there.
  [[nodiscard]] std::uint64_t digest(const std::array<double, 2>& first,
                                     const std::array<double, 2>& last) const;

 private:
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<float> heights_;
};

}  // namespace terrace::terrain
