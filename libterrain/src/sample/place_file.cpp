// SPDX-License-Identifier: Apache-2.0
#include "sample/place_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/core.h>

#include "base/units.hpp"
#include "terrace/stream/axis_names.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kLongestPlaceLine = std::size_t{1} << 20, kReadAtOnce = std::size_t{1} << 22;

/// Removes the cell at the start of `rest` and the separator after it. Separators within double
/// quotes belong to the cell.
std::string_view take_text(std::string_view& rest, char separator) {
  bool quoted = false;
  std::size_t end = 0;
  while (end < rest.size() && (quoted || rest[end] != separator)) {
    if (rest[end] == '"') quoted = !quoted;
    ++end;
  }
  const std::string_view cell = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return cell;
}

std::string_view bare(std::string_view cell) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  for (;;) {
    while (!cell.empty() && blank(cell.front())) cell.remove_prefix(1);
    while (!cell.empty() && blank(cell.back())) cell.remove_suffix(1);
    if (cell.size() < 2 || cell.front() != '"' || cell.back() != '"') return cell;
    cell = cell.substr(1, cell.size() - 2);
  }
}

std::optional<double> number_in(std::string_view cell) {
  cell = bare(cell);
  if (cell.empty() || cell == "NA") return std::numeric_limits<double>::quiet_NaN();
  if (cell.front() == '+') cell.remove_prefix(1);
  return number_from<double>(cell);
}

/// Finds the columns of x and y by the names in a header. Among several pairs it prefers the most
/// explicit names, and longitude and latitude over other words.
std::optional<std::array<std::size_t, 2>> place_columns(
    const std::vector<std::string_view>& names) {
  for (std::size_t kind = 0; kind < stream::kAxisNameKinds; ++kind) {
    for (const bool angle : {true, false}) {
      std::array<std::optional<std::size_t>, 2> found;
      for (std::size_t i = 0; i < names.size(); ++i) {
        const auto name = stream::axis_named(names[i]);
        if (!name || name->axis > 1 || name->angle != angle ||
            name->kind != static_cast<stream::AxisNameKind>(kind)) {
          continue;
        }
        if (!found[name->axis]) found[name->axis] = i;
      }
      if (found[0] && found[1]) return std::array{*found[0], *found[1]};
    }
  }
  return std::nullopt;
}

/// Whether a line is two numbers or more, some with a decimal comma, between semicolons or tabs.
bool has_decimal_commas(std::string_view line) {
  const std::size_t at = line.find_first_of(";\t");
  if (at == std::string_view::npos) return false;
  const char separator = line[at];
  bool found = false;
  for (int column = 0; column < 2; ++column) {
    std::string cell(bare(take_text(line, separator)));
    const std::size_t comma = cell.find(',');
    if (comma != std::string::npos) cell[comma] = '.';
    if (!number_in(cell)) return false;
    found = found || comma != std::string::npos;
  }
  return found;
}

}  // namespace

PlaceLayout PlaceLayout::of(std::string_view first_line, const std::string& file,
                            std::string_view comment) {
  PlaceLayout layout;
  const std::string_view text = bare(first_line);
  const bool json = text.starts_with('{') || text.starts_with('[');
  const bool binary = std::ranges::any_of(first_line, [](char c) {
    return static_cast<unsigned char>(c) < ' ' && c != '\t' && c != '\r';
  });
  if (json || binary || text.starts_with('<')) {
    throw stream::Error(file, std::string("is ") +
                                  (json     ? "JSON"
                                   : binary ? "not text"
                                            : "XML") +
                                  ", not a table of places")
        .remedy("pass CSV; 'ogr2ogr -f CSV -lco GEOMETRY=AS_XY out.csv " + file +
                "' converts what GDAL can read");
  }
  if (has_decimal_commas(first_line)) {
    throw stream::Error(file, "has numbers with a decimal comma")
        .at("the first line")
        .remedy("write numbers with a decimal point");
  }
  if (const std::size_t at = first_line.find_first_of(",;\t"); at != std::string_view::npos) {
    layout.separator = first_line[at];
  } else {
    throw stream::Error(file, "the first line has only one column")
        .remedy("write x and y with a comma, a semicolon or a tab between them");
  }
  const auto cells_of = [&layout](std::string_view line) {
    std::vector<std::string_view> cells;
    while (!line.empty()) cells.push_back(bare(take_text(line, layout.separator)));
    return cells;
  };
  const std::vector<std::string_view> cells = cells_of(first_line);
  const auto is_number = [](std::string_view cell) { return number_in(cell).has_value(); };
  std::optional<std::array<std::size_t, 2>> columns = place_columns(cells);
  const std::size_t first_two = std::min<std::size_t>(cells.size(), 2);
  layout.header = columns || !std::all_of(cells.data(), cells.data() + first_two, is_number);
  if (layout.header) {
    layout.names.assign(cells.begin(), cells.end());
    for (std::string& name : layout.names) {
      for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
    }
    if (!columns) {
      throw stream::Error(file, "the header names no x and y column")
          .at("the first line")
          .remedy(
              "name the columns x and y, or lon and lat; without a header, "
              "the first two are x and y");
    }
  } else {
    comment.remove_prefix(std::min(comment.find_first_not_of("# "), comment.size()));
    const std::vector<std::string_view> names = cells_of(comment);
    if (names.size() == cells.size()) columns = place_columns(names);
  }
  if (columns) {
    layout.x = (*columns)[0];
    layout.y = (*columns)[1];
  }
  return layout;
}

