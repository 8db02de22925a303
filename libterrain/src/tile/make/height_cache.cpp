// SPDX-License-Identifier: Apache-2.0
#include "tile/make/height_cache.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

namespace terrace::terrain {
namespace {

constexpr std::uint64_t kDecodedBytes = std::uint64_t{8} << 20;

}  // namespace

HeightCache::HeightCache(const stream::Store& store, std::uint64_t bytes)
    : reader_(store, kDecodedBytes),
      columns_(static_cast<std::int64_t>(store.schema().columns)),
      rows_(static_cast<std::int64_t>(store.schema().rows)),
      across_((columns_ + kSide - 1) / kSide),
      floats_(reader_.float_is_exact()),
      most_(static_cast<std::size_t>(bytes / (static_cast<std::uint64_t>(kSide * kSide) *
                                              (floats_ ? sizeof(float) : sizeof(double))))) {}

const HeightCache::Square& HeightCache::square(std::int64_t across, std::int64_t down) {
  const std::int64_t number = down * across_ + across;
  if (const auto found = by_number_.find(number); found != by_number_.end()) {
    squares_.splice(squares_.begin(), squares_, found->second);
    return squares_.front();
  }
  // The one not used for longest lends its memory. Until the new one is whole it is in no map, so
  // damage leaves nothing behind.
  Squares fresh;
  if (squares_.size() >= most_ && !squares_.empty()) {
    by_number_.erase(squares_.back().number);
    fresh.splice(fresh.begin(), squares_, std::prev(squares_.end()));
  } else {
    fresh.emplace_front();
  }
  Square& made = fresh.front();
  made.number = number;
  const LatticeWindow window{across * kSide, down * kSide, kSide, kSide};
  if (floats_) {
    made.floats.resize(window.size());
    reader_.heights(window, std::span<float>(made.floats));
  } else {
    made.doubles.resize(window.size());
    reader_.heights(window, std::span<double>(made.doubles));
  }
  squares_.splice(squares_.begin(), fresh);
  by_number_[number] = squares_.begin();
  return made;
}

bool HeightCache::has_all(const LatticeWindow& window) const {
  for (std::int64_t down = window.row / kSide; down * kSide < window.row + window.rows; ++down) {
    for (std::int64_t across = window.column / kSide;
         across * kSide < window.column + window.columns; ++across) {
      if (!by_number_.contains(down * across_ + across)) return false;
    }
  }
  return true;
}

void HeightCache::heights(const LatticeWindow& window, std::span<double> out) {
  assert(out.size() == window.size());
  if (window.size() <= kFew && !has_all(window)) {
    reader_.heights(window, out);
    return;
  }
  const std::int64_t left = std::max<std::int64_t>(window.column, 0);
  const std::int64_t top = std::max<std::int64_t>(window.row, 0);
  const std::int64_t right = std::min(window.column + window.columns, columns_);
  const std::int64_t bottom = std::min(window.row + window.rows, rows_);
  const bool inside = left == window.column && top == window.row &&
                      right == window.column + window.columns && bottom == window.row + window.rows;
  if (!inside) std::fill(out.begin(), out.end(), std::numeric_limits<double>::quiet_NaN());
  if (left >= right || top >= bottom) return;
  for (std::int64_t down = top / kSide; down * kSide < bottom; ++down) {
    for (std::int64_t across = left / kSide; across * kSide < right; ++across) {
      const Square& from = square(across, down);
      const std::int64_t first = std::max(left, across * kSide);
      const std::int64_t last = std::min(right, (across + 1) * kSide);
      const std::int64_t end = std::min(bottom, (down + 1) * kSide);
      for (std::int64_t row = std::max(top, down * kSide); row < end; ++row) {
        const std::int64_t at = (row - down * kSide) * kSide + first - across * kSide;
        const auto to = out.begin() + (row - window.row) * window.columns + first - window.column;
        if (floats_) {
          std::copy_n(from.floats.begin() + at, last - first, to);
        } else {
          std::copy_n(from.doubles.begin() + at, last - first, to);
        }
      }
    }
  }
}

}  // namespace terrace::terrain
