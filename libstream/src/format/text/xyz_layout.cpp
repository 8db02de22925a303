// SPDX-License-Identifier: Apache-2.0
#include "format/text/xyz_layout.hpp"

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <utility>

#include "io/number.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kMaxComments = 1000;

/// True for a number, and for what begins like one ("1,5", "12m"): a damaged number is no name.
bool is_number(std::string_view field) {
  field = unquoted(field);
  const std::size_t first = std::min(field.find_first_not_of("+-."), field.size());
  if (first < field.size() && field[first] >= '0' && field[first] <= '9') return true;
  double value = 0;
  const char* end = field.data() + field.size();
  return !field.empty() && parse_real(field.data(), end, value) == end;
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return out;
}

/// What a column's name says: an axis by its letter or by a word for it, an angle of the earth.
struct Axis {
  std::size_t index;
  bool letter;
  bool angle;
};
std::optional<Axis> axis_of(std::string_view name) {
  const std::string key = lower(name);
  const auto any = [&](std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), key) != names.end();
  };
  if (any({"x", "y", "z"})) return Axis{static_cast<std::size_t>(key[0] - 'x'), true, false};
  if (any({"easting", "east"})) return Axis{0, false, false};
  if (any({"northing", "north"})) return Axis{1, false, false};
  if (any({"lon", "long", "lng", "longitude"})) return Axis{0, false, true};
  if (any({"lat", "latitude"})) return Axis{1, false, true};
  if (any({"h", "height", "elevation", "elev", "ele", "alt", "altitude"})) {
    return Axis{2, false, false};
  }
  return std::nullopt;
}

/// Finds the coordinates among the names. Letters go before words, so that in "x,y,z,lat,lon" the
/// last two are attributes; of several words for the height the first one counts. Without any name
/// that says an axis the first three columns stay what they are.
/// Throws: Error if only some axes are named, or one of x and y twice.
void find_axes(const std::vector<std::string_view>& names, TextLayout& layout,
               const std::string& file, const std::string& where) {
  std::array<std::optional<std::size_t>, 3> found;
  std::array<bool, 3> angle{};
  for (const bool letters : {true, false}) {
    const auto before = found;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto axis = axis_of(names[i]);
      if (!axis || axis->letter != letters || before[axis->index]) continue;
      auto& column = found[axis->index];
      if (column && axis->index == 2 && !letters) continue;
      if (column) {
        throw Error({.file = file,
                     .where = where,
                     .cause = "columns " + in_quotes(names[*column]) + " and " +
                              in_quotes(names[i]) + " name the same coordinate",
                     .remedy = "rename one of them"});
      }
      column = i;
      angle[axis->index] = axis->angle;
    }
  }
  if (!found[0] && !found[1] && !found[2]) return;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!found[axis]) {
      throw Error({.file = file,
                   .where = where,
                   .cause = std::string("the header names no ") + "xyz"[axis] + " column",
                   .remedy = "name the columns x, y and z, or lon, lat and height"});
    }
    layout.xyz[axis] = *found[axis];
  }
  layout.geographic = angle[0] && angle[1];
}

/// Names and numbers the columns that are no coordinates; names become distinct and not empty.
void name_attributes(const std::vector<std::string_view>& names, TextLayout& layout) {
  for (std::size_t i = 0; i < layout.columns; ++i) {
    if (std::find(layout.xyz.begin(), layout.xyz.end(), i) != layout.xyz.end()) continue;
    std::string name = i < names.size() ? std::string(names[i]) : std::string();
    if (name.empty()) name.append("a").append(std::to_string(i));
    const std::string base = name;
    const auto taken = [&] {
      return std::find(layout.names.begin(), layout.names.end(), name) != layout.names.end();
    };
    for (int n = 2; taken(); ++n) name.assign(base).append("_").append(std::to_string(n));
    layout.attributes.push_back(i);
    layout.names.push_back(std::move(name));
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

/// True if tabs separate the first line of numbers and the header, if there is one: the fields of
/// one of them are then complete (the name of the first may be missing).
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

std::vector<std::string_view> header_names(std::string_view line, char separator) {
  std::vector<std::string_view> names = split_fields(line, separator);
  for (std::string_view& name : names) name = unquoted(name);
  return names;
}

/// A comment can be the header too ("//X Y Z Intensity"): if it has the letters and fits the data.
bool is_header_comment(const std::vector<std::string_view>& names, std::size_t columns) {
  if (names.size() != columns) return false;
  std::array<int, 3> seen{};
  for (const std::string_view name : names) {
    const auto axis = axis_of(name);
    if (axis && axis->letter) ++seen[axis->index];
  }
  return seen == std::array{1, 1, 1};
}

std::string_view comment_text(std::string_view comment) {
  while (!comment.empty() && (comment.front() == '#' || comment.front() == '/')) {
    comment.remove_prefix(1);
  }
  return trim(comment);
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
  // A quote that no other closes is one of a name's characters.
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
  std::string header, last_comment;
  std::uint64_t header_line = 0;
  std::string_view line;
  for (;;) {
    if (!lines.next(line)) {
      throw Error({.file = file,
                   .where = {},
                   .cause = lines.number() == 0 ? "the file is empty" : "there are no points in it",
                   .remedy = "each line needs three numbers: x, y and z"});
    }
    const std::string_view text = trim(line);
    if (text.empty()) continue;
    if (is_comment(text)) {
      last_comment = comment_text(text);
      if (layout.comments.size() < kMaxComments) layout.comments.push_back(last_comment);
      continue;
    }
    if (header_line == 0 && is_header(split_fields(line, separator_of(line)))) {
      header = line;
      header_line = lines.number();
      continue;
    }
    break;
  }
  layout.separator = separator_of(line);
  const std::string& title = header_line != 0 ? header : last_comment;
  if (layout.separator == ' ' && separator_of(title) == ' ' &&
      (is_separated_by_tabs(title, line) || (header_line == 0 && is_separated_by_tabs({}, line)))) {
    layout.separator = '\t';
  }
  const char between_names = layout.separator == '\t' ? '\t' : separator_of(title);
  layout.columns = split_fields(line, layout.separator).size();
  const std::string where = "line " + std::to_string(lines.number());
  if (layout.columns < 3) {
    throw Error({.file = file,
                 .where = where,
                 .cause = "has " + std::to_string(layout.columns) +
                          (layout.columns == 1 ? " column" : " columns") +
                          ", but a point needs x, y and z",
                 .remedy = "add the missing column (0 as z for points in the plane)"});
  }
  if (layout.columns > TextLayout::kMaxColumns) {
    throw Error({.file = file,
                 .where = where,
                 .cause = "has " + std::to_string(layout.columns) + " columns",
                 .remedy = "at most " + std::to_string(TextLayout::kMaxColumns) + " are read"});
  }
  if (header_line == 0 &&
      is_header_comment(header_names(last_comment, between_names), layout.columns)) {
    header = last_comment;
    layout.comments.pop_back();
  }
  const std::vector<std::string_view> names = header_names(header, between_names);
  if (header_line != 0 && names.size() != layout.columns) {
    throw Error({.file = file,
                 .where = where,
                 .cause = "has " + std::to_string(layout.columns) + " columns, but the header in " +
                          "line " + std::to_string(header_line) + " names " +
                          std::to_string(names.size()),
                 .remedy = "one of them is wrong"});
  }
  find_axes(names, layout, file, "line " + std::to_string(header_line));
  name_attributes(names, layout);
  lines.hold();
  return layout;
}

}  // namespace terrace::stream
