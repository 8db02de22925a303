// SPDX-License-Identifier: Apache-2.0
#include "base/units.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include <fmt/core.h>
#include <terrace/stream/unit_words.hpp>

#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Parses the leading number of `text`; `rest` is the remainder. Returns false without a number.
bool leading_number(std::string_view text, double& value, std::string_view& rest) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) return false;
  rest = text.substr(static_cast<std::size_t>(end - text.data()));
  return true;
}

/// Returns the power of the suffix letter in "kMGT" (0 without a letter), or -1.
int suffix_power(std::string_view letters) {
  if (letters.empty()) return 0;
  switch (letters.front()) {
    case 'k':
    case 'K':
      return 1;
    case 'm':
    case 'M':
      return 2;
    case 'g':
    case 'G':
      return 3;
    case 't':
    case 'T':
      return 4;
    default:
      return -1;
  }
}

double scaled(double value, double base, int power) {
  for (int i = 0; i < power; ++i) value *= base;
  return value;
}

constexpr double kTooLarge = 9.2e18;

std::string printed(const char* format, double value, const char* unit) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value, unit);
  return text.data();
}

}  // namespace

std::uint64_t parse_memory(std::string_view text) {
  double value = 0;
  std::string_view rest;
  if (leading_number(text, value, rest) && value >= 0) {
    const int power = suffix_power(rest);
    const std::string_view tail = power > 0 ? rest.substr(1) : rest;
    const bool known_tail = tail.empty() || tail == "B" || (power > 0 && tail == "iB");
    if (power >= 0 && known_tail && scaled(value, 1024, power) < kTooLarge) {
      return static_cast<std::uint64_t>(scaled(value, 1024, power));
    }
  }
  if (rest == "B" && value >= 0 && value < kTooLarge) return static_cast<std::uint64_t>(value);
  throw UsageError("'" + std::string(text) + "' is not an amount of memory; write 256M or 2G");
}

std::uint64_t parse_count(std::string_view text) {
  double value = 0;
  std::string_view rest;
  if (leading_number(text, value, rest) && value >= 0 && rest.size() <= 1) {
    const int power = suffix_power(rest);
    const double count = power < 0 ? -1 : scaled(value, 1000, power);
    if (count >= 0 && count < kTooLarge && count == std::floor(count)) {
      // Parse plain integers as such, because doubles are exact only up to 2^53.
      return number_from<std::uint64_t>(text).value_or(static_cast<std::uint64_t>(count));
    }
  }
  throw UsageError("'" + std::string(text) + "' is not a count; write 250000, 10k or 2.5M");
}

ImageSize parse_size(std::string_view text) {
  const std::size_t x = text.find_first_of("xX");
  if (x != std::string_view::npos) {
    const auto width = number_from<std::uint64_t>(text.substr(0, x));
    const auto height = number_from<std::uint64_t>(text.substr(x + 1));
    const auto good = [](auto side) { return side && *side > 0 && *side <= INT32_MAX; };
    if (good(width) && good(height)) return {*width, *height};
  }
  throw UsageError("'" + std::string(text) + "' is not a size; write WIDTHxHEIGHT, like 1600x1200");
}

double parse_number(std::string_view text, const stream::Message& what) {
  double value = 0;
  std::string_view rest;
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  if (!leading_number(text, value, rest) || !rest.empty()) {
    throw UsageError(stream::message("'{}' is not a number in {}", text, what));
  }
  return value;
}

std::vector<double> parse_numbers(std::string_view text, const stream::Message& what) {
  std::vector<double> numbers;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    numbers.push_back(parse_number(text.substr(start, comma - start), what));
    start = comma + 1;
  }
  return numbers;
}

std::string with_commas(std::uint64_t value) {
  const std::string digits = fmt::format("{}", value);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ',';
    text += digits[i];
  }
  return text;
}

std::string counted(std::uint64_t number, std::string_view noun) {
  return with_commas(number) + ' ' + stream::noun_for(number == 1, noun);
}

std::string counted(std::uint64_t number, std::string_view noun, std::string_view verb_of_one,
                    std::string_view verb_of_more) {
  return counted(number, noun) + ' ' + std::string(number == 1 ? verb_of_one : verb_of_more);
}

std::string readable_bytes(std::uint64_t bytes) {
  constexpr std::array<const char*, 5> kUnits{"bytes", "KiB", "MiB", "GiB", "TiB"};
  double value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 1000 && unit + 1 < kUnits.size()) {
    value /= 1024;
    ++unit;
  }
  return printed(unit == 0 || value >= 100 ? "%.0f %s" : "%.3g %s", value, kUnits[unit]);
}

std::string readable_rate(double per_second) {
  constexpr std::array<const char*, 4> kUnits{"/s", " k/s", " M/s", " G/s"};
  std::size_t unit = 0;
  while (per_second >= 999.5 && unit + 1 < kUnits.size()) {
    per_second /= 1000;
    ++unit;
  }
  return printed(per_second >= 99.95 ? "%.0f%s" : "%.3g%s", per_second, kUnits[unit]);
}

std::string readable_seconds(double seconds) {
  if (seconds < 60) return printed("%.1f %s", seconds, "s");
  const auto whole = static_cast<std::uint64_t>(seconds + 0.5);
  std::array<char, 64> text{};
  if (whole < 3600) {
    std::snprintf(text.data(), text.size(), "%d:%02d", static_cast<int>(whole / 60),
                  static_cast<int>(whole % 60));
  } else {
    std::snprintf(text.data(), text.size(), "%llu:%02d:%02d",
                  static_cast<unsigned long long>(whole / 3600), static_cast<int>(whole / 60 % 60),
                  static_cast<int>(whole % 60));
  }
  return text.data();
}

std::string readable_number(double value, int digits) {
  const double size = std::fabs(value);
  if (!(size < 1e15)) return printed("%.3g%s", value, "");
  std::array<char, 64> text{};
  if (size >= std::pow(10.0, digits) - 0.5) {
    std::snprintf(text.data(), text.size(), "%.0f", value);
  } else {
    std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  }
  const std::string plain = text.data();
  // Coordinates get no commas.
  const bool commas = digits < 10 && size >= 999.5 && plain.find_first_of(".e") == plain.npos;
  if (!commas) return plain;
  return (value < 0 ? "-" : "") + with_commas(static_cast<std::uint64_t>(std::llround(size)));
}

std::string readable_bound(double value) {
  if (!(value > 0.0) || !std::isfinite(value)) return readable_number(value);
  if (value >= 100.0) return readable_number(std::ceil(value));
  // The smallest number of 3 digits that is not below the value.
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 2.0);
  const double shorter = std::round(value / unit);
  // Numbers that differ only by rounding errors count as equal.
  const double kept = value <= shorter * unit * (1.0 + 1e-12) ? shorter : std::ceil(value / unit);
  return readable_number(kept * unit);
}

std::string number_text(double value) {
  std::array<char, 40> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} ? std::string(text.data(), end) : std::string("nan");
}

std::string plain_number(double value) {
  const double size = std::fabs(value);
  if (!(size >= 1e-9 && size < 1e15)) return number_text(value);
  std::array<char, 64> text{};
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  return error == std::errc{} ? std::string(text.data(), end) : number_text(value);
}

}  // namespace terrace::terrain
