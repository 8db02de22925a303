// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::terrain {

/// The bytes of a mesh file and how far they have been read. What does not fit is a stream::Error
/// with the place in the file.
class MeshCursor {
 public:
  MeshCursor(std::string name, std::string_view bytes) : name_(std::move(name)), bytes_(bytes) {}

  [[noreturn]] void fail(const std::string& cause) const {
    throw stream::Error({.file = name_,
                         .where = "byte " + std::to_string(place_),
                         .cause = cause,
                         .remedy = "the file is damaged; write it anew"});
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - place_; }
  [[nodiscard]] bool done() const { return place_ == bytes_.size(); }

  /// The rest of the line, without its end.
  std::string_view line() {
    const std::size_t end = std::min(bytes_.find('\n', place_), bytes_.size());
    std::string_view text = bytes_.substr(place_, end - place_);
    place_ = std::min(end + 1, bytes_.size());
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    return text;
  }
  double ascii_number() {
    constexpr std::string_view kSpace = " \t\r\n";
    place_ = std::min(bytes_.find_first_not_of(kSpace, place_), bytes_.size());
    double value = 0;
    const auto [end, error] =
        std::from_chars(bytes_.data() + place_, bytes_.data() + bytes_.size(), value);
    if (error != std::errc{}) fail(done() ? "ends too early" : "a number was expected");
    place_ = static_cast<std::size_t>(end - bytes_.data());
    return value;
  }
  double binary_number(stream::ScalarType type, bool swap) {
    const std::size_t size = stream::size_of(type);
    if (left() < size) fail("ends too early");
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), bytes_.data() + place_, size);
    if (swap) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(size));
    place_ += size;
    switch (type) {
      case stream::ScalarType::i8:
        return as<std::int8_t>(raw);
      case stream::ScalarType::u8:
        return as<std::uint8_t>(raw);
      case stream::ScalarType::i16:
        return as<std::int16_t>(raw);
      case stream::ScalarType::u16:
        return as<std::uint16_t>(raw);
      case stream::ScalarType::i32:
        return as<std::int32_t>(raw);
      case stream::ScalarType::u32:
        return as<std::uint32_t>(raw);
      case stream::ScalarType::i64:
        return static_cast<double>(std::bit_cast<std::int64_t>(raw));
      case stream::ScalarType::u64:
        return static_cast<double>(std::bit_cast<std::uint64_t>(raw));
      case stream::ScalarType::f32:
        return as<float>(raw);
      case stream::ScalarType::f64:
        return std::bit_cast<double>(raw);
    }
    return 0;
  }

 private:
  template <class T>
  static double as(const std::array<char, 8>& raw) {
    T value{};
    std::memcpy(&value, raw.data(), sizeof value);
    return static_cast<double>(value);
  }

  std::string name_;
  std::string_view bytes_;
  std::size_t place_ = 0;
};

}  // namespace terrace::terrain
