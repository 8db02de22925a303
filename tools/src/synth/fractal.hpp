// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrace::tools {

struct FractalOptions {
  std::uint64_t seed = 1;
  double hurst = 0.8;      ///< 0 < H < 1; amplitude spectrum k^-(H+1)
  double rms_step = 2.65;  ///< RMS step between neighbouring cells, in units of height
  bool rounded = false;    ///< heights will be rounded to whole units; compensates for it
};

/// A fractal height field on the infinite plane of cells. Each height depends only on the options
/// and the cell's column and row, so any piece can be computed separately, and a smaller DEM is the
/// corner of a larger one. Results are bit-identical on every machine.
///
/// The field is a sum of white noise on lattices with a spacing of 1, 2, 4, ... 4096 cells, each
/// interpolated by cubic B-splines and weighted by spacing^H. Its power spectrum is k^-(2H+2) down
/// to wavelengths of about 8192 cells, beyond which the field is flat on average. Subdivision
/// performs the interpolation: a row of spacing 2s becomes a row of spacing s, then the noise of
/// spacing s is added. This costs a third more than a single lattice. Sources: the sum of octaves
/// of A. Fournier, D. Fussell, L. Carpenter, Computer Rendering of Stochastic Models (1982),
/// doi:10.1145/358523.358553; the subdivision of J. Lane, R. Riesenfeld (1980),
/// doi:10.1109/TPAMI.1980.4766968.
///
/// The RMS step is computed for the infinite plane, not measured. A piece of 1024 x 1024 cells has
/// it within about 2 %, larger pieces more closely.
class Fractal {
 public:
  static constexpr unsigned kOctaves = 13;  ///< spacings 1 to 4096

  /// Requires 0 < hurst < 1 and rms_step >= 0.
  explicit Fractal(const FractalOptions& options);

  /// Multiplies all heights.
  void scale(double factor);
  /// Returns the RMS step between neighbouring cells over the infinite plane, before rounding.
  [[nodiscard]] double rms_step() const { return rms_step_; }
  /// Returns the standard deviation of the heights over the infinite plane.
  [[nodiscard]] double standard_deviation() const { return standard_deviation_; }
  /// Returns an upper bound of the absolute heights.
  [[nodiscard]] double bound() const { return bound_; }

  /// The rows of a vertical strip of the plane.
  class Rows {
   public:
    /// Covers columns first_column ... first_column + width - 1. The fractal must outlive this
    /// object.
    Rows(const Fractal& fractal, std::uint32_t first_column, std::uint32_t width);
    /// Returns the heights of `row`, around 0, valid until the next call. Consecutive ascending
    /// rows cost least. O(width).
    std::span<const float> row(std::uint32_t row);

   private:
    struct Lattice {
      std::int64_t first = 0;  ///< lattice column of values[..][0]
      std::size_t width = 0;
      std::array<std::int64_t, 4> buffered_row{};  ///< row held by each of the four buffers
      std::array<std::vector<float>, 4> values;
      std::vector<float> coarse_row;  ///< combined coarser rows, before columns are doubled
    };

    const float* lattice_row(unsigned octave, std::int64_t row);

    const Fractal* fractal_;
    std::array<Lattice, kOctaves> lattices_;
  };

 private:
  std::uint64_t seed_;
  std::array<float, kOctaves> amplitude_{};  ///< largest value of each lattice's noise
  double rms_step_ = 0.0;
  double standard_deviation_ = 0.0;
  double bound_ = 0.0;
};

}  // namespace terrace::tools
