// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "mesh.hpp"

/// Which triangle of those with too great an error is next. Entries of triangles that have changed
/// stay in the queues and are recognised when their turn comes.

namespace terrace::tri::tin {

/// About the greatest error first: 4 buckets for each power of two, of which the last in is the
/// first out. As good as the exact order in what comes out, and several times as fast.
class ErrorBuckets {
 public:
  /// Errors below `least` are put on a level with it.
  explicit ErrorBuckets(float least) : base_(octave_quarter(least)) {
    buckets_.resize(octave_quarter(kHighest) - base_ + 1);
  }

  void push(float error, std::uint32_t triangle) {
    const std::size_t bucket = bucket_of(error);
    buckets_[bucket].push_back(triangle);
    top_ = std::max(top_, bucket + 1);
  }

  /// The next triangle, or kNone.
  std::uint32_t pop(const Triangles& triangles) {
    for (; top_ > 0; --top_) {
      auto& bucket = buckets_[top_ - 1];
      while (!bucket.empty()) {
        const std::uint32_t t = bucket.back();
        bucket.pop_back();
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

  std::size_t base_;
  std::size_t top_ = 0;  ///< buckets from here on are empty
  std::vector<std::vector<std::uint32_t>> buckets_;
};

/// Exactly the greatest error first; of equal ones the smallest number.
class ErrorHeap {
 public:
  explicit ErrorHeap(float) {}

  void push(float error, std::uint32_t triangle) {
    heap_.emplace_back(error, ~triangle);
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

}  // namespace terrace::tri::tin
