// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/line_reader.hpp"

namespace terrace::stream {

/// The layout and meaning of the columns of a text of points.
struct TextLayout {
  static constexpr std::size_t kMaxColumns = 1000;

  char separator = ' ';  ///< ',', ';' or a tab, or ' ' for runs of blanks and tabs
  std::size_t columns = 0;
  std::array<std::size_t, 3> xyz{0, 1, 2};  ///< columns of the coordinates
  std::vector<std::size_t> attributes;      ///< the other columns, in order
  std::vector<std::string> names;           ///< names of the attributes
  bool geographic = false;                  ///< the header names longitude and latitude
  std::array<std::string, 3> units;         ///< units of the coordinates, see axis_unit()
  std::vector<std::string> comments;        ///< before the first point
};

/// Returns the fields of a line. If tabs do not give as many fields as there are columns, runs of
/// blanks and tabs separate them, as in a table aligned by hand.
std::vector<std::string_view> split_row(std::string_view line, const TextLayout& layout);
/// Returns ';' if the line has one, else ',' if it has one, else ' '. Ignores text in double
/// quotes.
char separator_of(std::string_view line);
/// True for a line that starts with '#' or "//" (after trim_left).
bool is_comment(std::string_view line);
/// True if no field is a number.
bool is_header(const std::vector<std::string_view>& fields);

/// Reads the comments, the header line, if there is one, and examines the first line of numbers,
/// which `lines` then returns next. file: for messages. Throws: Error if that line is missing, has
/// fewer than three columns, or does not match the header.
TextLayout read_text_layout(LineReader& lines, const std::string& file);

}  // namespace terrace::stream
