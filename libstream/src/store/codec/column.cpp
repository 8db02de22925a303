// SPDX-License-Identifier: Apache-2.0
#include "store/codec/column.hpp"

#include <bit>

#include "store/codec/bytes.hpp"
#include "store/codec/symbols.hpp"

/// Also compiled for AVX2, which takes half the time; the loader chooses by the processor. Not with
/// Clang, which builds sanitizers: their runtime starts after the loader's choice.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define TERRACE_STORE_AVX2_TOO [[gnu::target_clones("default", "avx2")]]
#else
#define TERRACE_STORE_AVX2_TOO
#endif

namespace terrace::stream::store {
namespace {

std::uint64_t unsigned_of(std::int64_t value) { return static_cast<std::uint64_t>(value); }

}  // namespace

TERRACE_STORE_AVX2_TOO bool find_differences(const std::int64_t* values,
                                             const std::int64_t* preceding,
                                             std::int64_t* __restrict differences,
                                             std::uint32_t n) {
  std::uint64_t several = 0;
  for (std::uint32_t i = 1; i < n; ++i) {
    several |= unsigned_of(values[i]) ^ unsigned_of(values[0]);
    differences[i] = static_cast<std::int64_t>(unsigned_of(values[i]) - unsigned_of(values[i - 1]));
  }
  for (std::uint32_t i = 1; preceding != nullptr && i < n; ++i) {
    const std::uint64_t rise = unsigned_of(preceding[i]) - unsigned_of(preceding[i - 1]);
    differences[i] = static_cast<std::int64_t>(unsigned_of(differences[i]) - rise);
  }
  return several != 0;
}

TERRACE_STORE_AVX2_TOO void classify(const std::int64_t* differences,
                                     std::uint64_t* __restrict numbers,
                                     std::uint8_t* __restrict classes, std::uint32_t n) {
  std::uint64_t any = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    numbers[i] = zigzag(differences[i]);
    any |= numbers[i];
  }
  if (any >= std::uint64_t{1} << 24) {
    for (std::uint32_t i = 0; i < n; ++i) {
      classes[i] = static_cast<std::uint8_t>(class_of(numbers[i]));
    }
    return;
  }
  // A float represents these numbers exactly, and its upper bits give the class. Masks are used,
  // because a conversion inside a branch is not vectorised.
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto number = static_cast<std::int32_t>(numbers[i]);
    const std::int32_t large =
        (std::bit_cast<std::int32_t>(static_cast<float>(number)) >> 22) - 246;
    const std::int32_t is_small = (number - 16) >> 31;
    classes[i] = static_cast<std::uint8_t>((number & is_small) | (large & ~is_small));
  }
}

TERRACE_STORE_AVX2_TOO Extent extent_of(std::span<const std::int64_t> values) {
  Extent extent;
  for (const std::int64_t value : values) {
    extent.low = value < extent.low ? value : extent.low;
    extent.high = value > extent.high ? value : extent.high;
  }
  return extent;
}

}  // namespace terrace::stream::store
