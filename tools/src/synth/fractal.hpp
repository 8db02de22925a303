// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrace::tools {

struct FractalOptions {
  std::uint64_t seed = 1;
  double hurst = 0.8;       ///< 0 < H < 1; amplitude spectrum k^-(H+1)
  double roughness = 2.65;  ///< RMS difference of neighbouring cells, in units of height
  bool rounded = false;     ///< heights will be rounded to whole units: its share is left out
};

/// A fractal height field on the infinite plane of cells: every cell's height is a function of the
/// options and its column and row alone, so any piece can be made on its own, and a smaller DEM is
/// the corner of a larger one. The same bits on every machine.
///
/// White noise on lattices of 1, 2, 4, ... 4096 cells' spacing, each interpolated by cubic
/// B-splines and weighed by spacing^H, is summed: power spectrum k^-(2H+2) down to wavelengths of
/// about 8192 cells, beyond which the field is flat on average. The interpolation is done by
/// subdivision (a row of spacing 2s becomes a row of spacing s, then the noise of spacing s is
/// added), which costs a third more than one lattice alone. Source: the sum of octaves of A.
/// Fournier, D. Fussell, L. Carpenter, Computer Rendering of Stochastic Models (1982),
/// doi:10.1145/358523.358553; the subdivision of J. Lane, R. Riesenfeld (1980),
/// doi:10.1109/TPAMI.1980.4766968.
///
/// The RMS step is that of the infinite plane, calculated and not measured: a piece of 1024 x 1024
/// cells has it within about 2 %, larger ones closer.
class Fractal {
 public:
  static constexpr unsigned kOctaves = 13;  ///< spacings 1 to 4096

  /// Requires 0 < hurst < 1 and roughness >= 0.
  explicit Fractal(const FractalOptions& options);

  /// Multiplies all heights.
  void scale(double factor);
  /// RMS step over the whole plane, before any rounding.
  [[nodiscard]] double roughness() const { return roughness_; }
  /// Standard deviation of the heights over the whole plane.
  [[nodiscard]] double deviation() const { return deviation_; }
  /// No height is farther than this from 0.
  [[nodiscard]] double bound() const { return bound_; }

  /// Rows of a vertical strip of the plane, one after the other.
  class Rows {
   public:
    /// Columns first_column ... first_column + width - 1. The fractal must outlive the rows.
    Rows(const Fractal& fractal, std::uint32_t first_column, std::uint32_t width);
    /// The heights of `row`, about 0; valid until the next call. Rows in ascending order without
    /// gaps cost least. O(width).
    std::span<const float> row(std::uint32_t row);

   private:
    struct Lattice {
      std::int64_t first = 0;  ///< lattice column of values[..][0]
      std::size_t width = 0;
      std::array<std::int64_t, 4> row_of{};  ///< which row each of the four buffers holds
      std::array<std::vector<float>, 4> values;
      std::vector<float> blend;  ///< the coarser rows combined, before columns are doubled
    };

    const float* lattice_row(unsigned octave, std::int64_t row);

    const Fractal* fractal_;
    std::array<Lattice, kOctaves> lattices_;
  };

 private:
  std::uint64_t seed_;
  std::array<float, kOctaves> amplitude_{};  ///< largest value of each lattice's noise
  double roughness_ = 0.0;
  double deviation_ = 0.0;
  double bound_ = 0.0;
};

}  // namespace terrace::tools
