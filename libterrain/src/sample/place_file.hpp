// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/stream/input.hpp>

#include "terrace/terrain/region.hpp"

/// Tables of places as text, one a line: read in batches, each line kept as it is so that answers
/// can be written behind it.

namespace terrace::terrain {

/// The columns of x and y. If the first line is a header, or the comment before it has as many
/// names, those that stream::axis_named() knows; otherwise the first two.
struct PlaceLayout {
  char separator = ',';  ///< or ';' or a tab: the first of these in the first line
  std::size_t x = 0, y = 1;
  bool header = false;             ///< the first line has names
  std::vector<std::string> names;  ///< of the header, in lower case

  /// comment: the line before, without which `first_line` has no names. Throws: stream::Error,
  /// naming `file`, for a line with fewer than two columns and for a header that names no x and y.
  static PlaceLayout of(std::string_view first_line, const std::string& file,
                        std::string_view comment = {});
};

/// Lines without their ends, "\n" or "\r\n".
struct PlaceBatch {
  std::string text;
  std::vector<std::size_t> begins;  ///< of the lines in text; one more: the end
  std::uint64_t first_line = 1;     ///< number of the first in the file

  [[nodiscard]] std::size_t size() const { return begins.empty() ? 0 : begins.size() - 1; }
  [[nodiscard]] std::string_view line(std::size_t i) const;
};

class PlaceFile {
 public:
  /// path: "-" is standard input. stop: ends a wait for more of it.
  /// Throws: stream::Error if the file cannot be read.
  explicit PlaceFile(const std::string& path, std::stop_token stop = {});

  /// The next whole lines, at most `most_lines` and about `most_bytes` of them; false at the end.
  /// Throws: stream::Error on a line longer than a mebibyte, stream::Stopped.
  bool next(PlaceBatch& batch, std::size_t most_bytes, std::size_t most_lines);
  /// As messages call it.
  [[nodiscard]] const std::string& name() const { return input_.name(); }

 private:
  stream::Input input_;
  std::uint64_t line_ = 1;
};

/// Whether a line is kept without an answer: it is empty, or a comment (#).
bool is_no_place(std::string_view line);

/// The place in a line; NaN where a coordinate is empty or "nan".
/// Throws: stream::Error naming file and line if there is no number where one should be.
Point2 place_of(std::string_view line, const PlaceLayout& layout, const std::string& file,
                std::uint64_t line_number);

/// Appends the line to `text`, in the columns of its place x and y instead.
void append_with_place(std::string& text, std::string_view line, const PlaceLayout& layout,
                       std::string_view x, std::string_view y);

}  // namespace terrace::terrain
