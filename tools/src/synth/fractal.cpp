// SPDX-License-Identifier: GPL-3.0-or-later
#include "synth/fractal.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>

#include <terrace/base/portable_math.hpp>
#include <terrace/base/random.hpp>

namespace terrace::tools {

namespace {

/// The noise of a lattice point is the sum of two 16-bit numbers around 0, in units of 2^-16. Its
/// density is triangular on (-1, 1) with variance 1/6 (to 1e-9).
constexpr double kNoiseVariance = 1.0 / 6.0;
/// Rounding to integers adds 1/12 to the variance of each of two neighbours.
constexpr double kRoundingStepVariance = 2.0 / 12.0;

/// Adds the noise of lattice points first, first + 1, ... of one lattice row. It uses 32-bit
/// arithmetic, which the compiler can vectorise. The mixing is C. Wellons' `lowbias32`, with the
/// upper half of the key mixed in between so that rows are not shifted copies of one another.
void add_noise(std::uint64_t key, std::int64_t first, float amplitude, float* values,
               std::size_t count) {
  const auto low = static_cast<std::uint32_t>(key);
  const auto high = static_cast<std::uint32_t>(key >> 32);
  const auto start = static_cast<std::uint32_t>(first);
  const float scale = amplitude * 0x1p-16F;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t x = (start + static_cast<std::uint32_t>(i)) ^ low;
    x ^= x >> 16;
    x *= 0x7FEB352Du;
    x ^= x >> 15;
    x += high;
    x *= 0x846CA68Bu;
    x ^= x >> 16;
    const auto sum = static_cast<std::int32_t>((x & 0xFFFFu) + (x >> 16)) - 0xFFFF;
    values[i] += scale * static_cast<float>(sum);
  }
}

/// Performs one step of cubic B-spline subdivision: coefficient n of the finer lattice is (c[m-1] +
/// 6 c[m] + c[m+1]) / 8 for n = 2m and (c[m] + c[m+1]) / 2 for n = 2m + 1. coarse[0] has lattice
/// column coarse_first <= floor(first / 2) - 1.
void double_columns(const float* coarse, std::int64_t coarse_first, std::int64_t first, float* fine,
                    std::size_t count) {
  std::size_t n = 0;
  std::int64_t m = (first >> 1) - coarse_first;
  if ((first & 1) != 0 && count > 0) {
    fine[n++] = 0.5F * (coarse[m] + coarse[m + 1]);
    ++m;
  }
  const float* c = coarse + m;
  const std::size_t pairs = (count - n) / 2;
  float* out = fine + n;
  for (std::size_t p = 0; p < pairs; ++p) {
    const float left = c[p];
    const float right = c[p + 1];
    out[2 * p] = 0.125F * (c[static_cast<std::ptrdiff_t>(p) - 1] + right) + 0.75F * left;
    out[2 * p + 1] = 0.5F * (left + right);
  }
  n += 2 * pairs;
  if (n < count) {
    c += pairs;
    fine[n] = 0.125F * (c[-1] + c[1]) + 0.75F * c[0];
  }
}

/// Returns the kernel of spacing 2^octave sampled at the cells, that is, the result of `octave`
/// subdivisions of a single 1.
std::vector<double> kernel(unsigned octave) {
  std::vector<double> fine{1.0};
  for (unsigned step = 0; step < octave; ++step) {
    std::vector<double> coarse = std::move(fine);
    fine.assign(2 * coarse.size() + 3, 0.0);
    for (std::size_t i = 0; i < coarse.size(); ++i) {
      constexpr std::array<double, 5> kMask{0.125, 0.5, 0.75, 0.5, 0.125};
      for (std::size_t k = 0; k < 5; ++k) fine[2 * i + k] += coarse[i] * kMask[k];
    }
  }
  return fine;
}

/// Variances of a lattice's field and of its steps, averaged over all cells, for noise of variance
/// 1. The field is separable, so both follow from the autocorrelation of the kernel at lags 0 and
/// 1.
struct Variances {
  double field = 0.0, step = 0.0;
};

Variances variances(unsigned octave) {
  const std::vector<double> k = kernel(octave);
  double lag0 = 0, lag1 = 0;
  for (std::size_t i = 0; i < k.size(); ++i) {
    lag0 += k[i] * k[i];
    if (i + 1 < k.size()) lag1 += k[i] * k[i + 1];
  }
  const double spacing = static_cast<double>(1u << octave);
  lag0 /= spacing;
  lag1 /= spacing;
  return {.field = lag0 * lag0, .step = 2.0 * (lag0 - lag1) * lag0};
}

}  // namespace

