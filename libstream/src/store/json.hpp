// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::stream::store {

/// A value of JSON (RFC 8259), read only. Manifests are read by this, not by nlohmann-json, because
/// the viewer's WebAssembly modules would grow by a fifteenth.
class JsonValue {
 public:
  enum class Kind : std::uint8_t { null, boolean, number, string, array, object };

  /// Throws: Damage, with the position, if the text is not JSON in UTF-8, or has more than 2^20
  /// values or 16 levels.
  static JsonValue parse(std::string_view text);

  [[nodiscard]] Kind kind() const { return kind_; }
  /// The value of a key, the last if there are several. Throws: Damage without such a key.
  [[nodiscard]] const JsonValue& at(std::string_view key) const;

  // These throw Damage if the value is of another kind.

  [[nodiscard]] const std::vector<JsonValue>& items() const;
  [[nodiscard]] const std::string& string() const;
  [[nodiscard]] bool boolean() const;
  /// Correctly rounded; throws for numbers that are too large for a double, too.
  [[nodiscard]] double number() const;
  /// A number that is written as an integer from 0 to 2^64 - 1.
  [[nodiscard]] std::uint64_t count() const;

 private:
  friend class JsonParser;

  Kind kind_ = Kind::null;
  std::string text_;  ///< the characters of a string; others as they are written
  std::vector<std::string> keys_;
  std::vector<JsonValue> items_;  ///< of an array; of an object the values, beside keys_
};

}  // namespace terrace::stream::store
