// SPDX-License-Identifier: Apache-2.0
#include "store/json.hpp"

#include <algorithm>
#include <charconv>

#include "io/number.hpp"
#include "store/codec/bytes.hpp"

namespace terrace::stream::store {

/// A recursive descent parser, whose depth is bounded by kMaxLevels.
class JsonParser {
 public:
  explicit JsonParser(std::string_view text) : text_(text) {}

  JsonValue document() {
    JsonValue json = value(0);
    skip_blanks();
    if (at_ < text_.size()) fail("something follows the value");
    return json;
  }

 private:
  static constexpr std::size_t kMaxValues = std::size_t{1} << 20;
  static constexpr unsigned kMaxLevels = 16;

  [[noreturn]] void fail(const char* cause) const {
    throw Damage("byte " + std::to_string(at_) + ": " + cause);
  }
  [[nodiscard]] char next() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  bool take(char c) {
    if (next() != c || at_ == text_.size()) return false;
    ++at_;
    return true;
  }
  void expect(char c, const char* cause) {
    if (!take(c)) fail(cause);
  }
  void skip_blanks() {
    while (take(' ') || take('\n') || take('\r') || take('\t')) {
    }
  }
  bool take_word(std::string_view word) {
    if (text_.substr(at_, word.size()) != word) return false;
    at_ += word.size();
    return true;
  }
  bool take_digits() {
    const std::size_t begin = at_;
    while (next() >= '0' && next() <= '9') ++at_;
    return at_ > begin;
  }

  JsonValue value(unsigned level) {
    if (++values_ > kMaxValues) fail("there are too many values");
    JsonValue json;
    skip_blanks();
    const std::size_t begin = at_;
    if (take('"')) {
      json.kind_ = JsonValue::Kind::string;
      json.text_ = string();
      return json;
    }
    if (next() == '{' || next() == '[') {
      if (level == kMaxLevels) fail("there are too many levels");
      read_items(json, level + 1);
      return json;
    }
    if (take_word("true") || take_word("false")) {
      json.kind_ = JsonValue::Kind::boolean;
    } else if (!take_word("null")) {
      json.kind_ = JsonValue::Kind::number;
      skip_number();
    }
    json.text_ = text_.substr(begin, at_ - begin);
    return json;
  }
  void read_items(JsonValue& json, unsigned level) {
    const bool object = text_[at_++] == '{';
    const char close = object ? '}' : ']';
    json.kind_ = object ? JsonValue::Kind::object : JsonValue::Kind::array;
    skip_blanks();
    if (take(close)) return;
    do {
      if (object) {
        skip_blanks();
        expect('"', "a key is missing");
        json.keys_.push_back(string());
        skip_blanks();
        expect(':', "a colon is missing");
      }
      json.items_.push_back(value(level));
      skip_blanks();
    } while (take(','));
    expect(close, "a comma or a closing bracket is missing");
  }
  void skip_number() {
    take('-');
    if (!take('0') && !take_digits()) fail("a value is missing");
    if (take('.') && !take_digits()) fail("digits are missing");
    if (take('e') || take('E')) {
      if (!take('+')) take('-');
      if (!take_digits()) fail("digits are missing");
    }
  }
  /// Parses a string after its opening quote.
  std::string string() {
    std::string out;
    while (!take('"')) {
      if (at_ == text_.size()) fail("a string does not end");
      if (take('\\')) {
        escape(out);
      } else {
        const std::size_t length = character();
        if (length == 0) fail("a string has a character that is not allowed");
        out += text_.substr(at_, length);
        at_ += length;
      }
    }
    return out;
  }
  /// Returns the bytes of the next character in UTF-8 (RFC 3629); 0 for control characters and
  /// invalid bytes.
  [[nodiscard]] std::size_t character() const {
    const auto byte = [&](std::size_t i) {
      return at_ + i < text_.size() ? static_cast<unsigned char>(text_[at_ + i]) : 0u;
    };
    const unsigned first = byte(0), second = byte(1);
    if (first < 0x80) return first >= 0x20 ? 1 : 0;
    const std::size_t length = first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
    // Rejects overlong forms, surrogates, and numbers above the last character.
    if (first > 0xF4 || (first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
        (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F)) {
      return 0;
    }
    for (std::size_t i = 1; i < length; ++i) {
      if ((byte(i) & 0xC0) != 0x80) return 0;
    }
    return length;
  }
  void escape(std::string& out) {
    constexpr std::string_view kLetters = "\"\\/bfnrt", kMeanings = "\"\\/\b\f\n\r\t";
    if (const std::size_t which = kLetters.find(next()); which != kLetters.npos) {
      out += kMeanings[which];
      ++at_;
      return;
    }
    unsigned code = code_unit();
    if (code >= 0xD800 && code < 0xE000) {
      expect('\\', "half of a pair of escapes is missing");
      const unsigned low = code_unit();
      if (code >= 0xDC00 || low < 0xDC00 || low >= 0xE000) fail("a pair of escapes is bad");
      code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
    }
    const auto put = [&](unsigned byte) { out += static_cast<char>(byte); };
    if (code < 0x80) return put(code);
    if (code < 0x800) {
      put(0xC0 | code >> 6);
    } else {
      if (code < 0x10000) {
        put(0xE0 | code >> 12);
      } else {
        put(0xF0 | code >> 18);
        put(0x80 | (code >> 12 & 0x3F));
      }
      put(0x80 | (code >> 6 & 0x3F));
    }
    put(0x80 | (code & 0x3F));
  }
  /// Parses "u" and four hexadecimal digits.
  unsigned code_unit() {
    expect('u', "an escape is unknown");
    unsigned code = 0;
    const std::string_view digits = text_.substr(at_, 4);
    const char* const end = digits.data() + digits.size();
    if (digits.size() < 4 || std::from_chars(digits.data(), end, code, 16).ptr != end) {
      fail("an escape is unknown");
    }
    at_ += 4;
    return code;
  }

  std::string_view text_;
  std::size_t at_ = 0, values_ = 0;
};

JsonValue JsonValue::parse(std::string_view text) { return JsonParser(text).document(); }

const JsonValue& JsonValue::at(std::string_view key) const {
  const auto entry = std::find(keys_.rbegin(), keys_.rend(), key);
  if (entry == keys_.rend()) throw Damage('"' + std::string(key) + "\" is missing");
  return items_[static_cast<std::size_t>(keys_.rend() - entry) - 1];
}

bool JsonValue::has(std::string_view key) const {
  return std::find(keys_.begin(), keys_.end(), key) != keys_.end();
}

const std::vector<JsonValue>& JsonValue::items() const {
  if (kind_ != Kind::array) throw Damage("a value is not an array");
  return items_;
}

const std::string& JsonValue::string() const {
  if (kind_ != Kind::string) throw Damage("a value is not a string");
  return text_;
}

bool JsonValue::boolean() const {
  if (kind_ != Kind::boolean) throw Damage("a value is neither true nor false");
  return text_ == "true";
}

double JsonValue::number() const {
  double value = 0;
  if (kind_ != Kind::number || !parse_real(text_.data(), text_.data() + text_.size(), value)) {
    throw Damage("a value is not a number");
  }
  return value;
}

std::uint64_t JsonValue::count() const {
  std::uint64_t value = 0;
  const char* const end = text_.data() + text_.size();
  const auto [rest, error] = std::from_chars(text_.data(), end, value);
  if (kind_ != Kind::number || error != std::errc() || rest != end) {
    throw Damage("a count is not an unsigned integer");
  }
  return value;
}

}  // namespace terrace::stream::store
