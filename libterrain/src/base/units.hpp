// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/message.hpp"

namespace terrace::terrain {

/// Parses all of `text` as a number with std::from_chars(). Returns nullopt if that fails.
template <class Number>
std::optional<Number> number_from(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Parses an amount of memory into bytes: "256M", "2G", "4096". K, M, G, T are powers of 1024, with
/// or without "B" or "iB"; without a suffix the unit is bytes. Throws: UsageError on anything else,
/// and beyond 2^63.
std::uint64_t parse_memory(std::string_view text);

/// Parses a count: "250000", "10k", "2.5M", "1G" (powers of 1000). Throws: UsageError.
std::uint64_t parse_count(std::string_view text);

struct ImageSize {
  std::uint64_t width = 0, height = 0;
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};
/// Parses "WxH", both positive. Throws: UsageError.
ImageSize parse_size(std::string_view text);

/// Parses all of `text` as a finite number. Throws: UsageError naming `what`.
double parse_number(std::string_view text, const stream::Message& what);

/// Parses comma-separated finite numbers. Throws: UsageError naming `what`.
std::vector<double> parse_numbers(std::string_view text, const stream::Message& what);

/// Formats a number with thousands separators: "12,345,678".
std::string with_commas(std::uint64_t value);
/// Formats a number with a noun, in the plural unless it is 1: "1 level", "12,345 tiles",
/// "2 vertices".
std::string counted(std::uint64_t number, std::string_view noun);
/// Formats a number with a noun and a verb that agrees with it: "1 sample is", "2 samples are".
std::string counted(std::uint64_t number, std::string_view noun, std::string_view verb_of_one,
                    std::string_view verb_of_more);
/// Formats an amount of memory: "3.2 GiB", "640 MiB", "12 bytes".
std::string readable_bytes(std::uint64_t bytes);
/// Formats a rate: "12.3 M/s", "45 k/s".
std::string readable_rate(double per_second);
/// Formats a duration: "1:02:03", "4:05", "0.8 s".
std::string readable_seconds(double seconds);
/// Returns the shortest text that reads back as the same double: "0.1", "1e+20", "nan".
std::string number_text(double value);
/// As number_text(), for messages: without an exponent from 1e-9 up to 1e15, as in "500000".
std::string plain_number(double value);
/// Formats a number with `digits` significant digits, but keeps all digits before the point:
/// "2.99", "1,834", "0.00012", "4345.68" (of 6), "nan". With 10 digits or more, as for coordinates,
/// it omits the commas.
std::string readable_number(double value, int digits = 3);
/// As readable_number() with 3 digits, but rounded up, so that the printed bound holds.
std::string readable_bound(double value);

}  // namespace terrace::terrain
