// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/chain.hpp"
#include "format/missing.hpp"
#include "format/registry.hpp"
#include "format/selection.hpp"
#include "format/text/xyz_layout.hpp"
#include "io/line_reader.hpp"
#include "io/number.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/unit_words.hpp"

namespace terrace::stream {
namespace {

/// Reads a number into the 64 bits of `cell` and returns its end, null if there is none. The bits
/// are those of a double or, if the type is a 64-bit integer, of that integer.
const char* parse_number(const char* at, const char* end, ScalarType type, double& cell) {
  if (type == ScalarType::f64) return parse_real(at, end, cell);
  if (at != end && *at == '+') {
    ++at;
    if (at != end && *at == '-') return nullptr;
  }
  const auto parse = [&](auto number) -> const char* {
    const auto [rest, error] = std::from_chars(at, end, number);
    if (error != std::errc{}) return nullptr;
    cell = std::bit_cast<double>(number);
    return rest;
  };
  return type == ScalarType::u64 ? parse(std::uint64_t{}) : parse(std::int64_t{});
}

/// True for a missing value: an empty field (pandas, QGIS) or NA (R). NaN counts as a number.
bool is_missing_value(std::string_view field) {
  field = trim(unquoted(field));
  return field.empty() || field == "NA";
}

/// True for digits, with a sign or without.
bool is_integer(std::string_view field) {
  if (field.starts_with('-') || field.starts_with('+')) field.remove_prefix(1);
  return !field.empty() && field.find_first_not_of("0123456789") == field.npos;
}

/// True if `value` is exactly the integer in `field`.
bool is_exact(std::string_view field, double value) {
  field.remove_prefix(std::min(field.find_first_not_of("+-0"), field.size()));
  char digits[std::numeric_limits<double>::max_exponent10 + 2];
  const char* const end =
      std::to_chars(digits, digits + sizeof digits, std::abs(value), std::chars_format::fixed, 0)
          .ptr;
  return field == std::string_view(digits, end);
}

/// The byte order mark of UTF-8, which may precede the text.
constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";

/// Doubles hold every integer up to this one.
constexpr std::int64_t kMaxExactInteger = std::int64_t{1} << 53;

/// Properties of the first fields of a column.
struct ColumnContent {
  bool integers = true;      ///< all fields that are not empty are integers
  bool has_missing = false;  ///< some fields are empty
  bool large = false, negative = false;
  bool needs_unsigned = false;  ///< some integers fit only into 64 bits without a sign

