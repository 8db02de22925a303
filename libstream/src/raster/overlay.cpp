// SPDX-License-Identifier: Apache-2.0
#include "raster/overlay.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "with_type.hpp"

namespace terrace::stream {
namespace {

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
T load(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

template <class T>
bool has_data(T value, Range<T> nodata) {
  const bool outside = (value < nodata.low) | (value > nodata.high);
  if constexpr (std::is_floating_point_v<T>) {
    constexpr T most = std::numeric_limits<T>::max();
    return outside & (value >= -most) & (value <= most);  // also false for NaN
  } else {
    return outside;
  }
}

/// The loop; its step is a compile-time constant if it is 1, so that it vectorises.
template <class T, bool kPacked>
bool overlay(const SampleRow& row, Range<T> nodata, std::byte* out, std::uint8_t* valid) {
  const std::size_t step = kPacked ? sizeof(T) : row.step * sizeof(T);
  const std::byte* const from = row.samples;
  std::size_t holes = 0;
  constexpr std::size_t kChunk = 128;  // small enough to count in bytes, which vectorises better
  for (std::size_t begin = 0; begin < row.cells; begin += kChunk) {
    const std::size_t end = std::min(begin + kChunk, row.cells);
    std::uint8_t count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      count =
          static_cast<std::uint8_t>(count + (has_data(load<T>(from + i * step), nodata) ? 0 : 1));
    }
    holes += count;
  }
  if (holes == row.cells) return false;
  if (holes == 0) {
    std::memset(valid, 1, row.cells);
    if (kPacked) {
      std::memcpy(out, from, row.cells * sizeof(T));
    } else {
      for (std::size_t i = 0; i < row.cells; ++i) {
        std::memcpy(out + i * sizeof(T), from + i * step, sizeof(T));
      }
    }
    return true;
  }
  for (std::size_t i = 0; i < row.cells; ++i) {
    const T value = load<T>(from + i * step);
    const bool good = has_data(value, nodata);
    const T result = good ? value : load<T>(out + i * sizeof(T));
    std::memcpy(out + i * sizeof(T), &result, sizeof(T));
    valid[i] = static_cast<std::uint8_t>(valid[i] | (good ? 1 : 0));
  }
  return true;
}

}  // namespace

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
