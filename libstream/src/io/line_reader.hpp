// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "terrace/stream/input.hpp"

namespace terrace::stream {

/// Throws Error if the text at the input's position is UTF-16, which would be read as text without
/// numbers.
void refuse_utf16(Input& input);

/// Reads the lines of a text, in a window of bounded size. Lines end in LF or CR LF, or in CR if
/// the beginning of the text has no LF. The last line needs no end.
class LineReader {
 public:
  /// Maximum length of a line in bytes. A longer line is an Error, because lines are held in
  /// memory.
  static constexpr std::size_t kMaxLine = 64u << 10;

  /// `input` must outlive the reader, and others must not read from it between two lines.
  explicit LineReader(Input& input) : input_(&input) {}

  /// Reads the next line, without its end; false at the end of the text. `line` is valid until the
  /// next call. Throws: Error if the line is longer than kMaxLine or cannot be read, and for
  /// UTF-16.
  bool next(std::string_view& line);
  /// Makes next() return the last line again.
  void hold() {
    pending_ = 0;
    --number_;
  }
  /// Skips the next line that is not blank, of any length; false if the text has no more.
  bool skip();
  /// Moves the input past the last line, whose view is then invalid.
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
