// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_samples.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "../curve_sort.hpp"

namespace terrace::tri::tin {
namespace {

using Order = std::span<std::uint32_t>;

/// Every other bit.
std::uint32_t spread(std::uint32_t bits) {
  bits = (bits | bits << 8) & 0x00FF00FFu;
  bits = (bits | bits << 4) & 0x0F0F0F0Fu;
  bits = (bits | bits << 2) & 0x33333333u;
  return (bits | bits << 1) & 0x55555555u;
}

/// A raster of 2^16 x 2^16 cells over some samples, along the Z curve.
class Cells {
 public:
  Cells(const double* x, const double* y, std::span<const std::uint32_t> order) : x_(x), y_(y) {
    const auto [low_x, high_x] = range(x, order);
    const auto [low_y, high_y] = range(y, order);
    low_x_ = low_x;
    low_y_ = low_y;
    // Halves: the extent of finite doubles may overflow.
    extent_ = std::max(high_x / 2 - low_x / 2, high_y / 2 - low_y / 2);
  }
  [[nodiscard]] bool single() const { return !(extent_ > 0); }
  [[nodiscard]] std::uint32_t key(std::uint32_t i) const {
    return spread(cell(x_[i], low_x_)) | spread(cell(y_[i], low_y_)) << 1;
  }

 private:
  static std::array<double, 2> range(const double* values, std::span<const std::uint32_t> order) {
    double low = values[order[0]];
    double high = low;
    for (const std::uint32_t i : order) {
      low = std::min(low, values[i]);
      high = std::max(high, values[i]);
    }
    return {low, high};
  }
  [[nodiscard]] std::uint32_t cell(double c, double low) const {
    const double part = (c / 2 - low / 2) / extent_ * 65536;
    return part < 65535 ? static_cast<std::uint32_t>(part) : 65535;
  }

  const double* x_;
  const double* y_;
  double low_x_ = 0;
  double low_y_ = 0;
  double extent_ = 0;
};

/// Orders so that samples of one place are beside each other, the smaller number first. Samples of
/// one cell are so few that sorting them by place does not spoil the curve.
void group_places(const double* x, const double* y, Order order) {
  constexpr std::size_t kFew = 3000;
  const auto sort_places = [x, y](Order part) {
    std::sort(part.begin(), part.end(), [x, y](std::uint32_t a, std::uint32_t b) {
      if (x[a] != x[b]) return x[a] < x[b];
      if (y[a] != y[b]) return y[a] < y[b];
      return a < b;
    });
  };
  const Cells cells(x, y, order);
  if (order.size() < kFew || cells.single()) return sort_places(order);
  std::size_t begin = 0;
  std::uint32_t key = cells.key(order[0]);
  for (std::size_t i = 1; i <= order.size(); ++i) {
    const std::uint32_t next = i < order.size() ? cells.key(order[i]) : ~key;
    if (next == key) continue;
    const Order part = order.subspan(begin, i - begin);
    if (part.size() >= kFew) {
      group_places(x, y, part);
    } else if (part.size() > 1) {
      sort_places(part);
    }
    begin = i;
    key = next;
  }
}

double merged_height(const double* z, Order group, PointDuplicates duplicates) {
  double height = z[group[0]];
  if (duplicates == PointDuplicates::kMin || duplicates == PointDuplicates::kMax) {
    for (const std::uint32_t i : group)
      height =
          duplicates == PointDuplicates::kMin ? std::min(height, z[i]) : std::max(height, z[i]);
  } else if (duplicates == PointDuplicates::kMean) {
    // Differences from the first: the sum of heights may overflow, and equal ones stay as they are.
    double sum = 0;
    const auto count = static_cast<double>(group.size());
    for (const std::uint32_t i : group) sum += z[i] / count - height / count;
    height += sum;
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
    throw std::invalid_argument("point_tin: arrays of different lengths");
  if (x.size() > std::size_t{1} << 29) throw std::length_error("point_tin: more than 2^29 samples");
  check(x, "x");
  check(y, "y");
  check(z, "z");
  Samples samples;
  const auto count = static_cast<std::uint32_t>(x.size());
  if (count == 0) return samples;
  Pool<std::uint32_t> numbers;
  numbers.resize(count);
  const Order order = span_of(numbers);
  std::iota(order.begin(), order.end(), 0u);
  if (count >= 3000)
    sort_along_curve<32>(order, [&](std::span<const std::uint32_t> part) {
      return Cells(x.data(), y.data(), part);
    });
  group_places(x.data(), y.data(), order);
  samples.all.resize(count);
  std::uint32_t kept = 0;
  for (std::uint32_t begin = 0; begin < count;) {
    const std::uint32_t first = order[begin];
    std::uint32_t end = begin + 1;
    while (end < count && x[order[end]] == x[first] && y[order[end]] == y[first]) ++end;
    if (end - begin > 1 && duplicates == PointDuplicates::kError)
      throw std::invalid_argument("point_tin: sample " + std::to_string(order[begin + 1]) +
                                  " has the place of sample " + std::to_string(first));
    samples.all[kept++] = {x[first], y[first],
                           merged_height(z.data(), order.subspan(begin, end - begin), duplicates),
                           kUnlisted, first};
    begin = end;
  }
  samples.duplicates = count - kept;
  samples.all.resize(kept);
  return samples;
}

}  // namespace terrace::tri::tin
