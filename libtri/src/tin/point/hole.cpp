// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "refinement.hpp"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace terrace::tri::tin::points {
namespace {

constexpr double kImpossible = std::numeric_limits<double>::infinity();

}  // namespace

bool PointHole::gather(const PointMesh& mesh, const Star& star, std::uint32_t v) {
  mesh_ = &mesh;
  star_ = &star;
  const Pool<Sample>& samples = all_.all();
  const Vertex& centre = mesh.vertices[v];
  ring_.clear();
  x_.clear();
  y_.clear();
  z_.clear();
  index_.clear();
  own_sample_ = kNone;
  const auto add = [&](std::uint32_t i) {
    if (i == centre.sample) own_sample_ = index_.size();
    index_.push_back(i);
    x_.push_back(samples[i].x - centre.x);
    y_.push_back(samples[i].y - centre.y);
    z_.push_back(samples[i].z - centre.z);
  };
  for (std::size_t k = 0; k < star.size(); ++k) {
    const Vertex& corner = mesh.vertices[star.ring(k)];
    ring_.push_back({corner.x - centre.x, corner.y - centre.y, corner.z - centre.z, kNone});
    for (std::uint32_t i = all_.heads()[star.triangle(k)]; i != kNone; i = samples[i].next) add(i);
  }
  // A sample that has become a vertex is in no list.
  if (centre.sample != kNone && samples[centre.sample].next == kIsVertex) add(centre.sample);
  failed_sample_ = index_.size();
  own_sample_ = std::min(own_sample_, failed_sample_);
  known_sides_.fill(0);
  words_ = (index_.size() + 63) / 64;
  if (sides_.size() < 2 * words_ * kMaxRing * kMaxRing)
    sides_.resize(2 * words_ * kMaxRing * kMaxRing);
  return !out_of_reach(own_sample_);
}

bool PointHole::fill_otherwise(PolygonFill& fill) {
  return !out_of_reach(failed_sample_) &&
         fill_least_worst(
             ring_.size(), all_.bound(),
             [&](std::size_t i, std::size_t m, std::size_t j, double limit) {
               return left(i, m, j) && has_wide_angles(i, m, j) ? worst(i, m, j, limit)
                                                                : kImpossible;
             },
             fill);
}

double PointHole::cross_at(std::size_t i, std::size_t j, std::size_t sample) const {
  const Vertex& a = ring_[i];
  const Vertex& b = ring_[j];
  return (b.x - a.x) * (y_[sample] - a.y) - (b.y - a.y) * (x_[sample] - a.x);
}

bool PointHole::out_of_reach(std::size_t sample) const {
  if (sample == index_.size()) return false;
  const double bound = all_.bound();
  const std::size_t size = ring_.size();
  // A triangle does not extend above or below its corners.
  const auto [low, high] = std::minmax_element(
      ring_.begin(), ring_.end(), [](const Vertex& a, const Vertex& b) { return a.z < b.z; });
  if (z_[sample] - high->z > bound || low->z - z_[sample] > bound) return true;
  // Bit j of left[i] and bit i of left_from[j] are set if the sample is left of the line from
  // corner i to j, or on it.
  std::array<std::uint32_t, kMaxRing> left{}, left_from{}, right{};
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t j = i + 1; j < size; ++j) {
      const double cross = cross_at(i, j, sample);
      left[i] |= std::uint32_t{cross >= 0} << j;
      left_from[j] |= std::uint32_t{cross >= 0} << i;
      right[i] |= std::uint32_t{cross <= 0} << j;
    }
  }
  // If these signs place the sample inside the ring, they also place it in a triangle of each fill.
  for (std::size_t i = 0; i + 1 < size; ++i)
    if ((left[i] >> (i + 1) & 1U) == 0) return false;
  if ((right[0] >> (size - 1) & 1U) == 0) return false;
  for (std::size_t i = 0; i < size; ++i) {
    for (std::uint32_t ends = right[i]; ends != 0; ends &= ends - 1) {
      const auto j = static_cast<std::size_t>(std::countr_zero(ends));
      for (std::uint32_t apexes = left[i] & left_from[j] & ((1U << j) - 1); apexes != 0;
           apexes &= apexes - 1) {
        const auto m = static_cast<std::size_t>(std::countr_zero(apexes));
        const Plane plane = plane_of(ring_[i], ring_[m], ring_[j]);
        if (plane.reliable && !(error_at(plane, ring_[i], sample) > bound)) return false;
      }
    }
  }
  return true;
}

