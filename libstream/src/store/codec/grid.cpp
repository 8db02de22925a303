// SPDX-License-Identifier: Apache-2.0
#include "store/codec/grid.hpp"

namespace terrace::stream::store {
namespace {

/// Returns about twice the logarithm of a residual's size: 0, 2, 4, 5, 6, 7, 8, ... for 0, 1, 2, 3,
/// 4..5, 6..7, 8..11, ...
constexpr std::uint8_t magnitude_of(std::uint64_t zigzagged) {
  const std::uint64_t size = (zigzagged >> 1) + (zigzagged & 1);
  if (size == 0) return 0;
  if (size == 1) return 2;
  const unsigned exponent = static_cast<unsigned>(std::bit_width(size)) - 1;
  return static_cast<std::uint8_t>(2 * exponent + 2 + ((size >> (exponent - 1)) & 1));
}

}  // namespace

const std::array<std::uint8_t, kSymbols> GridCodec::kMagnitude = [] {
  std::array<std::uint8_t, kSymbols> table{};
  for (unsigned c = 0; c < kClasses; ++c) table[c] = magnitude_of(kClassRange[c].base);
  return table;
}();

const std::array<GridCodec::Step, kPatterns> GridCodec::kStep = [] {
  std::array<Step, kPatterns> table{};
  for (unsigned pattern = 0; pattern < kPatterns; ++pattern) {
    const auto exists = [&](Neighbour n) { return pattern >> n & 1; };
    const unsigned weight =
        2 * exists(kWest) + 2 * exists(kNorth) + exists(kNorthWest) + exists(kNorthEast);
    const bool good = exists(kWest) && exists(kNorth);
    table[pattern].base = good ? 0 : context::kHeightSteps;
    if (weight == 0) {
      table[pattern].base += context::kHeightSteps - 1;
    } else {
      table[pattern].scale = static_cast<std::uint16_t>(1024 / weight);
      table[pattern].max_step = context::kHeightSteps - 2;
    }
  }
  return table;
}();

void GridCodec::start(std::uint32_t width, std::uint32_t height) {
  stride_ = static_cast<std::ptrdiff_t>(width) + kPadX;
  rows_ = static_cast<std::ptrdiff_t>(height) + kPadY;
  const auto cells = static_cast<std::size_t>(stride_ * rows_);
  mask_.assign(cells, 0);
  magnitudes_.assign(cells, 0);
  if (values_.size() < cells) {
    values_.resize(cells);
    points_.resize(cells);
    patterns_.resize(cells);
  }
}

void GridCodec::find_patterns() {
  const std::ptrdiff_t up = stride_;
  const std::ptrdiff_t begin = kPadY * up + 2, end = rows_ * up;
  const std::uint8_t* const mask = mask_.data();
  for (std::ptrdiff_t i = begin; i < end; ++i) {
    patterns_[static_cast<std::size_t>(i)] =
        static_cast<std::uint8_t>(mask[i - 1] << kWest | mask[i - up] << kNorth |
                                  mask[i - up - 1] << kNorthWest | mask[i - up + 1] << kNorthEast |
                                  mask[i - 2] << kWestWest | mask[i - 2 * up] << kNorthNorth);
  }
}

std::uint64_t GridCodec::count_runs(std::uint32_t row) const {
  // The cell before the first is padding, so a run begins wherever the mask changes from 0 to 1.
  const std::uint8_t* const cells = mask_.data() + cell_of(0, row);
  const std::ptrdiff_t width = stride_ - kPadX;
  unsigned runs = 0;
  for (std::ptrdiff_t c = 0; c < width; ++c) runs += cells[c] & ~cells[c - 1] & 1u;
  return runs;
}

void GridCodec::find_run(std::uint32_t row, std::uint64_t column, std::uint64_t& begin,
                         std::uint64_t& end) const {
  const std::uint8_t* const cells = mask_.data() + cell_of(0, row);
  begin = column;
  while (cells[begin] == 0) ++begin;
  end = begin;
  while (cells[end] != 0) ++end;  // stops in the padding at the latest
}

void GridCodec::fit(PredictorFit& sums) {
  find_patterns();
  const std::ptrdiff_t up = stride_;
  for (const std::uint32_t cell : cells_) {
    const std::int64_t* const at = values_.data() + cell;
    sums.add(patterns_[cell], *at,
             {at[-1], at[-up], at[-up - 1], at[-up + 1], at[-2], at[-2 * up]});
  }
}

}  // namespace terrace::stream::store
