// SPDX-License-Identifier: Apache-2.0
#include "format/packed_column.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "io/number.hpp"
#include "io/text.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

template <std::size_t kSize>
struct Unsigned;
template <>
struct Unsigned<1> {
  using type = std::uint8_t;
};
template <>
struct Unsigned<2> {
  using type = std::uint16_t;
};
template <>
struct Unsigned<4> {
  using type = std::uint32_t;
};
template <>
struct Unsigned<8> {
  using type = std::uint64_t;
};

std::uint8_t swapped(std::uint8_t v) { return v; }
std::uint16_t swapped(std::uint16_t v) { return __builtin_bswap16(v); }
std::uint32_t swapped(std::uint32_t v) { return __builtin_bswap32(v); }
std::uint64_t swapped(std::uint64_t v) { return __builtin_bswap64(v); }

template <class T, bool kSwap>
T load(const char* at) {
  typename Unsigned<sizeof(T)>::type bits;
  std::memcpy(&bits, at, sizeof bits);
  if constexpr (kSwap) bits = swapped(bits);
  return std::bit_cast<T>(bits);
}

template <class T, bool kSwap>
void copy_coordinate(const PackedColumn& column, Point3* points, std::size_t axis) {
  const char* at = column.rows;
  for (std::size_t i = 0; i < column.count; ++i, at += column.stride) {
    points[i][axis] = static_cast<double>(load<T, kSwap>(at));
  }
}

template <class T, bool kSwap>
void copy_values(const PackedColumn& column, std::byte* target, std::size_t target_stride) {
  const char* at = column.rows;
  for (std::size_t i = 0; i < column.count; ++i, at += column.stride, target += target_stride) {
    const T value = load<T, kSwap>(at);
    std::memcpy(target, &value, sizeof value);
  }
}

template <class T>
T load_native(const std::byte* raw) {
  T value;
  std::memcpy(&value, raw, sizeof value);
  return value;
}

bool ends_word(const char* at, const char* end) { return at == end || is_blank(*at); }

template <class T>
const char* parse_integer(const char* at, const char* end, T& value) {
  if (end - at > 1 && at[0] == '+' && at[1] != '-') ++at;
  const auto [rest, error] = std::from_chars(at, end, value);
  if (error == std::errc{} && ends_word(rest, end)) return rest;
  // Some programs print every number as a real one, such as "3.0" or "1e2".
  double real = 0;
  const char* const real_end = parse_real(at, end, real);
  if (real_end == nullptr || real != std::trunc(real)) return nullptr;
  // Both limits are exact: the upper one is the power of two after the largest value.
  const double above = std::ldexp(1.0, std::numeric_limits<T>::digits);
  if (!(real >= static_cast<double>(std::numeric_limits<T>::min()) && real < above)) return nullptr;
  value = static_cast<T>(real);
  return real_end;
}

}  // namespace

void decode_coordinate(const PackedColumn& column, Point3* points, std::size_t axis) {
  with_type(column.type, [&](auto tag) {
    using T = decltype(tag);
    column.swap ? copy_coordinate<T, true>(column, points, axis)
                : copy_coordinate<T, false>(column, points, axis);
  });
}

void decode_values(const PackedColumn& column, std::byte* target, std::size_t target_stride) {
  with_type(column.type, [&](auto tag) {
    using T = typename Unsigned<sizeof(tag)>::type;
    column.swap ? copy_values<T, true>(column, target, target_stride)
                : copy_values<T, false>(column, target, target_stride);
  });
}

std::int64_t to_integer(const std::byte* raw, ScalarType type) {
  return with_type(
      type, [&](auto tag) { return static_cast<std::int64_t>(load_native<decltype(tag)>(raw)); });
}

const char* parse_scalar(const char* at, const char* end, ScalarType type, std::byte* raw) {
  return with_type(type, [&](auto value) {
    const char* rest = nullptr;
    if constexpr (std::is_floating_point_v<decltype(value)>) {
      rest = parse_real(at, end, value);
    } else {
      rest = parse_integer(at, end, value);
    }
    std::memcpy(raw, &value, sizeof value);
    return rest != nullptr && ends_word(rest, end) ? rest : nullptr;
  });
}

}  // namespace terrace::stream
