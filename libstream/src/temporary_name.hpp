// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace terrace::stream {

/// What the names of all temporaries for the target called `name` begin with, in its folder. Short
/// however long that name is, since 255 bytes is the most that file systems take: a hash (64-bit
/// FNV-1a) stands for it.
inline std::string temporary_prefix(std::string_view name) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  std::string prefix = ".terrace-";
  for (int shift = 60; shift >= 0; shift -= 4) prefix += "0123456789abcdef"[hash >> shift & 15];
  return prefix + ".tmp-";
}

}  // namespace terrace::stream