std::string_view PlaceBatch::line(std::size_t i) const {
  std::string_view line(text.data() + begins[i], begins[i + 1] - begins[i]);
  if (line.ends_with('\n')) line.remove_suffix(1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

PlaceFile::PlaceFile(const std::string& path, std::stop_token stop)
    : input_(path, std::move(stop), kReadAtOnce) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (input_.fill(kByteOrderMark.size()).starts_with(kByteOrderMark)) {
    input_.consume(kByteOrderMark.size());
  }
}

bool PlaceFile::next(PlaceBatch& batch, std::size_t max_bytes, std::size_t max_lines) {
  const std::size_t limit = std::max(max_bytes, kLongestPlaceLine);
  const std::string_view window = input_.fill(limit);
  const bool ended = window.size() < limit;
  batch.begins.clear();
  batch.first_line = line_;
  std::size_t end = 0;
  while (end < window.size() && batch.begins.size() < max_lines) {
    const std::size_t found = window.find('\n', end);
    if (found == std::string_view::npos && !ended) break;
    batch.begins.push_back(end);
    end = found == std::string_view::npos ? window.size() : found + 1;
  }
  if (batch.begins.empty()) {
    if (window.empty()) return false;
    throw stream::Error(name(), "is longer than any line of a table")
        .at_line(line_)
        .remedy("pass a text file with one place per line");
  }
  batch.text.assign(window.substr(0, end));
  batch.begins.push_back(end);
  input_.consume(end);
  line_ += batch.size();
  return true;
}

bool is_skipped_line(std::string_view line) { return line.empty() || line.front() == '#'; }

Point2 place_of(std::string_view line, const PlaceLayout& layout, const std::string& file,
                std::uint64_t line_number) {
  Point2 place{};
  const std::size_t last = std::max(layout.x, layout.y);
  std::size_t cells = 0;
  std::string_view rest = line;
  for (std::size_t column = 0; column <= last && !rest.empty(); ++column) {
    const std::string_view cell = take_text(rest, layout.separator);
    if (column != layout.x && column != layout.y) continue;
    const std::optional<double> value = number_in(cell);
    if (!value) {
      throw stream::Error(file, fmt::format("'{}' is not a coordinate", cell.substr(0, 40)))
          .at_line(line_number)
          .remedy(cell.find(',') != cell.npos
                      ? "write numbers with a decimal point"
                      : fmt::format("coordinates are plain numbers, in column {} and column {}",
                                    layout.x + 1, layout.y + 1));
    }
    place[column == layout.x ? 0 : 1] = *value;
    ++cells;
  }
  // A line that ends with the separator has an empty cell after it.
  if (cells == 1 && !line.empty() && line.back() == layout.separator) {
    place[last == layout.x ? 0 : 1] = std::numeric_limits<double>::quiet_NaN();
    ++cells;
  }
  if (cells < 2) {
    throw stream::Error(file, "has fewer columns than the first line")
        .at_line(line_number)
        .remedy("write x and y in every line");
  }
  return place;
}

void append_with_place(std::string& text, std::string_view line, const PlaceLayout& layout,
                       std::string_view x, std::string_view y) {
  for (std::size_t column = 0;; ++column) {
    const std::string_view before = line;
    const std::string_view cell = take_text(line, layout.separator);
    text += column == layout.x ? x : column == layout.y ? y : cell;
    if (cell.size() == before.size()) return;
    text += layout.separator;
  }
}

}  // namespace terrace::terrain
