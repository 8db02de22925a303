// SPDX-License-Identifier: Apache-2.0
#include "io/line_reader.hpp"

#include <string>

#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// True if a text begins as UTF-16, with or without a byte order mark.
bool is_utf16(std::string_view head) {
  if (head.starts_with("\xFF\xFE") || head.starts_with("\xFE\xFF")) return true;
  // Every other byte of ASCII characters is 0.
  if (head.size() < 4) return false;
  const bool little = head[0] != 0 && head[1] == 0 && head[2] != 0 && head[3] == 0;
  const bool big = head[0] == 0 && head[1] != 0 && head[2] == 0 && head[3] != 0;
  return little || big;
}

}  // namespace

void refuse_utf16(Input& input) {
  if (!is_utf16(input.fill(4))) return;
  throw Error(input.name(), "is text in UTF-16, which is not supported")
      .remedy("save it as UTF-8, e.g. 'iconv -f UTF-16 -t UTF-8 FILE'");
}

bool LineReader::next(std::string_view& line) {
  release();
  if (number_ == 0) refuse_utf16(*input_);
  std::string_view window = input_->window();
  std::size_t length = window.find(line_end_);
  std::size_t line_end = 1;
  while (length == std::string_view::npos) {
    const std::size_t searched = window.size();
    if (searched <= kMaxLine) window = input_->fill(searched + 1);
    if (window.size() == searched) {  // the last line, or one without an end
      if (searched == 0) return false;
      if (number_ == 0 && line_end_ == '\n' && window.find('\r') != window.npos) {
        line_end_ = '\r';
        return next(line);
      }
      length = searched;
      line_end = 0;
    } else {
      length = window.find(line_end_, searched);
    }
  }
  if (length > kMaxLine) {
    throw Error(input_->name(), "longer than " + counted(kMaxLine, "byte"))
        .at_line(number_ + 1)
        .remedy("the file is not text, or its line ends are missing");
  }
  pending_ = length + line_end;
  ++number_;
  line = window.substr(0, length);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return true;
}

bool LineReader::skip() {
  release();
  for (bool blank = true;;) {
    const std::string_view window = input_->fill(1);
    if (window.empty()) return !blank;
    const std::size_t end = window.find('\n');
    const std::string_view part = window.substr(0, end);
    blank = blank && part.find_first_not_of(" \t\r") == std::string_view::npos;
    input_->consume(end == std::string_view::npos ? part.size() : end + 1);
    if (end == std::string_view::npos) continue;
    ++number_;
    if (!blank) return true;
  }
}

}  // namespace terrace::stream
