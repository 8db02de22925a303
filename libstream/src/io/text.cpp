// SPDX-License-Identifier: Apache-2.0
#include "io/text.hpp"

#include <algorithm>

namespace terrace::stream {

std::string lower_case(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

std::string_view trim(std::string_view line) {
  line = trim_left(line);
  while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
  return line;
}

std::vector<std::string_view> split_fields(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  if (separator != '\t') line = trim(line);
  if (separator != ' ') {
    for (;;) {
      while (!line.empty() && is_blank(line.front()) && line.front() != separator) {
        line.remove_prefix(1);
      }
      std::size_t start = 0;
      if (line.starts_with('"')) {
        // A doubled quote does not end the quoted text.
        start = line.find('"', 1);
        while (start != line.npos && line.substr(start + 1).starts_with('"'))
          start = line.find('"', start + 2);
      }
      const std::size_t end = start == line.npos ? line.npos : line.find(separator, start);
      fields.push_back(trim(line.substr(0, end)));
      if (end == std::string_view::npos) return fields;
      line.remove_prefix(end + 1);
    }
  }
  while (!line.empty()) {
    const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
    fields.push_back(line.substr(0, end));
    line = trim_left(line.substr(end));
  }
  return fields;
}

std::string_view unquoted(std::string_view field) {
  if (field.size() >= 2 && (field.front() == '"' || field.front() == '\'') &&
      field.front() == field.back()) {
    field = trim(field.substr(1, field.size() - 2));
  }
  return field;
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kMaxShown = 40;
  std::string out = "'";
  for (const char c : text.substr(0, kMaxShown)) {
    const bool control = static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
    out += control ? '?' : c;
  }
  out += text.size() > kMaxShown ? "...'" : "'";
  return out;
}

}  // namespace terrace::stream
