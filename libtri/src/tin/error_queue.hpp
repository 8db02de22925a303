// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "mesh.hpp"

/// Queues of the triangles whose error is too great. If a triangle changes, its entry stays in the
/// queue and is skipped when its turn comes.

namespace terrace::tri::tin {

/// Returns approximately the greatest error first: 4 buckets per power of two, last in, first out.
/// The meshes are as good as with the exact order, and it is several times as fast.
class ErrorBuckets {
 public:
  /// Errors below `least` share its bucket.
  explicit ErrorBuckets(float least) : base_(octave_quarter(least)) {
    buckets_.resize(octave_quarter(kHighest) - base_ + 1);
  }

  void push(float error, std::uint32_t triangle) {
    const std::size_t bucket = bucket_of(error);
    buckets_[bucket].push_back(triangle);
    top_ = std::max(top_, bucket + 1);
  }

  /// The next triangle, or kNone if the queue is empty.
  std::uint32_t pop(const Triangles& triangles) {
    return pop(triangles, 1, [](const Triangle&) { return 0; });
  }

  /// The same, but sorts each bucket by tiles when its turn comes, so that triangles close to each
  /// other in the plane are also close in time and memory. `tile_of(triangle)` is a number below
  /// `tiles`.
  template <class TileOf>
  std::uint32_t pop(const Triangles& triangles, std::size_t tiles, const TileOf& tile_of) {
    for (; top_ > 0; --top_) {
      auto& bucket = buckets_[top_ - 1];
      if (top_ < sorted_from_) {
        sorted_from_ = top_;
        if (tiles > 1 && bucket.size() > kWorthSorting) sort(triangles, tiles, tile_of, bucket);
      }
      while (!bucket.empty()) {
        const std::uint32_t t = bucket.back();
        bucket.pop_back();
        fetch_soon(triangles, bucket);
        if (triangles[t].error > 0 && bucket_of(triangles[t].error) == top_ - 1) return t;
      }
    }
    return kNone;
  }

 private:
  static constexpr float kHighest = __builtin_inff();
  static std::size_t octave_quarter(float error) {
    return std::bit_cast<std::uint32_t>(std::max(error, 0.0F)) >> 21;
  }
  std::size_t bucket_of(float error) const {
    return std::max(octave_quarter(error), base_) - base_;
  }

  /// Prefetches the triangles that are likely to be next, and their neighbours, into the cache.
  static void fetch_soon(const Triangles& triangles, const std::vector<std::uint32_t>& bucket) {
    const std::size_t size = bucket.size();
    if (size < 8) return;
    __builtin_prefetch(&triangles[bucket[size - 8]]);
    for (const std::uint32_t next : triangles[bucket[size - 4]].next)
      if (next != kNone) __builtin_prefetch(&triangles[next]);
  }

  template <class TileOf>
  void sort(const Triangles& triangles, std::size_t tiles, const TileOf& tile_of,
            std::vector<std::uint32_t>& bucket) {
    starts_.assign(tiles + 1, 0);
    tile_.clear();
    for (const std::uint32_t t : bucket) {
      const auto tile = static_cast<std::uint32_t>(tile_of(triangles[t]));
      tile_.push_back(tile);
      ++starts_[tile + 1];
    }
    for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
    sorted_.resize(bucket.size());
    for (std::size_t i = 0; i < bucket.size(); ++i) sorted_[starts_[tile_[i]]++] = bucket[i];
    bucket.swap(sorted_);
  }

  static constexpr std::size_t kWorthSorting = 256;
  std::size_t base_;
  std::size_t top_ = 0;                                     ///< buckets from this one on are empty
  std::size_t sorted_from_ = static_cast<std::size_t>(-1);  ///< top_ of the last bucket sorted
  std::vector<std::uint32_t> starts_, tile_, sorted_;
  std::vector<std::vector<std::uint32_t>> buckets_;
};

/// Returns exactly the greatest error first; of equal errors the smallest number first.
class ErrorHeap {
 public:
  explicit ErrorHeap(float) {}

  void push(float error, std::uint32_t triangle) {
    heap_.emplace_back(error, ~triangle);
    std::push_heap(heap_.begin(), heap_.end());
  }

  template <class TileOf>
  std::uint32_t pop(const Triangles& triangles, std::size_t, const TileOf&) {
    while (!heap_.empty()) {
      const auto [error, inverted] = heap_.front();
      std::pop_heap(heap_.begin(), heap_.end());
      heap_.pop_back();
      if (triangles[~inverted].error == error) return ~inverted;
    }
    return kNone;
  }

 private:
  std::vector<std::pair<float, std::uint32_t>> heap_;
};

}  // namespace terrace::tri::tin
