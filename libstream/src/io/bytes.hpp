// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

namespace terrace::stream {

/// Stores a number at `at` in little-endian order on every machine; returns the position after it.
template <class T>
char* store_little_endian(char* at, T value) {
  std::memcpy(at, &value, sizeof(T));
  if constexpr (std::endian::native == std::endian::big) std::reverse(at, at + sizeof(T));
  return at + sizeof(T);
}

template <class T>
void append_little_endian(std::string& out, T value) {
  char bytes[sizeof(T)];
  store_little_endian(bytes, value);
  out.append(bytes, sizeof(T));
}

/// Reads a little-endian number at `at`, which need not be aligned.
template <class T>
T load_little_endian(const char* at) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, at, sizeof(T));
  if constexpr (std::endian::native == std::endian::big) std::reverse(bytes, bytes + sizeof(T));
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

}  // namespace terrace::stream
