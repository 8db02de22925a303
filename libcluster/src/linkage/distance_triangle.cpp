// SPDX-License-Identifier: Apache-2.0
#include "linkage/distance_triangle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

#include "linkage/kernels.hpp"
#include "terrace/cluster/band_matrix.hpp"

namespace terrace::cluster {
namespace {

constexpr std::size_t kRowsOfTriangle = 32;  ///< rows that a thread fills at a time

bool works_on_squares(LinkageMethod method) {
  return method == LinkageMethod::ward || method == LinkageMethod::centroid ||
         method == LinkageMethod::median;
}

}  // namespace

template <class T>
DistanceTriangle<T>::DistanceTriangle(std::size_t count, LinkageMethod method,
                                      const LinkageOptions& options)
    : ClusterSlots(count, options.check_stop), method_(method), squares_(works_on_squares(method)) {
  // The limit is checked for a band, which has the same size up to half a row.
  (void)checked_band_bytes(count, sizeof(T), options.memory_limit);
  if (count > 1) entries_ = std::make_unique_for_overwrite<T[]>(count * (count - 1) / 2);
}

template <class T>
DistanceTriangle<T>::DistanceTriangle(const LinkagePoints& points, LinkageMethod method,
                                      const LinkageOptions& options)
    : DistanceTriangle(points.scaled().size(), method, options) {
  const LinkageKernels<T>& kernels = linkage_kernels<T>(options.path);
  exponent_ = points.exponent();
  std::vector<double> axis[3];
  for (unsigned a = 0; a < 3; ++a) {
    for (const Point3& p : points.scaled()) axis[a].push_back(p[a]);
  }
  base::parallel_blocks(size(), kRowsOfTriangle, options.threads,
                        [&](std::size_t begin, std::size_t end, unsigned) {
                          base::StopTicks ticks(options.check_stop);
                          for (std::size_t i = std::max<std::size_t>(begin, 1); i < end; ++i) {
                            ticks(end);
                            T* const to = row(i);
                            kernels.distances(axis[0].data(), axis[1].data(), axis[2].data(), i,
                                              axis[0][i], axis[1][i], axis[2][i], to);
                            if (squares_) continue;
                            for (std::size_t j = 0; j < i; ++j) to[j] = std::sqrt(to[j]);
                          }
                        });
}

template <class T>
DistanceTriangle<T>::DistanceTriangle(std::size_t count, const PairDistance& distance,
                                      LinkageMethod method, const LinkageOptions& options)
    : DistanceTriangle(count, method, options) {
  base::parallel_blocks(
      count, kRowsOfTriangle, options.threads, [&](std::size_t begin, std::size_t end, unsigned) {
        base::StopTicks ticks(options.check_stop);
        for (std::size_t i = std::max<std::size_t>(begin, 1); i < end; ++i) {
          T* const to = row(i);
          for (std::size_t j = 0; j < i; ++j) {
            ticks(kTicksOfDistance);
            const double value =
                distance(static_cast<std::uint32_t>(j), static_cast<std::uint32_t>(i));
            check_distance(value, std::numeric_limits<T>::max(), j, i);
            to[j] = static_cast<T>(value);
          }
        }
      });
  double largest = 0.0;
  for (std::size_t i = 1; i < count; ++i) {
    tick(i);
    for (std::size_t j = 0; j < i; ++j) largest = std::max(largest, double{row(i)[j]});
  }
  if (largest > 0.0) std::frexp(largest, &exponent_);
  for (std::size_t i = 1; i < count; ++i) {
    tick(i);
    for (std::size_t j = 0; j < i; ++j) {
      T& entry = row(i)[j];
      entry = std::ldexp(entry, -exponent_);
      if (squares_) entry *= entry;
    }
  }
}

template <class T>
NearCluster DistanceTriangle<T>::nearest(std::uint32_t x, std::uint32_t begin, std::uint32_t end,
                                         NearCluster best) const {
  // Entries of dead slots are infinite here.
  const T* const own = x > 0 ? row(x) : nullptr;
  for (std::uint32_t k = begin; k < std::min(x, end); ++k) {
    if (own[k] < best.distance) best = {own[k], k};
  }
  for (std::uint32_t k = std::max(x + 1, begin); k < end; ++k) {
    if (!alive(k)) continue;
    const double distance = row(k)[x];
    if (distance < best.distance) best = {distance, k};
  }
  return best;
}

template <class T>
double DistanceTriangle<T>::combined(double to_low, double to_high, double between, double low,
                                     double high, double other) const {
  switch (method_) {
    case LinkageMethod::single:
      return std::min(to_low, to_high);
    case LinkageMethod::complete:
      return std::max(to_low, to_high);
    case LinkageMethod::average:
      return (low * to_low + high * to_high) / (low + high);
    case LinkageMethod::weighted:
      return 0.5 * (to_low + to_high);
    case LinkageMethod::ward:
      return ((other + low) * to_low + (other + high) * to_high - other * between) /
             (other + low + high);
    case LinkageMethod::centroid:
      return (low * to_low + high * to_high - low * high * between / (low + high)) / (low + high);
    case LinkageMethod::median:
      return 0.5 * (to_low + to_high) - 0.25 * between;
  }
  return 0.0;
}

template <class T>
void DistanceTriangle<T>::join(std::uint32_t low, std::uint32_t high, double between) {
  const double count_low = points(low), count_high = points(high);
  for (std::uint32_t k = 0; k < size(); ++k) {
    if (!alive(k) || k == low || k == high) continue;
    T& to_high = k < high ? row(high)[k] : row(k)[high];
    T& to_low = k < low ? row(low)[k] : row(k)[low];
    // Not negative, because the two that merge are at most as far from each other as from others.
    to_high = static_cast<T>(combined(to_low, to_high, between, count_low, count_high, points(k)));
    if (k > low) to_low = std::numeric_limits<T>::infinity();
  }
  row(high)[low] = std::numeric_limits<T>::infinity();
}

template <class T>
void DistanceTriangle<T>::move(const std::vector<std::uint32_t>& slots) {
  T* to = entries_.get();
  for (std::size_t i = 1; i < slots.size(); ++i) {
    tick(i);
    const T* const from = row(slots[i]);
    for (std::size_t j = 0; j < i; ++j) *to++ = from[slots[j]];
  }
}

template <class T>
double DistanceTriangle<T>::height(double distance) const {
  return std::ldexp(squares_ ? std::sqrt(distance) : distance, exponent_);
}

template class DistanceTriangle<float>;
template class DistanceTriangle<double>;

}  // namespace terrace::cluster