PointHole::Sides PointHole::sides(std::size_t i, std::size_t j) {
  std::uint64_t* const left = sides_.data() + 2 * words_ * (i * kMaxRing + j);
  std::uint64_t* const right = left + words_;
  if ((known_sides_[i] >> j & 1U) != 0) return {left, right};
  known_sides_[i] = static_cast<std::uint16_t>(known_sides_[i] | 1U << j);
  const std::size_t count = index_.size();
  const double ax = ring_[i].x;
  const double ay = ring_[i].y;
  const double dx = ring_[j].x - ax;
  const double dy = ring_[j].y - ay;
  for (std::size_t w = 0; w < words_; ++w) {
    const std::size_t end = std::min(count, (w + 1) * 64);
    std::uint64_t on_left = 0;
    std::uint64_t on_right = 0;
    std::size_t s = w * 64;
#ifdef __SSE2__
    for (; s + 1 < end; s += 2) {
      const __m128d y = _mm_sub_pd(_mm_loadu_pd(&y_[s]), _mm_set1_pd(ay));
      const __m128d x = _mm_sub_pd(_mm_loadu_pd(&x_[s]), _mm_set1_pd(ax));
      const __m128d cross =
          _mm_sub_pd(_mm_mul_pd(_mm_set1_pd(dx), y), _mm_mul_pd(_mm_set1_pd(dy), x));
      const int ge = _mm_movemask_pd(_mm_cmpge_pd(cross, _mm_setzero_pd()));
      const int le = _mm_movemask_pd(_mm_cmple_pd(cross, _mm_setzero_pd()));
      on_left |= static_cast<std::uint64_t>(ge) << (s % 64);
      on_right |= static_cast<std::uint64_t>(le) << (s % 64);
    }
#endif
    for (; s < end; ++s) {
      const double cross = dx * (y_[s] - ay) - dy * (x_[s] - ax);
      on_left |= static_cast<std::uint64_t>(cross >= 0) << (s % 64);
      on_right |= static_cast<std::uint64_t>(cross <= 0) << (s % 64);
    }
    left[w] = on_left;
    right[w] = on_right;
  }
  return {left, right};
}

double PointHole::error_at(const Plane& plane, const Vertex& a, std::size_t sample) const {
  const double height = a.z + (plane.gx * (x_[sample] - a.x) + plane.gy * (y_[sample] - a.y));
  return std::abs(height - z_[sample]);
}

double PointHole::worst(std::size_t i, std::size_t m, std::size_t j, double limit) {
  const Vertex& a = ring_[i];
  const Plane plane = plane_of(a, ring_[m], ring_[j]);
  if (!plane.reliable) return kImpossible;
  const std::uint64_t* const first = sides(i, m).left;
  const std::uint64_t* const second = sides(m, j).left;
  const std::uint64_t* const chord = sides(i, j).right;
  double largest = 0;
  for (std::size_t w = 0; w < words_; ++w) {
    for (std::uint64_t bits = first[w] & second[w] & chord[w]; bits != 0; bits &= bits - 1) {
      const std::size_t s = w * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      const double error = error_at(plane, a, s);
      if (error > largest) {
        if (error > limit) {
          failed_sample_ = s;
          return kImpossible;
        }
        largest = error;
      }
    }
  }
  return largest;
}

bool PointHole::has_wide_angles(std::size_t i, std::size_t m, std::size_t j) const {
  const std::array<std::size_t, 3> corner{i, m, j};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vertex& p = ring_[corner[k]];
    const Vertex& a = ring_[corner[(k + 1) % 3]];
    const Vertex& b = ring_[corner[(k + 2) % 3]];
    const double cross = (a.x - p.x) * (b.y - p.y) - (a.y - p.y) * (b.x - p.x);
    const double dot = (a.x - p.x) * (b.x - p.x) + (a.y - p.y) * (b.y - p.y);
    if (cross < all_.tangent() * dot) return false;
  }
  return true;
}

void PointHole::replaced(const PointMesh&, const Star& star, const PolygonFill& fill) {
  const std::size_t count = index_.size();
  unlisted_.assign(words_, ~std::uint64_t{0});
  if (count % 64 != 0) unlisted_.back() >>= 64 - count % 64;
  Pool<Sample>& samples = all_.all();
  for (std::size_t k = 0; k < star.size(); ++k) all_.heads()[star.triangle(k)] = kNone;
  // Slots are reused in the order in which triangles are visited.
  std::size_t k = 0;
  star.all_of(fill, [&](std::size_t i, std::size_t m, std::size_t j) {
    const std::uint64_t* const first = sides(i, m).left;
    const std::uint64_t* const second = sides(m, j).left;
    const std::uint64_t* const chord = sides(i, j).right;
    std::uint32_t& head = all_.heads()[star.triangle(k++)];
    for (std::size_t w = 0; w < unlisted_.size(); ++w) {
      const std::uint64_t inside = unlisted_[w] & first[w] & second[w] & chord[w];
      unlisted_[w] &= ~inside;
      for (std::uint64_t bits = inside; bits != 0; bits &= bits - 1) {
        const std::uint32_t s = index_[w * 64 + static_cast<std::size_t>(std::countr_zero(bits))];
        samples[s].next = head;
        head = s;
      }
    }
    return true;
  });
  for (std::size_t w = 0; w < unlisted_.size(); ++w)
    for (std::uint64_t bits = unlisted_[w]; bits != 0; bits &= bits - 1)
      list_unlisted(star, fill, w * 64 + static_cast<std::size_t>(std::countr_zero(bits)));
}

// Samples that rounding places in no triangle go to the triangle that they are least outside of.
void PointHole::list_unlisted(const Star& star, const PolygonFill& fill, std::size_t sample) {
  double best = -kImpossible;
  std::uint32_t slot = star.triangle(0);
  std::size_t k = 0;
  star.all_of(fill, [&](std::size_t i, std::size_t m, std::size_t j) {
    const double least =
        std::min(std::min(cross_at(i, m, sample), cross_at(m, j, sample)), cross_at(j, i, sample));
    if (least > best) {
      best = least;
      slot = star.triangle(k);
    }
    ++k;
    return true;
  });
  all_.all()[index_[sample]].next = all_.heads()[slot];
  all_.heads()[slot] = index_[sample];
}

}  // namespace terrace::tri::tin::points
