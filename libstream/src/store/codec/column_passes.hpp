// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

/// Passes over the values of a column before they are coded. They are vectorised.

namespace terrace::stream::store {

/// Sets differences[i] to values[i] - values[i - 1] for 1 <= i < n. Also subtracts the same
/// difference of the preceding column, `beside`, unless that is null. Returns false if all values
/// are equal.
bool find_differences(const std::int64_t* values, const std::int64_t* beside,
                      std::int64_t* differences, std::uint32_t n);

/// Zigzag-encodes n differences into `numbers`, and sets the size class of each in `classes`.
void classify(const std::int64_t* differences, std::uint64_t* numbers, std::uint8_t* classes,
              std::uint32_t n);

/// Lowest and highest value; low > high if there are no values.
struct Extent {
  std::int64_t low = INT64_MAX, high = INT64_MIN;
};
Extent extent_of(std::span<const std::int64_t> values);

}  // namespace terrace::stream::store
