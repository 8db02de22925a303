// SPDX-License-Identifier: Apache-2.0
#include "format/text/xyz_layout.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/core.h>

#include "io/distinct_names.hpp"
#include "io/number.hpp"
#include "io/text.hpp"
#include "terrace/stream/axis_names.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kMaxComments = 1000;

/// True for a number and for text that begins like one ("1,5", "12m"), which is a damaged number
/// rather than a name.
bool is_number(std::string_view field) {
  field = unquoted(field);
  const std::size_t first = std::min(field.find_first_not_of("+-."), field.size());
  if (first < field.size() && field[first] >= '0' && field[first] <= '9') return true;
  double value = 0;
  const char* end = field.data() + field.size();
  return !field.empty() && parse_real(field.data(), end, value) == end;
}

/// The columns with names of coordinates.
struct NamedAxes {
  std::array<std::optional<std::size_t>, 3> columns;
  std::array<bool, 3> angle{};
  /// A second column for an axis with a name of the same kind; only heights may have several words.
  std::optional<std::size_t> duplicate;

  [[nodiscard]] bool none() const { return !columns[0] && !columns[1] && !columns[2]; }
  [[nodiscard]] bool complete() const {
    return columns[0] && columns[1] && columns[2] && !duplicate;
  }
};

/// Letters take precedence over words, so that in "x,y,z,lat,lon" the last two are attributes. Of
/// several words for the height, the first one is used.
NamedAxes named_axes(const std::vector<std::string_view>& names) {
  NamedAxes axes;
  for (std::size_t kind = 0; kind < kAxisNameKinds; ++kind) {
    const auto before = axes.columns;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto name = axis_named(names[i]);
      if (!name || name->kind != static_cast<AxisNameKind>(kind) || before[name->axis]) continue;
      auto& column = axes.columns[name->axis];
      if (column) {
        const bool height = name->axis == 2 && name->kind != AxisNameKind::letter;
        if (!height && !axes.duplicate) axes.duplicate = i;
        continue;
      }
      column = i;
      axes.angle[name->axis] = name->angle;
    }
  }
  return axes;
}

/// Finds the coordinates among the names of a header. Throws: Error if one of them is missing or
/// ambiguous.
void find_axes(const std::vector<std::string_view>& names, TextLayout& layout,
               const std::string& file, const std::string& where) {
  const NamedAxes axes = named_axes(names);
  if (axes.duplicate) {
    const std::size_t axis = axis_named(names[*axes.duplicate])->axis;
    throw Error(
        file, fmt::format("columns {} and {} name the same coordinate",
                          in_quotes(names[*axes.columns[axis]]), in_quotes(names[*axes.duplicate])))
        .at(where)
        .remedy("rename one of them");
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!axes.columns[axis]) {
      throw Error(file, fmt::format("the header names no {} column", "xyz"[axis]))
          .at(where)
          .remedy(axes.none() ? "name the columns x, y and z, or lon, lat and height; "
                                "without the header, the first three are x, y and z"
                              : "name the columns x, y and z, or lon, lat and height");
    }
    layout.xyz[axis] = *axes.columns[axis];
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    layout.units[axis] = axis_unit(names[layout.xyz[axis]]);
  }
  layout.geographic = (axes.angle[0] && axes.angle[1]) ||
                      (layout.units[0] == "degree" && layout.units[1] == "degree");
}

/// Lists the columns that are not coordinates, with distinct names that are not empty.
void name_attributes(const std::vector<std::string_view>& names, TextLayout& layout) {
  DistinctNames distinct;
  for (std::size_t i = 0; i < layout.columns; ++i) {
    if (std::find(layout.xyz.begin(), layout.xyz.end(), i) != layout.xyz.end()) continue;
    std::string name = i < names.size() ? std::string(names[i]) : std::string();
    if (name.empty()) name = fmt::format("a{}", i);
    layout.attributes.push_back(i);
    layout.names.push_back(distinct.add(name));
  }
}

/// True for "1 2" but not "1" or "New York".
bool is_several_numbers(std::string_view field) {
  const std::vector<std::string_view> words = split_fields(field, ' ');
  return words.size() > 1 && std::all_of(words.begin(), words.end(), [](std::string_view word) {
           double value = 0;
           const char* const end = word.data() + word.size();
           return parse_real(word.data(), end, value) == end;
         });
}

/// True if tabs separate the fields of the first line of numbers and of the header, if there is
/// one. The fields of the header, or else of the line, must then be complete; only the first name
/// may be missing.
bool is_separated_by_tabs(std::string_view header, std::string_view line) {
  const std::vector<std::string_view> fields = split_fields(line, '\t');
  if (fields.size() < 3 || std::any_of(fields.begin(), fields.end(), is_several_numbers)) {
    return false;
  }
  const auto empty = [](std::string_view field) { return field.empty(); };
  if (header.empty()) return std::none_of(fields.begin(), fields.end(), empty);
  const std::vector<std::string_view> names = split_fields(header, '\t');
  return names.size() == fields.size() && std::none_of(names.begin() + 1, names.end(), empty);
}

/// True if blanks or tabs separate numbers, some of which have a decimal comma ("1,5 2,5 3").
bool has_decimal_commas(std::string_view line) {
  const std::vector<std::string_view> words = split_fields(line, ' ');
  bool has_comma = false;
  const bool numbers = std::all_of(words.begin(), words.end(), [&](std::string_view word) {
    std::string number(unquoted(word));
    const std::size_t comma = number.find(',');
    const auto is_digit = [&](std::size_t at) {
      return at < number.size() && number[at] >= '0' && number[at] <= '9';
    };
    if (comma != std::string::npos) {
      if (comma == 0 || !is_digit(comma - 1) || !is_digit(comma + 1)) return false;
      number[comma] = '.';
      has_comma = true;
    }
    double value = 0;
    const char* const end = number.data() + number.size();
    return parse_real(number.data(), end, value) == end;
  });
  return words.size() > 1 && numbers && has_comma;
}

