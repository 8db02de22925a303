// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

/// Passes over the values of a column before they are coded. They are vectorised.

namespace terrace::stream::store {

/// Sets differences[i], from i = 1 on, to values[i] - values[i - 1], minus the same difference of
/// the preceding column unless `beside` is null. Returns false if all values are equal.
bool find_differences(const std::int64_t* values, const std::int64_t* beside,
                      std::int64_t* differences, std::uint32_t n);

/// Sets the numbers that represent n differences, and their classes.
void classify(const std::int64_t* differences, std::uint64_t* numbers, std::uint8_t* classes,
              std::uint32_t n);

/// Lowest and highest value; low > high if there are no values.
struct Extent {
  std::int64_t low = INT64_MAX, high = INT64_MIN;
};
Extent extent_of(std::span<const std::int64_t> values);

}  // namespace terrace::stream::store
