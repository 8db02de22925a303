// SPDX-License-Identifier: Apache-2.0
#include "base/decimal_multiples.hpp"

#include <array>
#include <charconv>
#include <string_view>

namespace terrace::terrain {

DecimalMultiples::DecimalMultiples(double step) : step_(step), digits_(step) {
  // The shortest text of the step: digits with a point after the first, then a power of ten.
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), step, std::chars_format::scientific)
          .ptr;
  const std::string_view written(text.data(), static_cast<std::size_t>(end - text.data()));
  const std::size_t e = written.find('e');
  if (e == std::string_view::npos) return;
  int exponent = 0;
  const std::size_t power = e + (written[e + 1] == '+' ? 2 : 1);
  std::from_chars(written.data() + power, end, exponent);
  double digits = 0;
  for (const char c : written.substr(0, e)) {
    if (c == '.') continue;
    digits = 10 * digits + (c - '0');
  }
  const auto decimals = static_cast<int>(e > 1 ? e - 2 : 0) - exponent;
  constexpr int kExactPower = 22;  // the largest power of ten that a double holds exactly
  if (decimals <= 0 || decimals > kExactPower || digits > kExact) return;
  digits_ = digits;
  for (int i = 0; i < decimals; ++i) power_ *= 10;
}

}  // namespace terrace::terrain
