// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>

#include "samples.hpp"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace terrace::tri::tin::points {
namespace {

/// Sectors are found by a bit for each ray up to this many rays, otherwise by binary search.
constexpr std::size_t kMaskBits = 64;

}  // namespace

void Fan::start(const Vertex& apex, bool open) {
  apex_ = apex;
  open_ = open;
  rays_.clear();
  pairs_.clear();
}

void Fan::add_ray(const Vertex& end) { rays_.push_back(end); }

void Fan::finish() {
  const std::size_t rays = rays_.size();
  const std::size_t count = open_ ? rays - 1 : rays;
  pairs_.assign((rays + 1) / 2 * 4, 0.0);
  for (std::size_t i = 0; i < rays; ++i) {
    pairs_[i / 2 * 4 + i % 2] = rays_[i].x - apex_.x;
    pairs_[i / 2 * 4 + i % 2 + 2] = rays_[i].y - apex_.y;
  }
  // An open fan covers half a turn, or less by rounding.
  half_ = rays;
  if (!open_ && rays > kMaskBits) {
    const double x = pairs_[0], y = pairs_[2];
    half_ = 1;
    while (half_ < rays &&
           x * pairs_[half_ / 2 * 4 + half_ % 2 + 2] > y * pairs_[half_ / 2 * 4 + half_ % 2])
      ++half_;
  }
  planes_.resize(count);
  sectors_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    planes_[i] = plane_of(apex_, rays_[i], rays_[i + 1 == rays ? 0 : i + 1]);
    sectors_[i] = {&sectors_[i].head, kNone, kNone, 0};
  }
}

// A sample is in sector i if it is left of (or on) ray i and right of ray i + 1. If rounding leaves
// none or two, close to the apex, any of them will do, because the surfaces are equal there. A
// sample just outside an open fan belongs to the sector at that end.
std::size_t Fan::sector_of(double dx, double dy) const {
  const std::size_t rays = rays_.size();
  const double* pair = pairs_.data();
  std::uint64_t left = 0;
#ifdef __SSE2__
  const __m128d sample_x = _mm_set1_pd(dx);
  const __m128d sample_y = _mm_set1_pd(dy);
  for (std::size_t i = 0; i < rays; i += 2, pair += 4) {
    const __m128d forward = _mm_mul_pd(_mm_loadu_pd(pair), sample_y);
    const __m128d backward = _mm_mul_pd(_mm_loadu_pd(pair + 2), sample_x);
    const auto bits = static_cast<unsigned>(_mm_movemask_pd(_mm_cmpge_pd(forward, backward)));
    left |= static_cast<std::uint64_t>(bits) << i;
  }
#else
  for (std::size_t i = 0; i < rays; i += 2, pair += 4)
    for (std::size_t k = 0; k < 2; ++k)
      left |= static_cast<std::uint64_t>(pair[k] * dy >= pair[k + 2] * dx) << (i + k);
#endif
  // The first ray follows the last, except in an open fan. The padding of the last pair is left of
  // everything, and its bit must not be mistaken for a ray's.
  left &= ~std::uint64_t{0} >> (64 - rays);
  const std::uint64_t next = left >> 1 | (open_ ? 0 : (left & 1) << (rays - 1));
  const std::uint64_t matches = left & ~next & (~std::uint64_t{0} >> (64 - sectors_.size()));
  if (matches != 0) return static_cast<std::size_t>(std::countr_zero(matches));
  return (left & 1) == 0 ? 0 : sectors_.size() - 1;
}

// The rays of each half turn from ray 0 on are sorted by angle.
std::size_t Fan::sector_of_many(double dx, double dy) const {
  const auto left = [&](std::size_t ray) {
    const double* pair = pairs_.data() + ray / 2 * 4 + ray % 2;
    return pair[0] * dy >= pair[2] * dx;
  };
  const bool first_half = left(0);
  if (open_ && !first_half) return 0;
  std::size_t low = first_half ? 0 : half_ - 1;
  std::size_t high = first_half ? half_ : rays_.size();
  while (high - low > 1) {
    const std::size_t middle = low + (high - low) / 2;
    (left(middle) ? low : high) = middle;
  }
  return std::min(low, sectors_.size() - 1);
}

double Fan::height_without_plane(std::size_t sector, const Sample& sample) const {
  return height_in(apex_, rays_[sector], rays_[sector + 1 == rays_.size() ? 0 : sector + 1],
                   sample.x, sample.y);
}

void Fan::assign_samples(Sample* samples, std::uint32_t head, std::uint32_t excluded) {
  const bool many = rays_.size() > kMaskBits;
  for (std::uint32_t i = head; i != kNone;) {
    Sample& sample = samples[i];
    const std::uint32_t next = sample.next;
    if (i != excluded) {
      const double dx = sample.x - apex_.x;
      const double dy = sample.y - apex_.y;
      const std::size_t s = many ? sector_of_many(dx, dy) : sector_of(dx, dy);
      const Plane& plane = planes_[s];
      const double height = plane.reliable ? apex_.z + (plane.gx * dx + plane.gy * dy)
                                           : height_without_plane(s, sample);
      const double error = std::abs(height - sample.z);
      Sector& sector = sectors_[s];
      *sector.end = i;
      sector.end = &sample.next;
      if (error > sector.error && !stuck(sample)) {
        sector.error = error;
        sector.worst = i;
      }
    }
    i = next;
  }
}

void Fan::end_lists() {
  for (Sector& sector : sectors_) *sector.end = kNone;
}

}  // namespace terrace::tri::tin::points
