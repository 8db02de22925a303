// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/message.hpp"

#include <cassert>

namespace terrace::stream {

Message::Message(std::string text) {
  if (!text.empty()) pieces_.push_back({std::move(text), false});
}
Message::Message(std::string_view text) : Message(std::string(text)) {}
Message::Message(const char* text) : Message(std::string(text)) {}

Message Message::format(std::string_view pattern, std::initializer_list<Message> values) {
  Message formatted;
  const auto* value = values.begin();
  for (std::size_t open = pattern.find('{'); open != pattern.npos; open = pattern.find('{')) {
    formatted += pattern.substr(0, open);
    const std::size_t close = pattern.find('}', open);
    assert(close != pattern.npos);
    const std::string_view name = pattern.substr(open + 1, close - open - 1);
    if (name.empty()) {
      assert(value != values.end());
      formatted += *value++;
    } else {
      formatted.pieces_.push_back({std::string(name), true});
    }
    pattern.remove_prefix(close + 1);
  }
  assert(value == values.end());
  return formatted += pattern;
}

std::string Message::text() const {
  return text([](std::string_view name) { return '`' + std::string(name) + '`'; });
}

std::string Message::text(const NameOf& name_of) const {
  std::string text;
  for (const Piece& piece : pieces_) text += piece.is_parameter ? name_of(piece.text) : piece.text;
  return text;
}

Message Message::on_one_line() && {
  for (Piece& piece : pieces_) {
    for (char& c : piece.text) {
      if (c == '\n' || c == '\r') c = ' ';
    }
  }
  return std::move(*this);
}

Message& Message::operator+=(const Message& other) {
  pieces_.insert(pieces_.end(), other.pieces_.begin(), other.pieces_.end());
  return *this;
}

}  // namespace terrace::stream
