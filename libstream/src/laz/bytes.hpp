// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

/// A coder that is not inlined keeps its registers in memory, which halves the speed.
#if defined(__GNUC__) && !defined(TERRACE_LAZ_SANITIZED)
#define TERRACE_LAZ_INLINE [[gnu::always_inline]] inline
#define TERRACE_LAZ_INLINE_LAMBDA __attribute__((always_inline))
#define TERRACE_LAZ_NOINLINE [[gnu::noinline]]
#else
#define TERRACE_LAZ_INLINE inline
#define TERRACE_LAZ_INLINE_LAMBDA
#define TERRACE_LAZ_NOINLINE
#endif

namespace terrace::stream::laz {

static_assert(std::endian::native == std::endian::little,
              "numbers are copied as they are; a big-endian machine needs swaps here");

template <class T>
T load(const std::uint8_t* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

template <class T>
void store(std::uint8_t* at, T value) {
  std::memcpy(at, &value, sizeof value);
}

}  // namespace terrace::stream::laz