std::vector<std::string_view> header_names(std::string_view line, char separator) {
  std::vector<std::string_view> names = split_fields(line, separator);
  for (std::string_view& name : names) name = unquoted(name);
  return names;
}

/// A comment ("//X Y Z Intensity") is the header if it names all coordinates and has as many names
/// as there are columns.
bool is_header_comment(const std::vector<std::string_view>& names, std::size_t columns) {
  return names.size() == columns && named_axes(names).complete();
}

std::string_view comment_text(std::string_view comment) {
  while (!comment.empty() && (comment.front() == '#' || comment.front() == '/')) {
    comment.remove_prefix(1);
  }
  return trim(comment);
}

/// The lines before the first row of numbers.
struct Preamble {
  std::string header, last_comment;
  std::uint64_t header_line = 0;  ///< 0: there is no header

  [[nodiscard]] bool has_header() const { return header_line != 0; }
  /// Returns the line that may name the columns.
  [[nodiscard]] const std::string& title() const { return has_header() ? header : last_comment; }
};

/// Reads to the first row of numbers, which `line` then is.
Preamble read_preamble(LineReader& lines, const std::string& file, std::string_view& line,
                       std::vector<std::string>& comments) {
  Preamble preamble;
  while (lines.next(line)) {
    const std::string_view text = trim(line);
    if (text.empty()) continue;
    if (is_comment(text)) {
      preamble.last_comment = comment_text(text);
      if (comments.size() < kMaxComments) comments.push_back(preamble.last_comment);
    } else if (!preamble.has_header() && is_header(split_fields(line, separator_of(line)))) {
      preamble.header = line;
      preamble.header_line = lines.number();
    } else {
      return preamble;
    }
  }
  throw Error(file, lines.number() == 0 ? "the file is empty" : "it has no points")
      .remedy("each line needs three numbers: x, y and z");
}

/// Returns the separator of the first row of numbers.
char row_separator(std::string_view line, const Preamble& preamble) {
  const char separator = separator_of(line);
  const std::string& title = preamble.title();
  if (separator == ' ' && separator_of(title) == ' ' &&
      (is_separated_by_tabs(title, line) ||
       (!preamble.has_header() && is_separated_by_tabs({}, line)))) {
    return '\t';
  }
  return separator;
}

/// Throws: Error if a row of that many columns is not a point.
void check_columns(std::size_t columns, const std::string& file, const std::string& where) {
  if (columns < 3) {
    throw Error(file, "has " + counted(columns, "column") + ", but a point needs x, y and z")
        .at(where)
        .remedy("add the missing column (0 as z for points in the plane)");
  }
  if (columns > TextLayout::kMaxColumns) {
    throw Error(file, "has " + counted(columns, "column"))
        .at(where)
        .remedy(fmt::format("at most {} are read", TextLayout::kMaxColumns));
  }
}

}  // namespace

bool is_comment(std::string_view line) { return line.starts_with('#') || line.starts_with("//"); }

std::vector<std::string_view> split_row(std::string_view line, const TextLayout& layout) {
  std::vector<std::string_view> fields = split_fields(line, layout.separator);
  if (layout.separator == '\t' && fields.size() != layout.columns) {
    std::vector<std::string_view> words = split_fields(line, ' ');
    if (words.size() == layout.columns) return words;
  }
  return fields;
}

char separator_of(std::string_view line) {
  // An unclosed quote is part of a name.
  const bool quotes = std::count(line.begin(), line.end(), '"') % 2 == 0;
  char separator = ' ';
  bool quoted = false;
  for (const char c : line) {
    if (quotes && c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == ';') return c;
    if (c == ',') separator = c;
  }
  return separator;
}

bool is_header(const std::vector<std::string_view>& fields) {
  return std::none_of(fields.begin(), fields.end(), is_number);
}

TextLayout read_text_layout(LineReader& lines, const std::string& file) {
  TextLayout layout;
  std::string_view line;
  Preamble preamble = read_preamble(lines, file, line, layout.comments);
  if (separator_of(line) == ',' && has_decimal_commas(line)) {
    throw Error(file, "has numbers with a decimal comma")
        .at_line(lines.number())
        .remedy("write numbers with a decimal point");
  }
  layout.separator = row_separator(line, preamble);
  layout.columns = split_fields(line, layout.separator).size();
  const std::string where = fmt::format("line {}", lines.number());
  check_columns(layout.columns, file, where);
  const char between_names = layout.separator == '\t' ? '\t' : separator_of(preamble.title());
  if (!preamble.has_header() &&
      is_header_comment(header_names(preamble.last_comment, between_names), layout.columns)) {
    preamble.header = preamble.last_comment;
    layout.comments.pop_back();
  }
  const std::vector<std::string_view> names = header_names(preamble.header, between_names);
  if (preamble.has_header() && names.size() != layout.columns) {
    throw Error(file,
                fmt::format("has {}, but the header in line {} names {}",
                            counted(layout.columns, "column"), preamble.header_line, names.size()))
        .at(where)
        .remedy("one of them is wrong");
  }
  if (!preamble.header.empty()) {
    find_axes(names, layout, file, fmt::format("line {}", preamble.header_line));
  }
  name_attributes(names, layout);
  lines.hold();
  return layout;
}

}  // namespace terrace::stream
