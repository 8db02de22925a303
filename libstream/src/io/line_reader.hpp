// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "terrace/stream/input.hpp"

namespace terrace::stream {

/// Throws: Error, with the remedy, if the text that begins at the input's position is UTF-16, which
/// would be read as text without numbers.
void refuse_utf16(Input& input);

/// The lines of a text, in a window of bounded size. Lines end in LF or CR LF, or, if the beginning
/// of the text has no LF, in CR; the last needs no end.
class LineReader {
 public:
  /// Maximum length of a line in bytes; a longer one is an Error, as a line is held in memory.
  static constexpr std::size_t kMaxLine = 64u << 10;

  /// `input` must outlive the reader and not be moved by others between two lines.
  explicit LineReader(Input& input) : input_(&input) {}

  /// The next line without its end; false if there is none. `line` is valid until the next call.
  /// Throws: Error if the line is longer than kMaxLine or cannot be read, and for UTF-16.
  bool next(std::string_view& line);
  /// Makes the next call of next() return the last line again.
  void hold() {
    pending_ = 0;
    --number_;
  }
  /// Skips one line of any length that is not blank; false if there is none.
  bool skip();
  /// Moves the input past the last line, which is then invalid.
  void release() {
    input_->consume(pending_);
    pending_ = 0;
  }
  /// Number of the last line, counted from 1.
  [[nodiscard]] std::uint64_t number() const { return number_; }

 private:
  Input* input_;
  std::size_t pending_ = 0;  ///< bytes of the last line, including its end
  std::uint64_t number_ = 0;
  char line_end_ = '\n';
};

}  // namespace terrace::stream
