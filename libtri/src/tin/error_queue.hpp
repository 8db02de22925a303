// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <terrace/base/portable_math.hpp>

#include "mesh.hpp"

/// Queues of the triangles whose error is too great. If a triangle changes, its entry stays in the
/// queue and is skipped when its turn comes.

namespace terrace::tri::tin {

/// One tile for all samples.
struct OneTile {
  static std::size_t count() { return 1; }
  static std::uint32_t of(std::uint32_t) { return 0; }
};

/// A priority queue with approximate order: 4 buckets per power of two, the greatest errors first,
/// last in, first out within a bucket. The meshes are as good as with the exact order, and it is
/// several times as fast.
///
/// Sorts each bucket by tiles when its turn comes, so that triangles close to each other in the
/// plane are also close in time and memory. `tiles.of(place)` is a number below `tiles.count()`.
template <class Tiles = OneTile>
class ErrorBuckets {
 public:
  /// Errors below `least` share its bucket.
  explicit ErrorBuckets(float least, Tiles tiles = {})
      : tiles_(tiles), base_(octave_quarter(least)) {
    buckets_.resize(octave_quarter(kHighest) - base_ + 1);
  }

  void push(const Triangle& triangle, std::uint32_t number) {
    const std::size_t bucket = bucket_of(triangle.error);
    buckets_[bucket].push_back(number);
    top_ = std::max(top_, bucket + 1);
  }

  /// The next triangle, or kNone if the queue is empty.
  std::uint32_t pop(const Triangles& triangles) {
    for (; top_ > 0; --top_) {
      auto& bucket = buckets_[top_ - 1];
      if (top_ < sorted_from_) {
        sorted_from_ = top_;
        if (tiles_.count() > 1 && bucket.size() > kWorthSorting) sort(triangles, bucket);
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
    return base::bit_cast<std::uint32_t>(std::max(error, 0.0F)) >> 21;
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

  void sort(const Triangles& triangles, std::vector<std::uint32_t>& bucket) {
    starts_.assign(tiles_.count() + 1, 0);
    tile_.clear();
    for (const std::uint32_t t : bucket) {
      const std::uint32_t tile = tiles_.of(triangles[t].place);
      tile_.push_back(tile);
      ++starts_[tile + 1];
    }
    for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
    sorted_.resize(bucket.size());
    for (std::size_t i = 0; i < bucket.size(); ++i) sorted_[starts_[tile_[i]]++] = bucket[i];
    bucket.swap(sorted_);
  }

  static constexpr std::size_t kWorthSorting = 256;
  Tiles tiles_;
  std::size_t base_;
  std::size_t top_ = 0;                                     ///< buckets from this one on are empty
  std::size_t sorted_from_ = static_cast<std::size_t>(-1);  ///< top_ of the last bucket sorted
  std::vector<std::uint32_t> starts_, tile_, sorted_;
  std::vector<std::vector<std::uint32_t>> buckets_;
};

/// A priority queue with exact order: the greatest error first, of equal errors the smallest
/// number.
class ErrorHeap {
 public:
  void push(const Triangle& triangle, std::uint32_t number) {
    heap_.emplace_back(triangle.error, ~number);
    std::push_heap(heap_.begin(), heap_.end());
  }

  std::uint32_t pop(const Triangles& triangles) {
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

/// Processes samples in parts of `part_size` consecutive numbers, one part after another. If the
/// samples of a part are close to each other in the plane, it and its triangles stay in the cache.
/// The result is as good as if all parts were handled together.
class ErrorParts {
 public:
  ErrorParts(float least, std::size_t samples, std::size_t part_size)
      : queue_(least),
        part_size_(std::max<std::size_t>(part_size, 1)),
        later_parts_(samples / part_size_ + 1) {}

  void push(const Triangle& triangle, std::uint32_t number) {
    const std::size_t part = triangle.place / part_size_;
    if (part > part_) {
      later_parts_[part].push_back(number);
    } else {
      queue_.push(triangle, number);
    }
  }

  std::uint32_t pop(const Triangles& triangles) {
    for (;;) {
      const std::uint32_t t = queue_.pop(triangles);
      if (t != kNone) return t;
      while (part_ < later_parts_.size() && later_parts_[part_].empty()) ++part_;
      if (part_ == later_parts_.size()) return kNone;
      for (const std::uint32_t later : later_parts_[part_])
        if (triangles[later].error > 0) queue_.push(triangles[later], later);
      later_parts_[part_] = {};
    }
  }

 private:
  ErrorBuckets<> queue_;
  std::size_t part_size_;
  std::size_t part_ = 0;  ///< the current part
  /// The triangles of later parts. Some of them may have changed since.
  std::vector<std::vector<std::uint32_t>> later_parts_;
};

}  // namespace terrace::tri::tin
