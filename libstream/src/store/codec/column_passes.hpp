// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

/// Passes over the values of a column before they are coded. Each takes as many values at once as
/// the processor has room for.

namespace terrace::stream::store {

/// Fills `differences` from the second on with those of neighbours in the column, less those of the
/// column before unless that is null. False if all values are one.
bool find_differences(const std::int64_t* values, const std::int64_t* beside,
                      std::int64_t* differences, std::uint32_t n);

/// The numbers that stand for n differences, and their classes.
void classify(const std::int64_t* differences, std::uint64_t* numbers, std::uint8_t* classes,
              std::uint32_t n);

/// Least and greatest value; none: low > high.
struct Extent {
  std::int64_t low = INT64_MAX, high = INT64_MIN;
};
Extent extent_of(std::span<const std::int64_t> values);

}  // namespace terrace::stream::store
