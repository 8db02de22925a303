// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>

namespace terrace::terrain {

/// Appends numbers with a fixed number of decimals, several times faster than printf.
class FixedText {
 public:
  /// decimals: 0 to 15.
  explicit FixedText(int decimals) : decimals_(decimals) {
    for (int i = 0; i < decimals; ++i) power_ *= 10;
  }
  /// Enough decimals for nine significant digits of `largest`, at least 3 and at most 15.
  static FixedText for_numbers_up_to(double largest) {
    int decimals = 8;
    for (double bound = 10; bound <= largest && decimals > 3; bound *= 10) --decimals;
    for (double bound = 1; bound > largest && decimals < 15; bound /= 10) ++decimals;
    return FixedText(decimals);
  }

  /// Empty for NaN. Numbers with too many digits for 64 bits get their shortest text that reads
  /// back the same.
  void append(std::string& text, double value) const {
    if (std::isnan(value)) return;
    char digits[40];
    const double scaled = std::nearbyint(std::abs(value) * static_cast<double>(power_));
    if (!(scaled < 9e18)) {
      text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
      return;
    }
    const auto number = static_cast<std::uint64_t>(scaled);
    char* at = digits;
    if (value < 0 && number != 0) *at++ = '-';
    at = std::to_chars(at, digits + sizeof digits, number / power_).ptr;
    if (decimals_ > 0) {
      *at++ = '.';
      std::uint64_t rest = number % power_;
      for (int i = decimals_; i-- > 0;) {
        at[i] = static_cast<char>('0' + rest % 10);
        rest /= 10;
      }
      at += decimals_;
    }
    text.append(digits, at);
  }

 private:
  int decimals_;
  std::uint64_t power_ = 1;
};

}  // namespace terrace::terrain
