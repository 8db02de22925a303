// SPDX-License-Identifier: Apache-2.0
#include "ply_decode.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "number.hpp"
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
void copy_values(const PackedColumn& column, std::byte* to) {
  const char* at = column.rows;
  for (std::size_t i = 0; i < column.count; ++i, at += column.stride, to += sizeof(T)) {
    const T value = load<T, kSwap>(at);
    std::memcpy(to, &value, sizeof value);
  }
}

template <class T>
T load_native(const std::byte* raw) {
  T value;
  std::memcpy(&value, raw, sizeof value);
  return value;
}

template <class T>
bool parse_integer(std::string_view text, T& value) {
  const char* const end = text.data() + text.size();
  const char* begin = text.data();
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++begin;
  const auto [rest, error] = std::from_chars(begin, end, value);
  if (error == std::errc{} && rest == end) return true;
  // "3.0", "1e2": some programs print every number as a real one.
  double real = 0;
  if (parse_real(begin, end, real) != end || real != std::trunc(real)) return false;
  // Both limits are exact: the upper one is the power of two after the largest value.
  const double above = std::ldexp(1.0, std::numeric_limits<T>::digits);
  if (!(real >= static_cast<double>(std::numeric_limits<T>::min()) && real < above)) return false;
  value = static_cast<T>(real);
  return true;
}

}  // namespace

void decode_coordinate(const PackedColumn& column, Point3* points, std::size_t axis) {
  with_type(column.type, [&](auto tag) {
    using T = decltype(tag);
    column.swap ? copy_coordinate<T, true>(column, points, axis)
                : copy_coordinate<T, false>(column, points, axis);
  });
}

void decode_values(const PackedColumn& column, std::byte* to) {
  with_type(column.type, [&](auto tag) {
    using T = typename Unsigned<sizeof(tag)>::type;
    column.swap ? copy_values<T, true>(column, to) : copy_values<T, false>(column, to);
  });
}

double to_double(const std::byte* raw, ScalarType type) {
  return with_type(type,
                   [&](auto tag) { return static_cast<double>(load_native<decltype(tag)>(raw)); });
}

std::int64_t to_integer(const std::byte* raw, ScalarType type) {
  return with_type(
      type, [&](auto tag) { return static_cast<std::int64_t>(load_native<decltype(tag)>(raw)); });
}

bool parse_scalar(std::string_view text, ScalarType type, std::byte* raw) {
  return with_type(type, [&](auto tag) {
    auto value = tag;
    bool good = false;
    if constexpr (std::is_floating_point_v<decltype(tag)>) {
      const char* const end = text.data() + text.size();
      good = !text.empty() && parse_real(text.data(), end, value) == end;
    } else {
      good = parse_integer(text, value);
    }
    std::memcpy(raw, &value, sizeof value);
    return good;
  });
}

}  // namespace terrace::stream
