// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <string_view>

#include <terrace/base/random.hpp>

namespace terrace::terrain {

/// A 64-bit hash of a sequence of numbers and texts. Not cryptographic.
class Digest {
 public:
  constexpr void add(std::uint64_t number) { value_ = base::splitmix64(value_ ^ number); }
  constexpr void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  constexpr void add(std::string_view text) {
    add(std::uint64_t{text.size()});
    for (const char c : text) add(std::uint64_t{static_cast<unsigned char>(c)});
  }
  [[nodiscard]] constexpr std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0;
};

}  // namespace terrace::terrain
