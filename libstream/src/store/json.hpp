// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::stream::store {

/// A value of parsed JSON (RFC 8259). Manifests are read with this class because nlohmann-json
/// would enlarge the viewer's WebAssembly modules by a fifteenth.
class JsonValue {
 public:
  enum class Kind : std::uint8_t { null, boolean, number, string, array, object };

  /// Parses a text. Throws: Damage, with the position, if it is not JSON in UTF-8, or has more than
  /// 2^20 values or 16 levels.
  static JsonValue parse(std::string_view text);

  [[nodiscard]] Kind kind() const { return kind_; }
  /// Returns the value of a key, of the last one if there are several. Throws: Damage if there is
  /// none.
  [[nodiscard]] const JsonValue& at(std::string_view key) const;

  [[nodiscard]] bool has(std::string_view key) const;

  // These throw Damage if the value is of another kind.

  [[nodiscard]] const std::vector<JsonValue>& items() const;
  [[nodiscard]] const std::string& string() const;
  [[nodiscard]] bool boolean() const;
  /// Returns the number, correctly rounded. Also throws if it is too large for a double.
  [[nodiscard]] double number() const;
  /// Returns the number. Also throws unless it is written as an integer from 0 to 2^64 - 1.
  [[nodiscard]] std::uint64_t count() const;

 private:
  friend class JsonParser;

  Kind kind_ = Kind::null;
  std::string text_;  ///< the characters of a string; the text of other values
  std::vector<std::string> keys_;
  std::vector<JsonValue> items_;  ///< of an array; of an object its values, in the order of keys_
};

}  // namespace terrace::stream::store
