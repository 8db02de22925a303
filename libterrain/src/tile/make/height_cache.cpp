// SPDX-License-Identifier: Apache-2.0
#include "tile/make/height_cache.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

namespace terrace::terrain {
HeightCache::HeightCache(const stream::Store& store, std::uint64_t bytes)
    : columns_(static_cast<std::int64_t>(store.schema().columns)),
      rows_(static_cast<std::int64_t>(store.schema().rows)),
      across_((columns_ + kSide - 1) / kSide),
      floats_(StoreWindow(store).float_is_exact()),
      most_(static_cast<std::size_t>(bytes / (static_cast<std::uint64_t>(kSide * kSide) *
                                              (floats_ ? sizeof(float) : sizeof(double))))) {}

HeightCache::Squares::iterator HeightCache::use(StoreWindow& reader, std::int64_t across,
                                                std::int64_t down) {
  const std::int64_t number = down * across_ + across;
  std::unique_lock lock(mutex_);
  for (auto found = by_number_.find(number); found != by_number_.end();
       found = by_number_.find(number)) {
    const Squares::iterator square = found->second;
    if (square->ready) {
      squares_.splice(squares_.begin(), squares_, square);
      ++square->users;
      return square;
    }
    read_.wait(lock);
  }
  // Reuse the memory of the least recently used square.
  Squares::iterator square = squares_.end();
  if (squares_.size() >= most_) {
    const auto unused = [](const Square& other) { return other.users == 0; };
    const auto last = std::find_if(squares_.rbegin(), squares_.rend(), unused);
    if (last != squares_.rend()) square = std::prev(last.base());
  }
  if (square == squares_.end()) {
    square = squares_.emplace(squares_.begin());
  } else {
    by_number_.erase(square->number);
    squares_.splice(squares_.begin(), squares_, square);
  }
  square->number = number;
  square->users = 1;
  square->ready = false;
  by_number_[number] = square;
  lock.unlock();
  try {
    const LatticeWindow window{across * kSide, down * kSide, kSide, kSide};
    if (floats_) {
      square->floats.resize(window.size());
      reader.heights(window, std::span<float>(square->floats));
    } else {
      square->doubles.resize(window.size());
      reader.heights(window, std::span<double>(square->doubles));
    }
  } catch (...) {
    // Removes the square, so that waiting threads read it again and fail themselves.
    lock.lock();
    by_number_.erase(number);
    squares_.erase(square);
    read_.notify_all();
    throw;
  }
  lock.lock();
  square->ready = true;
  read_.notify_all();
  return square;
}

void HeightCache::release(Squares::iterator square) {
  const std::lock_guard lock(mutex_);
  if (--square->users > 0 || squares_.size() <= most_) return;
  by_number_.erase(square->number);
  squares_.erase(square);
}

bool HeightCache::has_all(const LatticeWindow& window) const {
  const std::lock_guard lock(mutex_);
  for (std::int64_t down = window.row / kSide; down * kSide < window.row + window.rows; ++down) {
    for (std::int64_t across = window.column / kSide;
         across * kSide < window.column + window.columns; ++across) {
      if (!by_number_.contains(down * across_ + across)) return false;
    }
  }
  return true;
}

void HeightCache::heights(StoreWindow& reader, const LatticeWindow& window, std::span<double> out) {
  assert(out.size() == window.size());
  if (window.size() <= kFew && !has_all(window)) {
    reader.heights(window, out);
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
      const Squares::iterator from = use(reader, across, down);
      const std::int64_t first = std::max(left, across * kSide);
      const std::int64_t last = std::min(right, (across + 1) * kSide);
      const std::int64_t end = std::min(bottom, (down + 1) * kSide);
      for (std::int64_t row = std::max(top, down * kSide); row < end; ++row) {
        const std::int64_t at = (row - down * kSide) * kSide + first - across * kSide;
        const auto to = out.begin() + (row - window.row) * window.columns + first - window.column;
        if (floats_) {
          std::copy_n(from->floats.begin() + at, last - first, to);
        } else {
          std::copy_n(from->doubles.begin() + at, last - first, to);
        }
      }
      release(from);
    }
  }
}

}  // namespace terrace::terrain
