// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/unit_words.hpp"

namespace terrace::stream {

/// True for a blank inside a line.
inline bool is_blank(char c) { return c == ' ' || c == '\t'; }

/// True for a blank or a line end.
inline bool is_white_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
/// Returns `text` with ASCII letters in lower case.
std::string lower_case(std::string text);

/// Returns `line` from its first nonblank character.
inline std::string_view trim_left(std::string_view line) {
  while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
  return line;
}
/// Returns `line` without the blanks at both ends.
std::string_view trim(std::string_view line);
/// Splits a line into fields and trims them. The separator ' ' stands for any number of blanks. Two
/// adjacent separators of another kind enclose an empty field, and those inside a field in double
/// quotes are ignored.
std::vector<std::string_view> split_fields(std::string_view line, char separator);
/// Returns `field` without the single or double quotes around it.
std::string_view unquoted(std::string_view field);
/// Returns a number with its noun for an error message: "1 point", "12345 points".
template <class Number>
std::string counted(Number number, std::string_view noun) {
  return std::to_string(number) + ' ' + noun_for(number == 1, noun);
}
/// Returns `text` for an error message: in quotes, cut to 40 characters, without unprintable ones.
std::string in_quotes(std::string_view text);

}  // namespace terrace::stream