  void add(std::string_view field) {
    if (is_missing_value(field)) {
      has_missing = true;
      return;
    }
    integers = integers && is_integer(field);
    if (!integers) return;
    double bits = 0;
    const char* const end = field.data() + field.size();
    if (parse_number(field.data(), end, ScalarType::i64, bits) != nullptr) {
      const auto value = std::bit_cast<std::int64_t>(bits);
      large = large || value > kMaxExactInteger || value < -kMaxExactInteger;
      negative = negative || value < 0;
    } else if (parse_number(field.data(), end, ScalarType::u64, bits) != nullptr) {
      needs_unsigned = true;
    }
  }
  [[nodiscard]] ScalarType type() const {
    if (!integers || has_missing || !(large || needs_unsigned) || (needs_unsigned && negative)) {
      return ScalarType::f64;
    }
    return needs_unsigned ? ScalarType::u64 : ScalarType::i64;
  }
};

/// Reads a line of numbers of these types. Returns false for any other line.
/// kSeparator: ',', ';' or a tab, or ' ' for runs of blanks. kReal: all types are f64.
template <char kSeparator, bool kReal>
bool parse_row(const char* at, const char* end, std::span<const ScalarType> types, double* row) {
  const auto is_skipped = [](char c) {
    return is_blank(c) && (kSeparator == ' ' || c != kSeparator);
  };
  for (std::size_t i = 0;; ++i) {
    while (at != end && is_skipped(*at)) ++at;
    if constexpr (kReal) {
      at = parse_real(at, end, row[i]);
    } else {
      at = parse_number(at, end, types[i], row[i]);
    }
    if (at == nullptr) return false;
    const char* const number_end = at;
    while (at != end && is_skipped(*at)) ++at;
    if (i + 1 == types.size()) return at == end;
    if constexpr (kSeparator == ' ') {
      if (at == number_end) return false;
    } else {
      if (at == end || *at != kSeparator) return false;
      ++at;
    }
  }
}

using ParseRow = bool (*)(const char*, const char*, std::span<const ScalarType>, double*);

template <bool kReal>
ParseRow row_parser(char separator) {
  switch (separator) {
    case ',':
      return &parse_row<',', kReal>;
    case ';':
      return &parse_row<';', kReal>;
    case '\t':
      return &parse_row<'\t', kReal>;
    default:
      return &parse_row<' ', kReal>;
  }
}

/// Reads points from lines of text.
class XyzSource final : public PointSource {
 public:
  /// first_attributes: attributes of the first file. All files use their types.
  XyzSource(const std::string& file, const SourceOptions& options,
            std::span<const Channel> first_attributes)
      : input_(file, options.stop), lines_(input_), block_points_(options.block_points) {
    if (input_.fill(kUtf8Mark.size()).starts_with(kUtf8Mark)) {
      input_.consume(kUtf8Mark.size());
    }
    layout_ = read_text_layout(lines_, input_.name());
    row_.resize(layout_.columns);
    info_.format = "xyz";
    info_.files = {file};
    for (std::size_t axis = 0; axis < 3; ++axis) info_.coordinates[axis].name = "xyz"[axis];
    if (layout_.geographic) {
      info_.crs.geographic = true;
      info_.crs.horizontal_unit = "degree";
      info_.coordinates[0].unit = info_.coordinates[1].unit = "degree";
    }
    set_units();
    if (options.crs) info_.crs = *options.crs;
    for (const std::string& name : layout_.names) {
      info_.attributes.push_back({.name = name, .type = ScalarType::f64});
    }
    types_.assign(layout_.columns, ScalarType::f64);
    integer_columns_.resize(layout_.columns);
    info_.comments = layout_.comments;
    const std::vector<std::string> needed = needed_attributes(info_, options);
    is_ignored_.resize(layout_.columns);
    for (std::size_t i = 0; i < layout_.attributes.size(); ++i) {
      is_ignored_[layout_.attributes[i]] =
          std::find(needed.begin(), needed.end(), layout_.names[i]) == needed.end();
    }
    choose_types(first_attributes);
    const bool all_doubles = std::all_of(types_.begin(), types_.end(),
                                         [](ScalarType type) { return type == ScalarType::f64; });
    parse_row_ =
        all_doubles ? row_parser<true>(layout_.separator) : row_parser<false>(layout_.separator);
  }

  const SourceInfo& info() const override { return info_; }

  bool next(PointBlock& block) override {
    const std::size_t attributes = layout_.attributes.size();
    block.positions.resize(block_points_);
    block.payload.resize(block_points_ * attributes * sizeof(double));
    std::byte* record = block.payload.data();
    const auto [ix, iy, iz] = layout_.xyz;
    std::size_t count = 0;
    std::string_view line;
    while (count < block_points_ && lines_.next(line)) {
      const char* const begin = line.data();
      const char* const end = begin + line.size();
      empty_fields_ = 0;
      if (!parse_row_(begin, end, types_, row_.data())) {
        const std::string_view text = trim_left(line);
        if (text.empty() || is_comment(text)) continue;
        if (!parse_fields(line)) throw error_of_line(line);
      }
      const Point3 point{row_[ix], row_[iy], row_[iz]};
      // x - x is 0 unless x is infinite or NaN.
      if (!((point[0] - point[0]) + (point[1] - point[1]) + (point[2] - point[2]) == 0.0)) {
        if (is_infinite(point)) throw error_of_line(line);
        ++nodata_;
        continue;
      }
      empty_values_ += empty_fields_;
      block.positions[count] = point;
      for (const std::size_t column : layout_.attributes) {
        if (integer_columns_[column] &&
            std::abs(row_[column]) >= static_cast<double>(kMaxExactInteger)) {
          check_exact(line, column);
        }
        std::memcpy(record, &row_[column], sizeof(double));
        record += sizeof(double);
      }
      ++count;
    }
    lines_.release();
    block.positions.resize(count);
    block.payload.resize(count * attributes * sizeof(double));
    delivered_ += count;
    return count > 0;
  }

  Progress progress() const override {
    Progress progress{.points = delivered_, .nodata = nodata_, .empty_values = empty_values_};
    if (input_.size() && *input_.size() > 0) {
      progress.fraction =
          std::min(1.0, static_cast<double>(input_.offset()) / static_cast<double>(*input_.size()));
    }
    return progress;
  }

