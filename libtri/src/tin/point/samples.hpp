// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pool.hpp"
#include "terrace/tri/point_tin.hpp"
#include "tin/mesh.hpp"

namespace terrace::tri::tin::points {

inline constexpr std::uint32_t kOutside = 0xFFFFFFFEu;
inline constexpr std::uint32_t kIsVertex = 0xFFFFFFFDu;
inline constexpr std::uint32_t kUnlisted = 0xFFFFFFFCu;

/// Products of coordinates below this do not overflow.
inline constexpr double kLargest = 1e100;

/// A sample as a member of its triangle's list. It takes half a cache line, so following the list
/// also loads the values to measure.
struct Sample {
  double x;
  double y;
  double z;
  std::uint32_t next;  ///< next in the list, kNone at its end; or why it is not listed
  /// The caller's number, with kStuck set if it cannot become a vertex.
  std::uint32_t id;
};
inline constexpr std::uint32_t kStuck = 0x80000000u;
inline bool stuck(const Sample& sample) { return (sample.id & kStuck) != 0; }
inline std::uint32_t number(const Sample& sample) { return sample.id & ~kStuck; }

struct Samples {
  /// In the order of a curve, so that consecutive samples are close to each other. Every position
  /// occurs once, or with kAll twice if heights differ.
  Pool<Sample> all;
  std::size_t duplicates = 0;
  double duplicate_range = 0;  ///< the largest difference between heights at one position
};

/// Checks, sorts and merges; throws as point_tin() does.
Samples take_samples(std::span<const double> x, std::span<const double> y,
                     std::span<const double> z, PointDuplicates duplicates);

}  // namespace terrace::tri::tin::points
