// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <terrace/base/portable_math.hpp>

/// Lengths of vectors of three coordinates and any number of channels, which are further axes. a
/// and b are rows of channels, of which only the difference counts. Every norm grows with the
/// absolute value of each component, including rounding, except for the powers of PowerNorm.

namespace terrace::cluster {

struct SquaredNorm {
  double operator()(double x, double y, double z, const double* a, const double* b,
                    std::size_t channels) const {
    double sum = x * x + y * y + z * z;
    for (std::size_t c = 0; c < channels; ++c) {
      const double d = a[c] - b[c];
      sum += d * d;
    }
    return sum;
  }
};

struct EuclideanNorm {
  double operator()(double x, double y, double z, const double* a, const double* b,
                    std::size_t channels) const {
    return std::sqrt(SquaredNorm{}(x, y, z, a, b, channels));
  }
};

struct CityBlockNorm {
  double operator()(double x, double y, double z, const double* a, const double* b,
                    std::size_t channels) const {
    double sum = std::abs(x) + std::abs(y) + std::abs(z);
    for (std::size_t c = 0; c < channels; ++c) sum += std::abs(a[c] - b[c]);
    return sum;
  }
};

struct MaximumNorm {
  double operator()(double x, double y, double z, const double* a, const double* b,
                    std::size_t channels) const {
    double largest = std::max({std::abs(x), std::abs(y), std::abs(z)});
    for (std::size_t c = 0; c < channels; ++c) largest = std::max(largest, std::abs(a[c] - b[c]));
    return largest;
  }
};

/// Relative to the largest component, so that powers neither overflow nor underflow.
struct PowerNorm {
  double p;
  double operator()(double x, double y, double z, const double* a, const double* b,
                    std::size_t channels) const {
    const double largest = MaximumNorm{}(x, y, z, a, b, channels);
    if (largest == 0.0) return 0.0;
    double sum = base::pow(std::abs(x) / largest, p) + base::pow(std::abs(y) / largest, p) +
                 base::pow(std::abs(z) / largest, p);
    for (std::size_t c = 0; c < channels; ++c) sum += base::pow(std::abs(a[c] - b[c]) / largest, p);
    return largest * base::pow(sum, 1.0 / p);
  }
};

}  // namespace terrace::cluster
