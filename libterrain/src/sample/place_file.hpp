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

/// Tables of places as text, one place per line. They are read in batches, and each line is kept
/// unchanged so that answers can be appended to it.

namespace terrace::terrain {

/// The columns of x and y. If the first line is a header, or the comment before it has as many
/// names, they are the columns that stream::axis_named() recognises; otherwise the first two.
struct PlaceLayout {
  char separator = ',';  ///< ',', ';' or a tab: the first of these in the first line
  std::size_t x = 0, y = 1;
  bool header = false;             ///< whether the first line is a header
  std::vector<std::string> names;  ///< from the header, in lower case

  /// comment: the line before, used if `first_line` has no names. Throws: stream::Error, naming
  /// `file`, for a line with fewer than two columns and for a header that does not name x and y.
  static PlaceLayout of(std::string_view first_line, const std::string& file,
                        std::string_view comment = {});
};

/// Lines of text, some ended by "\n" and some by "\r\n"; line() returns them without their ends.
struct PlaceBatch {
  std::string text;
  std::vector<std::size_t> begins;  ///< begin of each line in text, then the end
  std::uint64_t first_line = 1;     ///< number of the first line in the file

  [[nodiscard]] std::size_t size() const { return begins.empty() ? 0 : begins.size() - 1; }
  [[nodiscard]] std::string_view line(std::size_t i) const;
};

class PlaceFile {
 public:
  /// path: "-" is standard input. stop: interrupts waiting for input. Throws: stream::Error if the
  /// file cannot be read.
  explicit PlaceFile(const std::string& path, std::stop_token stop = {});

  /// Reads the next complete lines, at most `max_lines` and about `max_bytes` of them. Returns
  /// false at the end. Throws: stream::Error on a line longer than a mebibyte, stream::Stopped.
  bool next(PlaceBatch& batch, std::size_t max_bytes, std::size_t max_lines);
  /// The name for messages.
  [[nodiscard]] const std::string& name() const { return input_.name(); }

 private:
  stream::Input input_;
  std::uint64_t line_ = 1;
};

/// Whether a line has no place, because it is empty or a comment (#). Such lines are copied.
bool is_skipped_line(std::string_view line);

/// Parses the place in a line; NaN where a coordinate is empty or "nan". Throws: stream::Error
/// naming file and line if a coordinate is not a number.
Point2 place_of(std::string_view line, const PlaceLayout& layout, const std::string& file,
                std::uint64_t line_number);

/// Appends the line to `text`, with x and y in the columns of its place.
void append_with_place(std::string& text, std::string_view line, const PlaceLayout& layout,
                       std::string_view x, std::string_view y);

}  // namespace terrace::terrain
