// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace terrace::stream {

/// A text for the user in which the names of parameters are data, because each interface has its
/// own names: `max_error` in C++, --max-error on the command line. message() formats one.
class Message {
 public:
  /// Returns an interface's name of a parameter of the libraries.
  using NameOf = std::function<std::string(std::string_view)>;

  Message() = default;
  /// Converts a text without parameters.
  Message(std::string text);       // NOLINT(google-explicit-constructor)
  Message(std::string_view text);  // NOLINT(google-explicit-constructor)
  Message(const char* text);       // NOLINT(google-explicit-constructor)
  explicit Message(std::integral auto number) : Message(std::to_string(number)) {}

  /// Returns the pattern with each "{}" replaced by the next value, and each "{name}" by that
  /// parameter. The pattern must have as many "{}" as there are values.
  static Message format(std::string_view pattern, std::initializer_list<Message> values);

  [[nodiscard]] bool empty() const noexcept { return pieces_.empty(); }
  /// Returns the text with the libraries' names of parameters, in backquotes.
  [[nodiscard]] std::string text() const;
  /// Returns the text with an interface's names of parameters.
  [[nodiscard]] std::string text(const NameOf& name_of) const;

  /// Returns the message with spaces in place of line breaks.
  [[nodiscard]] Message on_one_line() &&;

  Message& operator+=(const Message& other);
  friend Message operator+(Message left, const Message& right) { return std::move(left += right); }

 private:
  struct Piece {
    std::string text;
    bool is_parameter;
  };
  std::vector<Piece> pieces_;
};

/// A pattern for message(), whose number of values is checked when it is compiled.
template <class... Values>
class MessagePattern {
 public:
  consteval MessagePattern(const char* text) : text_(text) {  // NOLINT(google-explicit-constructor)
    std::size_t fields = 0;
    for (std::string_view rest = text_; rest.find('{') != rest.npos;) {
      rest.remove_prefix(rest.find('{') + 1);
      if (rest.find('}') == rest.npos) throw "a brace is not closed";
      if (rest.front() == '}') ++fields;
    }
    if (fields != sizeof...(Values)) throw "the number of values is not the number of {}";
  }
  [[nodiscard]] std::string_view text() const noexcept { return text_; }

 private:
  std::string_view text_;
};

/// Formats a message of texts, integers and other messages, in which names of parameters are data:
///
///     message("{zoom} {} is too deep: the deepest is {}", zoom, deepest)
template <class... Values>
Message message(MessagePattern<std::type_identity_t<Values>...> pattern, const Values&... values) {
  return Message::format(pattern.text(), {Message(values)...});
}

}  // namespace terrace::stream
