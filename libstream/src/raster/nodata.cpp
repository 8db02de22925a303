// SPDX-License-Identifier: Apache-2.0
#include "raster/nodata.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>
#include <system_error>
#include <type_traits>

#include "with_type.hpp"

namespace terrace::stream {
namespace {

template <class T>
std::optional<T> parse_integer(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Parses the number at the start of `text`. from_chars also reads "nan" and "inf" in any case; old
/// C libraries of Windows print the other spellings.
std::optional<double> leading_number(std::string_view text) {
  if (text.find(".#QNAN") != text.npos || text.find(".#SNAN") != text.npos ||
      text.find(".#IND") != text.npos) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  if (text.find(".#INF") != text.npos) {
    const double infinity = std::numeric_limits<double>::infinity();
    return text.starts_with('-') ? -infinity : infinity;
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::invalid_argument) return std::nullopt;
  if (error == std::errc::result_out_of_range) {
    // Out of the range of doubles, so taken for infinite or zero.
    const bool tiny =
        text.find("e-") != std::string_view::npos || text.find("E-") != std::string_view::npos;
    value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
    if (text.front() == '-') value = -value;
  }
  return value;
}

/// GDAL takes a and b for equal if |a - b| < 2 epsilon |a + b|; solved here for a.
void set_float_range(NodataRule& rule, double value, double epsilon, double limit) {
  const double k = 2 * epsilon;
  const double near = value * ((1 - k) / (1 + k)), far = value * ((1 + k) / (1 - k));
  rule.low = std::min({near, far, value});
  rule.high = std::max({near, far, value});
  // The far end may be out of the range of doubles; samples there are infinite and have no data
  // anyway.
  rule.low = std::max(rule.low, -limit);
  rule.high = std::min(rule.high, limit);
  rule.unmatched = rule.low > rule.high;
}

std::int64_t highest_integer(ScalarType type) {
  const bool is_unsigned =
      type == ScalarType::u8 || type == ScalarType::u16 || type == ScalarType::u32;
  const std::size_t bits = 8 * size_of(type) - (is_unsigned ? 0 : 1);
  return static_cast<std::int64_t>((std::uint64_t{1} << bits) - 1);
}

std::int64_t lowest_integer(ScalarType type) {
  const bool is_unsigned =
      type == ScalarType::u8 || type == ScalarType::u16 || type == ScalarType::u32;
  return is_unsigned ? 0 : -highest_integer(type) - 1;
}

void set_float_rule(NodataRule& rule, double value) {
  constexpr double kMax = std::numeric_limits<float>::max();
  if (!std::isfinite(value)) return;
  set_float_range(rule, value, std::numeric_limits<float>::epsilon(), kMax);
  if (rule.unmatched) return;
  // Subnormal floats have larger steps.
  const double rounded = static_cast<float>(std::clamp(value, -kMax, kMax));
  rule.low = std::min(rule.low, rounded);
  rule.high = std::max(rule.high, rounded);
}

void set_double_rule(NodataRule& rule, double value) {
  if (!std::isfinite(value)) return;
  set_float_range(rule, value, std::numeric_limits<double>::epsilon(),
                  std::numeric_limits<double>::max());
}

/// Doubles cannot represent all large integers, so an integer is parsed from the text.
void set_unsigned_rule(NodataRule& rule, std::string_view text, double value) {
  if (const auto exact = parse_integer<std::uint64_t>(text)) {
    rule.low_unsigned = rule.high_unsigned = *exact;
  } else if (value >= 0 && value < 0x1p64 && value == std::floor(value)) {
    rule.low_unsigned = rule.high_unsigned = static_cast<std::uint64_t>(value);
  } else {
    rule.unmatched = true;
  }
}

void set_integer_rule(NodataRule& rule, std::string_view text, double value, ScalarType type) {
  if (const auto exact = parse_integer<std::int64_t>(text)) {
    rule.low_integer = rule.high_integer = *exact;
  } else if (value >= -0x1p63 && value < 0x1p63 && value == std::floor(value)) {
    rule.low_integer = rule.high_integer = static_cast<std::int64_t>(value);
  }
  rule.unmatched = rule.low_integer > rule.high_integer ||
                   rule.low_integer < lowest_integer(type) ||
                   rule.low_integer > highest_integer(type);
}

/// The closed range of samples of type T without data; empty if low > high.
template <class T>
struct Range {
  T low{1}, high{0};
};

template <class T>
Range<T> range_of(const NodataRule& rule) {
  if (rule.unmatched) return {};
  if constexpr (std::is_same_v<T, double>) {
    return {rule.low, rule.high};
  } else if constexpr (std::is_same_v<T, float>) {
    // Rounded inward, so that the range has the same floats as the range of doubles. The bounds are
    // within float's range already.
    auto low = static_cast<float>(rule.low), high = static_cast<float>(rule.high);
    if (low < rule.low) low = std::nextafter(low, std::numeric_limits<float>::infinity());
    if (high > rule.high) high = std::nextafter(high, -std::numeric_limits<float>::infinity());
    return {low, high};
  } else if constexpr (std::is_same_v<T, std::uint64_t>) {
    return {rule.low_unsigned, rule.high_unsigned};
  } else {
    if (rule.low_integer > rule.high_integer) return {};
    return {static_cast<T>(rule.low_integer), static_cast<T>(rule.high_integer)};
  }
}

template <class T>
T load(const std::byte* source) {
  T value;
  std::memcpy(&value, source, sizeof value);
  return value;
}

template <class T>
bool has_data(T value, Range<T> nodata) {
  const bool outside = (value < nodata.low) | (value > nodata.high);
  if constexpr (std::is_floating_point_v<T>) {
    constexpr T limit = std::numeric_limits<T>::max();
    return outside & (value >= -limit) & (value <= limit);  // also false for NaN
  } else {
    return outside;
  }
}

/// The loop; its step is a compile-time constant if it is 1, so that it vectorises.
template <class T, bool kPacked>
bool overlay(const SampleRow& row, Range<T> nodata, std::byte* out, std::uint8_t* valid) {
  const std::size_t step = kPacked ? sizeof(T) : row.step * sizeof(T);
  const std::byte* const source = row.samples;
  std::size_t holes = 0;
  constexpr std::size_t kChunk = 128;  // small enough to count in bytes, which vectorises better
  for (std::size_t begin = 0; begin < row.cells; begin += kChunk) {
    const std::size_t end = std::min(begin + kChunk, row.cells);
    std::uint8_t count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      count =
          static_cast<std::uint8_t>(count + (has_data(load<T>(source + i * step), nodata) ? 0 : 1));
    }
    holes += count;
  }
  if (holes == row.cells) return false;
  if (holes == 0) {
    std::memset(valid, 1, row.cells);
    if (kPacked) {
      std::memcpy(out, source, row.cells * sizeof(T));
    } else {
      for (std::size_t i = 0; i < row.cells; ++i) {
        std::memcpy(out + i * sizeof(T), source + i * step, sizeof(T));
      }
    }
    return true;
  }
  for (std::size_t i = 0; i < row.cells; ++i) {
    const T value = load<T>(source + i * step);
    const bool good = has_data(value, nodata);
    const T result = good ? value : load<T>(out + i * sizeof(T));
    std::memcpy(out + i * sizeof(T), &result, sizeof(T));
    valid[i] = static_cast<std::uint8_t>(valid[i] | (good ? 1 : 0));
  }
  return true;
}

}  // namespace

NodataRule NodataRule::parse(const std::string& text, ScalarType type) {
  std::string_view trimmed = text;
  while (!trimmed.empty() && std::isspace(static_cast<unsigned char>(trimmed.front())) != 0) {
    trimmed.remove_prefix(1);
  }
  while (!trimmed.empty() && std::isspace(static_cast<unsigned char>(trimmed.back())) != 0) {
    trimmed.remove_suffix(1);
  }
  if (trimmed.starts_with('+')) trimmed.remove_prefix(1);
  NodataRule rule;
  if (trimmed.empty()) return rule;
  rule.value = leading_number(trimmed);
  if (!rule.value) return rule;
  switch (type) {
    case ScalarType::f32:
      set_float_rule(rule, *rule.value);
      break;
    case ScalarType::f64:
      set_double_rule(rule, *rule.value);
      break;
    case ScalarType::u64:
      set_unsigned_rule(rule, trimmed, *rule.value);
      break;
    case ScalarType::i8:
    case ScalarType::u8:
    case ScalarType::i16:
    case ScalarType::u16:
    case ScalarType::i32:
    case ScalarType::u32:
    case ScalarType::i64:
      set_integer_rule(rule, trimmed, *rule.value, type);
      break;
  }
  return rule;
}

bool overlay_row(ScalarType type, const SampleRow& row, const NodataRule& rule, std::byte* out,
                 std::uint8_t* valid) {
  return with_type(type, [&](auto sample) {
    using T = decltype(sample);
    const Range<T> nodata = range_of<T>(rule);
    return row.step == 1 ? overlay<T, true>(row, nodata, out, valid)
                         : overlay<T, false>(row, nodata, out, valid);
  });
}

}  // namespace terrace::stream
