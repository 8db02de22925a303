// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/unit_words.hpp"

namespace terrace::stream {

/// A blank inside a line.
inline bool is_blank(char c) { return c == ' ' || c == '\t'; }

/// A blank or a line end.
inline bool is_white_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
/// ASCII letters in lower case.
std::string lower_case(std::string text);

/// `line` from its first nonblank character.
inline std::string_view trim_left(std::string_view line) {
  while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
  return line;
}
/// `line` without the blanks at both ends.
std::string_view trim(std::string_view line);
/// The fields of a line, with surrounding blanks removed. The separator ' ' means runs of blanks;
/// others do not count inside a field in double quotes, and two of them enclose an empty field.
std::vector<std::string_view> split_fields(std::string_view line, char separator);
/// `field` without the single or double quotes around it.
std::string_view unquoted(std::string_view field);
/// "1 point", "12345 points" for an error message.
template <class Number>
std::string counted(Number number, std::string_view noun) {
  return std::to_string(number) + ' ' + noun_for(number == 1, noun);
}
/// `text` prepared for an error message: in quotes, cut to 40 characters, without unprintable ones.
std::string in_quotes(std::string_view text);

}  // namespace terrace::stream
