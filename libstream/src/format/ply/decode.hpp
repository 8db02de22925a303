// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// The value of an integer type at `raw`; negative ones keep their sign, uint64 wraps to negative.
std::int64_t to_integer(const std::byte* raw, ScalarType type);

/// Reads the number that starts at `at` as `type` and stores it at `raw`. Integers may be written
/// like "3.0". Returns the position after it, or null if the text up to the next blank or `end` is
/// not a number in that type's range.
const char* parse_scalar(const char* at, const char* end, ScalarType type, std::byte* raw);

}  // namespace terrace::stream
