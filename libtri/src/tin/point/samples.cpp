// SPDX-License-Identifier: Apache-2.0
#include "samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "curve_sort.hpp"

namespace terrace::tri::tin::points {
namespace {

/// Spreads the bits to every other position.
std::uint32_t spread(std::uint32_t bits) {
  bits = (bits | bits << 8) & 0x00FF00FFu;
  bits = (bits | bits << 4) & 0x0F0F0F0Fu;
  bits = (bits | bits << 2) & 0x33333333u;
  return (bits | bits << 1) & 0x55555555u;
}

/// A raster of 2^16 x 2^16 cells over some samples, along the Z curve.
class Cells {
 public:
  Cells(const double* x, const double* y, std::span<const std::uint32_t> order)
      : x_(x), y_(y), low_{x[order[0]], y[order[0]]} {
    std::array<double, 2> high = low_;
    for (const std::uint32_t i : order) {
      low_ = {std::min(low_[0], x[i]), std::min(low_[1], y[i])};
      high = {std::max(high[0], x[i]), std::max(high[1], y[i])};
    }
    extent_ = std::max(high[0] - low_[0], high[1] - low_[1]);
  }
  [[nodiscard]] bool single() const { return !(extent_ > 0); }
  [[nodiscard]] std::uint32_t key(std::uint32_t i) const {
    return spread(cell(x_[i], low_[0])) | spread(cell(y_[i], low_[1])) << 1;
  }

 private:
  [[nodiscard]] std::uint32_t cell(double c, double low) const {
    const double part = (c - low) / extent_ * 65536;
    return part < 65535 ? static_cast<std::uint32_t>(part) : 65535;
  }

  const double* x_;
  const double* y_;
  std::array<double, 2> low_;
  double extent_ = 0;
};

double merged_height(std::span<const Sample> group, PointDuplicates duplicates) {
  double height = group[0].z;
  if (duplicates == PointDuplicates::kMin || duplicates == PointDuplicates::kMax) {
    for (const Sample& sample : group)
      height = duplicates == PointDuplicates::kMin ? std::min(height, sample.z)
                                                   : std::max(height, sample.z);
  } else if (duplicates == PointDuplicates::kMean) {
    // Adds differences from the first height, so that equal heights are preserved exactly.
    double sum = 0;
    for (const Sample& sample : group) sum += sample.z - group[0].z;
    height += sum / static_cast<double>(group.size());
  }
  return height;
}

void check(std::span<const double> values, const char* name) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!(std::abs(values[i]) < kLargest))
      throw std::invalid_argument(std::string("point_tin: ") + name + " of sample " +
                                  std::to_string(i) + " is not finite or too large");
}

}  // namespace

Samples take_samples(std::span<const double> x, std::span<const double> y,
                     std::span<const double> z, PointDuplicates duplicates) {
  if (x.size() != y.size() || x.size() != z.size())
    throw std::invalid_argument("point_tin: x, y and z must have equal lengths");
  if (x.size() > std::size_t{1} << 29) throw std::length_error("point_tin: more than 2^29 samples");
  check(x, "x");
  check(y, "y");
  check(z, "z");
  Samples samples;
  const auto count = static_cast<std::uint32_t>(x.size());
  if (count == 0) return samples;
  Pool<std::uint32_t> numbers;
  numbers.resize(count);
  const std::span<std::uint32_t> order = span_of(numbers);
  std::iota(order.begin(), order.end(), 0u);
  // Samples at one position become adjacent, the smaller number first.
  sort_along_curve<32>(
      order, [&](std::span<const std::uint32_t> part) { return Cells(x.data(), y.data(), part); },
      1,
      [&](std::span<std::uint32_t> run) {
        std::sort(run.begin(), run.end(), [&](std::uint32_t a, std::uint32_t b) {
          if (x[a] != x[b]) return x[a] < x[b];
          if (y[a] != y[b]) return y[a] < y[b];
          return a < b;
        });
      });
  Pool<Sample>& all = samples.all;
  all.resize(count);
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint32_t i = order[k];
    all[k] = {x[i], y[i], z[i], kUnlisted, i};
  }
  numbers.release();
  std::uint32_t kept = 0;
  for (std::uint32_t begin = 0; begin < count;) {
    Sample first = all[begin];
    std::uint32_t end = begin + 1;
    while (end < count && all[end].x == first.x && all[end].y == first.y) ++end;
    if (end - begin > 1 && duplicates == PointDuplicates::kError)
      throw std::invalid_argument("point_tin: sample " + std::to_string(all[begin + 1].id) +
                                  " is at the position of sample " + std::to_string(first.id));
    if (end - begin == 1) {
      all[kept++] = first;
      begin = end;
      continue;
    }
    const std::span<Sample> group = span_of(all).subspan(begin, end - begin);
    const auto [low, high] = std::minmax_element(
        group.begin(), group.end(), [](const Sample& a, const Sample& b) { return a.z < b.z; });
    const Sample lowest = *low, highest = *high;
    samples.duplicates += group.size() - 1;
    samples.duplicate_range = std::max(samples.duplicate_range, highest.z - lowest.z);
    if (duplicates == PointDuplicates::kAll) {
      // Once one of them is a vertex, the other cannot become one, because its position is taken.
      all[kept++] = lowest;
      if (highest.z > lowest.z) all[kept++] = highest;
    } else {
      first.z = merged_height(group, duplicates);
      all[kept++] = first;
    }
    begin = end;
  }
  all.resize(kept);
  return samples;
}

}  // namespace terrace::tri::tin::points
