// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::terrain {

/// The number that all of `text` is, as std::from_chars() reads it; nullopt if it is not one.
template <class Number>
std::optional<Number> number_from(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Bytes of "256M", "2G", "4096" (K, M, G, T are powers of 1024; "MB", "MiB" mean the same; without
/// a suffix bytes). Throws: UsageError on anything else, and beyond 2^63.
std::uint64_t parse_memory(std::string_view text);

/// A count of things: "250000", "10k", "2.5M", "1G" (powers of 1000). Throws: UsageError.
std::uint64_t parse_count(std::string_view text);

struct ImageSize {
  std::uint64_t width = 0, height = 0;
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};
/// "WxH", both positive. Throws: UsageError.
ImageSize parse_size(std::string_view text);

/// The whole of `text` as a finite number. Throws: UsageError naming `what`.
double parse_number(std::string_view text, std::string_view what);

/// Numbers separated by commas, all finite. Throws: UsageError naming `what`.
std::vector<double> parse_numbers(std::string_view text, std::string_view what);

/// "12,345,678".
std::string with_commas(std::uint64_t value);
/// "1 level", "12,345 tiles", "2 vertices": a number and what is counted.
std::string counted(std::uint64_t number, std::string_view noun);
/// "1 sample lies", "2 samples lie".
std::string counted(std::uint64_t number, std::string_view noun, std::string_view verb_of_one,
                    std::string_view verb_of_more);
/// "3.2 GiB", "640 MiB", "12 bytes".
std::string readable_bytes(std::uint64_t bytes);
/// "12.3 M/s", "45 k/s": a rate for people.
std::string readable_rate(double per_second);
/// "1:02:03", "4:05", "0.8 s".
std::string readable_seconds(double seconds);
/// The shortest text that reads back as the same double: "0.1", "1e+20", "nan".
std::string number_text(double value);
/// The same for people: without an exponent from 1e-9 up to 1e15, as in "500000".
std::string plain_number(double value);
/// A number for people, of so many digits, but never without those before the point: "2.99",
/// "1,834", "0.00012", "4345.68" (of 6), "nan". Of 10 digits, as coordinates have, no commas.
std::string readable_number(double value, int digits = 3);
/// The same of 3 digits, rounded up, so that the printed bound holds.
std::string readable_bound(double value);

}  // namespace terrace::terrain