 private:
  /// Sets the units that the header names, and notes those that are ignored.
  void set_units() {
    const auto& [x, y, z] = layout_.units;
    if (!layout_.geographic && x == y && is_length_unit(x)) {
      info_.crs.horizontal_unit = info_.coordinates[0].unit = info_.coordinates[1].unit = x;
    }
    if (is_length_unit(z)) {
      info_.crs.vertical_unit = info_.coordinates[2].unit = z;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string& unit = layout_.units[axis];
      const bool is_valid =
          axis < 2 && layout_.geographic ? unit == "degree" : is_length_unit(unit);
      if (unit.empty() || is_valid) continue;
      info_.note += fmt::format("{}the unit {} of {} in the header is unknown and ignored",
                                info_.note.empty() ? input_.name() + ": " : "; ", in_quotes(unit),
                                "xyz"[axis]);
    }
    if (!layout_.geographic && x != y && (is_length_unit(x) || is_length_unit(y))) {
      info_.note += (info_.note.empty() ? input_.name() + ": " : "; ") +
                    "x and y have different units in the header; both are ignored";
    }
  }
  /// Makes columns 64-bit integers if the first lines have integers that doubles cannot hold.
  void choose_types(std::span<const Channel> first_attributes) {
    // About a hundred lines. Waits for them if the input is a pipe.
    constexpr std::size_t kHead = std::size_t{4} << 10;
    std::string_view head = input_.fill(kHead).substr(0, kHead);
    if (head.size() == kHead) head = head.substr(0, head.find_last_of("\r\n"));
    std::vector<ColumnContent> contents(layout_.columns);
    while (!head.empty()) {
      const std::size_t end = std::min(head.find_first_of("\r\n"), head.size());
      const std::string_view line = head.substr(0, end), text = trim_left(line);
      head.remove_prefix(std::min(end + 1, head.size()));
      if (text.empty() || is_comment(text)) continue;
      const std::vector<std::string_view> fields = split_row(line, layout_);
      if (fields.size() != layout_.columns) break;
      for (const std::size_t i : layout_.attributes) contents[i].add(unquoted(fields[i]));
    }
    for (std::size_t i = 0; i < layout_.attributes.size(); ++i) {
      const std::size_t column = layout_.attributes[i];
      if (is_ignored_[column]) continue;
      Channel& attribute = info_.attributes[i];
      const auto same =
          std::find_if(first_attributes.begin(), first_attributes.end(),
                       [&](const Channel& other) { return other.name == attribute.name; });
      attribute.type = same != first_attributes.end() ? same->type : contents[column].type();
      types_[column] = attribute.type;
      integer_columns_[column] = contents[column].integers && attribute.type == ScalarType::f64;
    }
  }

  /// Throws: Error if the column has an integer that its double does not represent exactly.
  void check_exact(std::string_view line, std::size_t column) const {
    const std::string_view field = unquoted(split_row(line, layout_)[column]);
    if (!is_integer(field) || is_exact(field, row_[column])) return;
    throw Error(input_.name(), fmt::format("column {}, {}, is an integer that a double cannot hold",
                                           column + 1, in_quotes(field)))
        .at_line(lines_.number())
        .remedy(message("move this line to the top of the first file, so that the column becomes "
                        "64-bit integers, or drop the column with {drop}"));
  }

  /// Reads a line with fields that are empty, in quotes, or text that is not needed.
  bool parse_fields(std::string_view line) {
    const std::vector<std::string_view> fields = split_row(line, layout_);
    if (fields.size() != layout_.columns) return false;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (parse_field(fields[i], types_[i], row_[i])) continue;
      if (!is_ignored_[i]) {
        if (types_[i] != ScalarType::f64 || !is_missing_value(fields[i])) return false;
        if (!is_coordinate(i)) ++empty_fields_;
      }
      row_[i] = std::numeric_limits<double>::quiet_NaN();
    }
    return true;
  }
  [[nodiscard]] bool is_coordinate(std::size_t column) const {
    return std::find(layout_.xyz.begin(), layout_.xyz.end(), column) != layout_.xyz.end();
  }
  static bool parse_field(std::string_view field, ScalarType type, double& value) {
    field = unquoted(field);
    const char* const end = field.data() + field.size();
    return parse_number(field.data(), end, type, value) == end;
  }

