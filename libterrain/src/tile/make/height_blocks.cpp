// SPDX-License-Identifier: Apache-2.0
#include "tile/make/height_blocks.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

#include "base/digest.hpp"
#include "base/parallel.hpp"
#include "base/store_checks.hpp"

namespace terrace::terrain {
namespace {

constexpr std::int64_t kMaxBlocks = std::int64_t{1} << 20;
/// The number of clusters that a thread reads at a time.
constexpr std::uint64_t kClustersReadAtOnce = 64;
constexpr std::size_t kMutexes = 64;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Round outward if a float cannot represent the height.
float rounded_down(double height) {
  const auto near = static_cast<float>(height);
  return static_cast<double>(near) > height ? std::nextafter(near, -kInfinity) : near;
}
float rounded_up(double height) {
  const auto near = static_cast<float>(height);
  return static_cast<double>(near) < height ? std::nextafter(near, kInfinity) : near;
}

std::uint64_t sample_digest(std::uint64_t place, double height) {
  Digest digest;
  digest.add(place);
  digest.add(height);
  return digest.value();
}

}  // namespace

HeightBlocks::HeightBlocks(const stream::Store& store, unsigned threads)
    : columns_(static_cast<std::int64_t>(store.schema().columns)),
      rows_(static_cast<std::int64_t>(store.schema().rows)) {
  const auto count = [this](std::int64_t samples) { return (samples + side_ - 1) / side_; };
  while (count(columns_) * count(rows_) > kMaxBlocks) side_ *= 2;
  across_ = count(columns_);
  down_ = count(rows_);
  const auto blocks = static_cast<std::size_t>(across_ * down_);
  blocks_.assign(blocks, {kInfinity, -kInfinity});
  digests_.assign(blocks, 0);
  samples_.assign(blocks, 0);
  std::array<std::mutex, kMutexes> mutexes;
  std::atomic<std::uint64_t> points = 0;
  for (unsigned level = 0; level <= store.top(); ++level) {
    const std::uint64_t clusters = store.levels()[level].clusters;
    const std::uint64_t pieces = (clusters + kClustersReadAtOnce - 1) / kClustersReadAtOnce;
    parallel_for(pieces, threads, [&](std::size_t piece) {
      const std::uint64_t end = std::min((piece + 1) * kClustersReadAtOnce, clusters);
      stream::ClusterPoints cluster;
      for (std::uint64_t k = piece * kClustersReadAtOnce; k < end; ++k) {
        const stream::ClusterId id = stream::cluster_id(level, k);
        points += store.record(id).points;
        if (!store.may_match(id)) continue;
        store.read(id, cluster);
        add(store.schema().coordinates[2], cluster, mutexes);
      }
    });
  }
  need_all_points(store, 0, points);
}

void HeightBlocks::add(const stream::Channel& channel, const stream::ClusterPoints& cluster,
                       std::span<std::mutex> mutexes) {
  const auto shift = std::countr_zero(static_cast<std::uint64_t>(side_));
  // Accumulates a run of samples in one block.
  std::int64_t x = -1, y = -1;
  Block range{kInfinity, -kInfinity};
  std::uint64_t digest = 0;
  std::uint32_t samples = 0;
  const auto put = [&] {
    if (samples == 0) return;
    const auto at = static_cast<std::size_t>(y * across_ + x);
    const std::lock_guard lock(mutexes[static_cast<std::size_t>(y) % mutexes.size()]);
    blocks_[at].low = std::min(blocks_[at].low, range.low);
    blocks_[at].high = std::max(blocks_[at].high, range.high);
    // A sum, because samples come in the order of their clusters.
    digests_[at] += digest;
    samples_[at] += samples;
  };
  for (std::size_t i = 0; i < cluster.size(); ++i) {
    if (!cluster.match(i)) continue;
    const stream::Point3& p = cluster.positions[i];
    const auto column = static_cast<std::int64_t>(p[0]), row = static_cast<std::int64_t>(p[1]);
    if (column >> shift != x || row >> shift != y) {
      put();
      x = column >> shift;
      y = row >> shift;
      range = {kInfinity, -kInfinity};
      digest = 0;
      samples = 0;
    }
    const double height = p[2] * channel.scale + channel.offset;
    range.low = std::min(range.low, rounded_down(height));
    range.high = std::max(range.high, rounded_up(height));
    digest += sample_digest(static_cast<std::uint64_t>(row * columns_ + column), height);
    ++samples;
  }
  put();
}

HeightBlocks::Blocks HeightBlocks::blocks_of(const LatticeWindow& window) const {
  const std::int64_t right = std::min(window.column + window.columns, columns_);
  const std::int64_t bottom = std::min(window.row + window.rows, rows_);
  return {std::max<std::int64_t>(window.column, 0) / side_,
          std::max<std::int64_t>(window.row, 0) / side_, (right + side_ - 1) / side_,
          (bottom + side_ - 1) / side_};
}

std::uint64_t HeightBlocks::digest(const LatticeWindow& window) const {
  const Blocks part = blocks_of(window);
  Digest digest;
  for (const std::int64_t side : {part.x0, part.y0, part.x1, part.y1}) {
    digest.add(static_cast<std::uint64_t>(side));
  }
  for (std::int64_t y = part.y0; y < part.y1; ++y) {
    for (std::int64_t x = part.x0; x < part.x1; ++x) {
      digest.add(digests_[static_cast<std::size_t>(y * across_ + x)]);
    }
  }
  return digest.value();
}

bool HeightBlocks::is_complete(const LatticeWindow& window) const {
  const Blocks part = blocks_of(window);
  for (std::int64_t y = part.y0; y < part.y1; ++y) {
    for (std::int64_t x = part.x0; x < part.x1; ++x) {
      if (!is_complete(x, y)) return false;
    }
  }
  return true;
}

std::optional<HeightBlocks::Range> HeightBlocks::range(const LatticeWindow& window) const {
  const Blocks part = blocks_of(window);
  Block all{kInfinity, -kInfinity};
  for (std::int64_t y = part.y0; y < part.y1; ++y) {
    for (std::int64_t x = part.x0; x < part.x1; ++x) {
      all.low = std::min(all.low, at(x, y).low);
      all.high = std::max(all.high, at(x, y).high);
    }
  }
  if (all.low > all.high) return std::nullopt;
  return Range{all.low, all.high};
}

std::optional<LatticeWindow> HeightBlocks::some_block_within(const LatticeWindow& window) const {
  const auto up = [this](std::int64_t from) {
    return (std::max<std::int64_t>(from, 0) + side_ - 1) / side_;
  };
  const std::int64_t right = window.column + window.columns, bottom = window.row + window.rows;
  const std::int64_t x0 = up(window.column), y0 = up(window.row);
  // Start in the middle, where blocks are least likely to be at the border.
  const std::int64_t x1 = std::min((right - x0 * side_) / side_ + x0, across_);
  const std::int64_t y1 = std::min((bottom - y0 * side_) / side_ + y0, down_);
  const std::int64_t width = x1 - x0, height = y1 - y0;
  for (std::int64_t i = 0; i < height; ++i) {
    const std::int64_t y = y0 + (i + height / 2) % height;
    for (std::int64_t j = 0; j < width; ++j) {
      const std::int64_t x = x0 + (j + width / 2) % width;
      if (at(x, y).low > at(x, y).high) continue;
      return rectangle(x, y);
    }
  }
  return std::nullopt;
}
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
  for (auto entry = by_number_.find(number); entry != by_number_.end();
       entry = by_number_.find(number)) {
    const Squares::iterator square = entry->second;
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
