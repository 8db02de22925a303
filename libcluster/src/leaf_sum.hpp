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

#include "search_space.hpp"

namespace terrace::cluster {

/// What a facility is paid by a row of clients: the sum of weight * max(0, payment - distance).
/// The sum is kept in two halves, those of the even and of the odd places in the row, whatever the
/// processor does at once.
template <class Space>
class LeafSum {
 public:
  explicit LeafSum(const Space& space) : space_(&space) {}

  class From {
   public:
    From(const LeafSum& sum, std::uint32_t facility) : from_(sum.space_->from(facility)) {}
    void add(std::uint32_t first, std::uint32_t count, const double* payments,
             const double* weights) {
      for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t i = first + k;
        half_[k & 1] += weights[i] * std::max(0.0, payments[i] - from_(i));
      }
    }
    [[nodiscard]] double sum() const { return half_[0] + half_[1]; }

   private:
    typename Space::From from_;
    double half_[2] = {0.0, 0.0};
  };

 private:
  const Space* space_;
};

/// Euclidean distances of positions alone, two at a time.
template <>
class LeafSum<NormSpace<EuclideanNorm, false>> {
 public:
  explicit LeafSum(const NormSpace<EuclideanNorm, false>& space) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      axes_[axis].reserve(space.points().size());
      for (const Point3& p : space.points()) axes_[axis].push_back(p[axis]);
    }
  }

  class From {
   public:
    From(const LeafSum& sum, std::uint32_t facility)
        : x_(sum.axes_[0].data()),
          y_(sum.axes_[1].data()),
          z_(sum.axes_[2].data()),
          origin_{x_[facility], y_[facility], z_[facility]} {}

    void add(std::uint32_t first, std::uint32_t count, const double* payments,
             const double* weights) {
      std::uint32_t k = 0;
#ifdef __SSE2__
      const __m128d zero = _mm_setzero_pd();
      const __m128d x0 = _mm_set1_pd(origin_[0]), y0 = _mm_set1_pd(origin_[1]),
                    z0 = _mm_set1_pd(origin_[2]);
      __m128d half = _mm_loadu_pd(half_);
      for (; k + 2 <= count; k += 2) {
        const std::uint32_t i = first + k;
        const __m128d x = _mm_sub_pd(_mm_loadu_pd(x_ + i), x0);
        const __m128d y = _mm_sub_pd(_mm_loadu_pd(y_ + i), y0);
        const __m128d z = _mm_sub_pd(_mm_loadu_pd(z_ + i), z0);
        const __m128d square =
            _mm_add_pd(_mm_add_pd(_mm_mul_pd(x, x), _mm_mul_pd(y, y)), _mm_mul_pd(z, z));
        const __m128d left =
            _mm_max_pd(zero, _mm_sub_pd(_mm_loadu_pd(payments + i), _mm_sqrt_pd(square)));
        half = _mm_add_pd(half, _mm_mul_pd(_mm_loadu_pd(weights + i), left));
      }
      _mm_storeu_pd(half_, half);
#endif
      for (; k < count; ++k) {
        const std::uint32_t i = first + k;
        const double x = x_[i] - origin_[0], y = y_[i] - origin_[1], z = z_[i] - origin_[2];
        const double d = std::sqrt(x * x + y * y + z * z);
        half_[k & 1] += weights[i] * std::max(0.0, payments[i] - d);
      }
    }
    [[nodiscard]] double sum() const { return half_[0] + half_[1]; }

   private:
    const double *x_, *y_, *z_;
    Point3 origin_;
    double half_[2] = {0.0, 0.0};
  };

 private:
  std::vector<double> axes_[3];
};

}  // namespace terrace::cluster
