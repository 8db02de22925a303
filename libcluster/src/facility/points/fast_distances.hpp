// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "facility/points/search_space.hpp"

namespace terrace::cluster {

/// Distances from a facility to consecutive clients, and the payments to it: the sum of weight *
/// max(0, payment - distance). That sum has two halves, one for even and one for odd positions,
/// whatever the width of the processor's vectors.
template <class Space>
class FastDistances {
 public:
  explicit FastDistances(const Space& space) : space_(&space) {}
  [[nodiscard]] auto row(std::uint32_t facility) const { return Row(*this, facility); }

  class Row {
   public:
    Row(const FastDistances& all, std::uint32_t facility) : row_(all.space_->row(facility)) {}
    /// Writes the distances of the first `count` clients.
    void fill(std::uint32_t count, double* out) const {
      for (std::uint32_t i = 0; i < count; ++i) out[i] = row_(i);
    }
    /// Adds the payments of `count` clients, starting at `first`.
    void add(std::uint32_t first, std::uint32_t count, const double* payments,
             const double* weights) {
      for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t i = first + k;
        half_[k & 1] += weights[i] * std::max(0.0, payments[i] - row_(i));
      }
    }
    [[nodiscard]] double sum() const { return half_[0] + half_[1]; }

   private:
    typename Space::Row row_;
    double half_[2] = {0.0, 0.0};
  };

 private:
  const Space* space_;
};

/// Euclidean distances of positions only, two at a time.
template <>
class FastDistances<NormSpace<EuclideanNorm, false>> {
 public:
  explicit FastDistances(const NormSpace<EuclideanNorm, false>& space) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      axes_[axis].reserve(space.points().size());
      for (const Point3& p : space.points()) axes_[axis].push_back(p[axis]);
    }
  }
  [[nodiscard]] auto row(std::uint32_t facility) const { return Row(*this, facility); }

  class Row {
   public:
    Row(const FastDistances& all, std::uint32_t facility)
        : x_(all.axes_[0].data()),
          y_(all.axes_[1].data()),
          z_(all.axes_[2].data()),
          origin_{x_[facility], y_[facility], z_[facility]} {}

    void fill(std::uint32_t count, double* out) const {
      std::uint32_t i = 0;
#ifdef __SSE2__
      for (; i + 2 <= count; i += 2) _mm_storeu_pd(out + i, two(i));
#endif
      for (; i < count; ++i) out[i] = one(i);
    }
    void add(std::uint32_t first, std::uint32_t count, const double* payments,
             const double* weights) {
      std::uint32_t k = 0;
#ifdef __SSE2__
      const __m128d zero = _mm_setzero_pd();
      __m128d half = _mm_loadu_pd(half_);
      for (; k + 2 <= count; k += 2) {
        const std::uint32_t i = first + k;
        const __m128d left = _mm_max_pd(zero, _mm_sub_pd(_mm_loadu_pd(payments + i), two(i)));
        half = _mm_add_pd(half, _mm_mul_pd(_mm_loadu_pd(weights + i), left));
      }
      _mm_storeu_pd(half_, half);
#endif
      for (; k < count; ++k) {
        const std::uint32_t i = first + k;
        half_[k & 1] += weights[i] * std::max(0.0, payments[i] - one(i));
      }
    }
    [[nodiscard]] double sum() const { return half_[0] + half_[1]; }

   private:
    [[nodiscard]] double one(std::uint32_t i) const {
      const double x = x_[i] - origin_[0], y = y_[i] - origin_[1], z = z_[i] - origin_[2];
      return std::sqrt(x * x + y * y + z * z);
    }
#ifdef __SSE2__
    [[nodiscard]] __m128d two(std::uint32_t i) const {
      const __m128d x = _mm_sub_pd(_mm_loadu_pd(x_ + i), _mm_set1_pd(origin_[0]));
      const __m128d y = _mm_sub_pd(_mm_loadu_pd(y_ + i), _mm_set1_pd(origin_[1]));
      const __m128d z = _mm_sub_pd(_mm_loadu_pd(z_ + i), _mm_set1_pd(origin_[2]));
      return _mm_sqrt_pd(
          _mm_add_pd(_mm_add_pd(_mm_mul_pd(x, x), _mm_mul_pd(y, y)), _mm_mul_pd(z, z)));
    }
#endif
    const double *x_, *y_, *z_;
    Point3 origin_;
    double half_[2] = {0.0, 0.0};
  };

 private:
  std::vector<double> axes_[3];
};

}  // namespace terrace::cluster
