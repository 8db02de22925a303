// SPDX-License-Identifier: Apache-2.0
#include "format/ply/decode.hpp"

#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "io/number.hpp"
#include "io/text.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

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
