// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <string>
#include <string_view>
#include <system_error>

namespace terrace::stream {

/// Maximum number of characters that append_number() appends; the shortest form of a double has at
/// most 24.
inline constexpr std::size_t kMaxNumber = 32;

/// True if the decimal number in `text` is too small rather than too large. Requires that it is out
/// of the range of its floating-point type.
bool is_underflow(std::string_view text);

/// Parses the number that starts at `at`, correctly rounded to T (float or double); a leading '+'
/// is allowed. Returns the position after it, or null if the text is not a number or the number is
/// too large. Values that underflow become zero. Never reads at `end` or beyond; independent of the
/// locale.
template <class T>
const char* parse_real(const char* at, const char* end, T& value) {
  if (at != end && *at == '+') {
    ++at;
    if (at != end && (*at == '-' || *at == '+')) return nullptr;
  }
  const auto [rest, error] = std::from_chars(at, end, value);
  if (error == std::errc{}) return rest;
  if (error == std::errc::result_out_of_range &&
      is_underflow({at, static_cast<std::size_t>(rest - at)})) {
    value = *at == '-' ? -T{0} : T{0};
    return rest;
  }
  return nullptr;
}

/// Appends the shortest text that reads back as the same value.
template <class T>
void append_number(std::string& text, T value) {
  char digits[kMaxNumber];
  const auto result = std::to_chars(digits, digits + kMaxNumber, value);
  text.append(digits, result.ptr);
}

}  // namespace terrace::stream