  /// Returns the error of a line that is not a point. The last return is for lines that only the
  /// fast parser rejects.
  [[nodiscard]] Error error_of_line(std::string_view line) const {
    const auto line_error = [&](std::string cause) {
      return Error(input_.name(), std::move(cause)).at_line(lines_.number());
    };
    const std::vector<std::string_view> fields = split_row(line, layout_);
    if (fields.size() != layout_.columns) {
      return line_error(fmt::format("has {}, but the previous lines have {}",
                                    counted(fields.size(), "column"), layout_.columns))
          .remedy(fmt::format("give every line {}", counted(layout_.columns, "column")));
    }
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const std::string_view field = fields[i];
      const std::string column = fmt::format("column {}", i + 1);
      const bool coordinate = is_coordinate(i);
      double value = 0;
      const bool is_double = types_[i] == ScalarType::f64, missing = is_missing_value(field);
      if (!parse_field(field, types_[i], value) && !is_ignored_[i] && !(is_double && missing)) {
        const std::string cause =
            column + (field.empty() ? " is empty, not" : ", " + in_quotes(field) + ", is not");
        if (!is_double) {
          return line_error(fmt::format("{} an integer of type {}, like the lines before it", cause,
                                        name_of(types_[i])))
              .remedy(message("correct it, or leave the column out ({drop} of build and convert)"));
        }
        return line_error(cause + " a number that fits into a double")
            .remedy(
                field.find(',') != field.npos ? "write numbers with a decimal point"
                : coordinate
                    ? "write numbers, or nothing or NA for missing values"
                    : message("write numbers, or nothing or NA for missing values, or leave the "
                              "column out ({drop} of build and convert)"));
      }
      if (coordinate && std::isinf(value)) {
        return line_error(fmt::format("{} is {}, but a coordinate must be finite", column, field))
            .remedy("leave the line out");
      }
    }
    return line_error("is not a point").remedy("correct it, or drop the line");
  }

  Input input_;
  LineReader lines_;
  std::size_t block_points_;
  TextLayout layout_;
  ParseRow parse_row_ = nullptr;
  std::vector<double> row_;            ///< 64 bits per column, see parse_number()
  std::vector<bool> is_ignored_;       ///< columns that are not needed: any text is valid
  std::vector<ScalarType> types_;      ///< one per column: f64, i64 or u64
  std::vector<bool> integer_columns_;  ///< columns of doubles that seem to be integers
  SourceInfo info_;
  std::uint64_t delivered_ = 0, nodata_ = 0, empty_values_ = 0;
  std::uint64_t empty_fields_ = 0;  ///< empty attributes of the current row
};

/// True for text that begins, after comments and at most one header line, with a row of numbers.
bool recognise_xyz(std::span<const std::byte> head) {
  std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  const auto is_text = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x20 ? byte != 0x7f : c == '\n' || c == '\r' || c == '\t';
  };
  if (!std::all_of(text.begin(), text.end(), is_text)) return false;
  if (text.starts_with(kUtf8Mark)) text.remove_prefix(kUtf8Mark.size());
  for (bool header_seen = false; !text.empty();) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    const std::string_view line = trim_left(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || is_comment(line)) continue;
    const auto fields = split_fields(line, separator_of(line));
    if (!is_header(fields)) {
      // A line with one column, or with words among its numbers, is prose or another format.
      return fields.size() >= 2 &&
             std::count_if(fields.begin(), fields.end(), [](std::string_view field) {
               return !is_header({field});
             }) >= std::min<std::ptrdiff_t>(3, static_cast<std::ptrdiff_t>(fields.size()));
    }
    if (header_seen) return false;
    header_seen = true;
  }
  return false;
}

std::unique_ptr<PointSource> open_xyz(std::span<const std::string> files,
                                      const SourceOptions& options) {
  assert(options.block_points > 0);
  const auto open_one = [first = std::vector<Channel>()](const std::string& file,
                                                         const SourceOptions& each) mutable {
    auto source = std::make_unique<XyzSource>(file, each, first);
    if (first.empty()) first = source->info().attributes;
    return source;
  };
  return open_in_sequence(files, options, open_one);
}

}  // namespace

const Format& xyz_format() {
  static const Format format{.name = "xyz",
                             .endings = {".xyz", ".csv", ".tsv", ".txt"},
                             .streams = true,
                             .recognise = &recognise_xyz,
                             .open = &open_xyz};
  return format;
}

}  // namespace terrace::stream
