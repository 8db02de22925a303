// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <utility>

#include "block/state.hpp"

namespace terrace::cluster {
namespace {

constexpr unsigned kDigitBits = 11;
constexpr unsigned kDigits = 1u << kDigitBits;
constexpr unsigned kKeyBits = 2 * kDigitBits;
constexpr unsigned kMaxAxisBits = 11;

/// The Z-order curve through a grid of equal cells over the block's box. Short sides have fewer
/// cells and so fewer bits in the key, which leaves more bits for the long sides.
struct CurveTable {
  float cells_per_unit = 0;
  /// By axis and cell: the bits that the cell contributes to the key.
  std::array<std::array<std::uint32_t, 1u << kMaxAxisBits>, 3> key_bits;
  std::array<std::uint32_t, 3> last_cell;  ///< by axis

  explicit CurveTable(const Point3& extent) {
    // The longest side is in [1/2, 1). A side that is half as long gets one bit less.
    std::array<unsigned, 3> missing_bits{};
    for (unsigned axis = 0; axis < 3; ++axis) {
      double side = extent[axis];
      while (missing_bits[axis] < kMaxAxisBits && side < 0.5) {
        side *= 2;
        ++missing_bits[axis];
      }
    }
    unsigned bits = kMaxAxisBits;
    const auto total = [&] {
      unsigned sum = 0;
      for (unsigned axis = 0; axis < 3; ++axis)
        sum += bits > missing_bits[axis] ? bits - missing_bits[axis] : 0;
      return sum;
    };
    while (total() > kKeyBits) --bits;
    cells_per_unit = static_cast<float>(1u << bits);
    std::array<unsigned, 3> axis_bits{};
    for (unsigned axis = 0; axis < 3; ++axis) {
      axis_bits[axis] = bits > missing_bits[axis] ? bits - missing_bits[axis] : 0;
      last_cell[axis] = (1u << axis_bits[axis]) - 1;
      key_bits[axis][0] = 0;
    }
    unsigned key_bit = 0;
    for (unsigned bit = 0; bit < bits; ++bit) {
      for (unsigned axis = 0; axis < 3; ++axis) {
        if (bit >= axis_bits[axis]) continue;
        const std::uint32_t half = 1u << bit;
        for (std::uint32_t cell = 0; cell < half; ++cell) {
          key_bits[axis][half + cell] = key_bits[axis][cell] | (1u << key_bit);
        }
        ++key_bit;
      }
    }
  }

  [[nodiscard]] std::uint32_t key(float x, float y, float z) const {
    return key_bits[0][cell(x, 0)] | key_bits[1][cell(y, 1)] | key_bits[2][cell(z, 2)];
  }

 private:
  [[nodiscard]] std::uint32_t cell(float v, unsigned axis) const {
    return std::min(static_cast<std::uint32_t>(static_cast<std::int32_t>(v * cells_per_unit)),
                    last_cell[axis]);
  }
};

}  // namespace

void CurveSorter::load(std::span<const Point3> points, std::span<const double> weights,
                       double mean_weight, const Scaling& scaling, BlockState& state) {
  const auto count = static_cast<std::uint32_t>(points.size());
  const std::uint32_t padded = round_to_lanes(count);
  for (Column<float>* column : {&state.x, &state.y, &state.z, &state.w, &state.distance}) {
    column->reserve(padded);
  }
  for (Column<std::uint32_t>* column :
       {&key_, &high_digit_, &order_, &state.original, &state.nearest}) {
    column->reserve(padded);
  }
  for (Column<float>* column :
       {&state.group_x, &state.group_y, &state.group_z, &state.group_radius}) {
    column->reserve(padded / kLanes);
  }
  state.scratch_pool.reserve(padded);
  if (unsorted_.size() < padded) {
    unsorted_.resize(padded);
    sorted_.resize(padded);
  }
  state.count = count;

  const CurveTable table(scaling.extent);
  std::array<std::uint32_t, kDigits> low{};
  std::array<std::uint32_t, kDigits> high{};
  for (std::uint32_t i = 0; i < count; ++i) {
    const Point3 p = scaling.scaled(points[i]);
    const FloatPoint point{static_cast<float>(p[0]), static_cast<float>(p[1]),
                           static_cast<float>(p[2]), i};
    unsorted_[i] = point;
    const std::uint32_t key = table.key(point.x, point.y, point.z);
    key_[i] = key;
    ++low[key % kDigits];
    ++high[key / kDigits];
  }
  // Stable radix sort by two digits.
  std::uint32_t low_sum = 0;
  std::uint32_t high_sum = 0;
  for (unsigned digit = 0; digit < kDigits; ++digit) {
    low_sum += std::exchange(low[digit], low_sum);
    high_sum += std::exchange(high[digit], high_sum);
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t position = low[key_[i] % kDigits]++;
    order_[position] = i;
    high_digit_[position] = key_[i] / kDigits;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    sorted_[high[high_digit_[i]]++] = unsorted_[order_[i]];
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const FloatPoint& point = sorted_[i];
    state.x[i] = point.x;
    state.y[i] = point.y;
    state.z[i] = point.z;
    state.original[i] = point.original;
  }
  if (weights.empty()) {
    std::fill_n(static_cast<float*>(state.w), count, 1.0f);
  } else {
    for (std::uint32_t i = 0; i < count; ++i) {
      const double weight = weights[state.original[i]] / mean_weight;
      state.w[i] = static_cast<float>(std::max(weight, 1e-30));
    }
  }
  for (std::uint32_t i = count; i < padded; ++i) {
    state.x[i] = state.x[count - 1];
    state.y[i] = state.y[count - 1];
    state.z[i] = state.z[count - 1];
    state.w[i] = 0;
  }
}

}  // namespace terrace::cluster