Fractal::Fractal(const FractalOptions& options) : seed_(options.seed) {
  assert(options.hurst > 0 && options.hurst < 1 && options.rms_step >= 0);
  // The variance of the step is the sum over the lattices, which gives the common factor of the
  // amplitudes.
  const double growth = base::exp2(options.hurst);
  std::array<double, kOctaves> weight{};
  double step = 0, field = 0, largest = 0;
  for (unsigned octave = 0; octave < kOctaves; ++octave) {
    weight[octave] = octave == 0 ? 1.0 : weight[octave - 1] * growth;
    const Variances variance = variances(octave);
    step += weight[octave] * weight[octave] * kNoiseVariance * variance.step;
    field += weight[octave] * weight[octave] * kNoiseVariance * variance.field;
    largest += weight[octave];
  }
  double target_variance = options.rms_step * options.rms_step;
  if (options.rounded && options.rms_step >= 1.0) target_variance -= kRoundingStepVariance;
  const double factor = std::sqrt(target_variance / step);
  for (unsigned octave = 0; octave < kOctaves; ++octave) {
    amplitude_[octave] = static_cast<float>(weight[octave] * factor);
  }
  rms_step_ = std::sqrt(target_variance);
  standard_deviation_ = factor * std::sqrt(field);
  bound_ = factor * largest;
}

void Fractal::scale(double factor) {
  for (float& amplitude : amplitude_) amplitude = static_cast<float>(amplitude * factor);
  rms_step_ *= factor;
  standard_deviation_ *= factor;
  bound_ *= factor;
}

Fractal::Rows::Rows(const Fractal& fractal, std::uint32_t first_column, std::uint32_t width)
    : fractal_(&fractal) {
  assert(width > 0);
  std::int64_t first = first_column;
  std::int64_t last = first + width - 1;
  for (Lattice& lattice : lattices_) {
    lattice.first = first;
    lattice.width = static_cast<std::size_t>(last - first + 1);
    lattice.buffered_row.fill(INT64_MIN);
    for (std::vector<float>& values : lattice.values) values.resize(lattice.width);
    first = (first >> 1) - 1;
    last = (last >> 1) + 1;
    lattice.coarse_row.resize(static_cast<std::size_t>(last - first + 1));
  }
}

std::span<const float> Fractal::Rows::row(std::uint32_t row) {
  return {lattice_row(0, row), lattices_[0].width};
}

const float* Fractal::Rows::lattice_row(unsigned octave, std::int64_t row) {
  Lattice& lattice = lattices_[octave];
  const auto slot = static_cast<std::size_t>(row & 3);
  std::vector<float>& values = lattice.values[slot];
  if (lattice.buffered_row[slot] == row) return values.data();

  if (octave + 1 < kOctaves) {
    const std::int64_t m = row >> 1;
    float* const coarse_row = lattice.coarse_row.data();
    const std::size_t width = lattice.coarse_row.size();
    if ((row & 1) == 0) {
      const float* const above = lattice_row(octave + 1, m - 1);
      const float* const middle = lattice_row(octave + 1, m);
      const float* const below = lattice_row(octave + 1, m + 1);
      for (std::size_t i = 0; i < width; ++i) {
        coarse_row[i] = 0.125F * (above[i] + below[i]) + 0.75F * middle[i];
      }
    } else {
      const float* const middle = lattice_row(octave + 1, m);
      const float* const below = lattice_row(octave + 1, m + 1);
      for (std::size_t i = 0; i < width; ++i) coarse_row[i] = 0.5F * (middle[i] + below[i]);
    }
    double_columns(coarse_row, lattices_[octave + 1].first, lattice.first, values.data(),
                   lattice.width);
  } else {
    std::fill(values.begin(), values.end(), 0.0F);
  }
  const std::uint64_t key =
      base::splitmix64(base::splitmix64(fractal_->seed_ + (std::uint64_t{octave} << 56)) ^
                       static_cast<std::uint64_t>(row));
  add_noise(key, lattice.first, fractal_->amplitude_[octave], values.data(), lattice.width);
  lattice.buffered_row[slot] = row;
  return values.data();
}

}  // namespace terrace::tools
