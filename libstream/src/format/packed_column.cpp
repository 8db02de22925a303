// SPDX-License-Identifier: Apache-2.0
#include "format/packed_column.hpp"

#include <bit>
#include <cstdint>
#include <cstring>

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
void copy_values(const PackedColumn& column, std::byte* to, std::size_t to_stride) {
  const char* at = column.rows;
  for (std::size_t i = 0; i < column.count; ++i, at += column.stride, to += to_stride) {
    const T value = load<T, kSwap>(at);
    std::memcpy(to, &value, sizeof value);
  }
}

}  // namespace

void decode_coordinate(const PackedColumn& column, Point3* points, std::size_t axis) {
  with_type(column.type, [&](auto tag) {
    using T = decltype(tag);
    column.swap ? copy_coordinate<T, true>(column, points, axis)
                : copy_coordinate<T, false>(column, points, axis);
  });
}

void decode_values(const PackedColumn& column, std::byte* to, std::size_t to_stride) {
  with_type(column.type, [&](auto tag) {
    using T = typename Unsigned<sizeof(tag)>::type;
    column.swap ? copy_values<T, true>(column, to, to_stride)
                : copy_values<T, false>(column, to, to_stride);
  });
}

}  // namespace terrace::stream
