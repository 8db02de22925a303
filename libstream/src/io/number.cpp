// SPDX-License-Identifier: Apache-2.0
#include "io/number.hpp"

#include <cstdint>

namespace terrace::stream {

bool is_underflow(std::string_view text) {
  // The decimal exponent of the first nonzero digit: negative if the number is too small.
  std::int64_t exponent = 0;
  bool point = false, digits = false;
  std::size_t i = 0;
  for (; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '.') {
      point = true;
    } else if (c >= '0' && c <= '9') {
      digits = digits || c != '0';
      if (digits && !point) ++exponent;
      if (!digits && point) --exponent;
    } else if (c == 'e' || c == 'E') {
      break;
    }
  }
  if (i + 1 < text.size()) {
    ++i;
    const bool negative = text[i] == '-';
    if (negative || text[i] == '+') ++i;
    std::int64_t written = 0;
    for (; i < text.size() && written < (std::int64_t{1} << 40); ++i) {
      written = written * 10 + (text[i] - '0');
    }
    exponent += negative ? -written : written;
  }
  return exponent < 0;
}

}  // namespace terrace::stream
