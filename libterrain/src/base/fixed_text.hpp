// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
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
  /// Returns a writer with enough decimals for nine significant digits of `largest`, from 3 to 15.
  static FixedText for_numbers_up_to(double largest) {
    int decimals = 8;
    for (double bound = 10; bound <= largest && decimals > 3; bound *= 10) --decimals;
    for (double bound = 1; bound > largest && decimals < 15; bound /= 10) ++decimals;
    return FixedText(decimals);
  }

  /// The most bytes that write() produces.
  static constexpr std::size_t kLongest = 40;

  /// Appends nothing for NaN. Numbers with too many digits for 64 bits get the shortest text that
  /// reads back the same.
  void append(std::string& text, double value) const {
    char digits[kLongest];
    text.append(digits, write(digits, value));
  }
  /// Writes the same text at `at` and returns its end.
  char* write(char* at, double value) const {
    if (std::isnan(value)) return at;
    const double scaled = rounded(std::abs(value) * static_cast<double>(power_));
    if (!(scaled < 9e18)) return std::to_chars(at, at + kLongest, value).ptr;
    const auto number = static_cast<std::uint64_t>(scaled);
    if (value < 0 && number != 0) *at++ = '-';
    const std::uint64_t integer = number / power_;
    at = std::to_chars(at, at + kLongest - 1, integer).ptr;
    if (decimals_ == 0) return at;
    *at++ = '.';
    std::uint64_t fraction = number - integer * power_;
    int digits = decimals_;
    for (; digits >= 2; digits -= 2, fraction /= 100) {
      const std::size_t pair = 2 * (fraction % 100);
      at[digits - 2] = kPairs[pair];
      at[digits - 1] = kPairs[pair + 1];
    }
    if (digits == 1) at[0] = static_cast<char>('0' + fraction);
    return at + decimals_;
  }

 private:
  /// Rounds to the nearest integer, halves to even, without calling the C library.
  static double rounded(double value) {
    constexpr double kWhole = 0x1p52;  ///< doubles from here on are integers
    return value < kWhole ? value + kWhole - kWhole : value;
  }
  static constexpr std::array<char, 200> kPairs = [] {
    std::array<char, 200> pairs{};
    for (std::size_t i = 0; i < 100; ++i) {
      pairs[2 * i] = static_cast<char>('0' + i / 10);
      pairs[2 * i + 1] = static_cast<char>('0' + i % 10);
    }
    return pairs;
  }();

  int decimals_;
  std::uint64_t power_ = 1;
};

}  // namespace terrace::terrain
