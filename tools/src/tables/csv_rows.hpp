// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace terrace::tools {

/// The rows of a text file after its header line.
class CsvRows {
 public:
  /// Opens the file. Returns nullopt if its first line is not `header` or it is not a regular file.
  static std::optional<CsvRows> open(const std::string& path, std::string_view header);

  /// Sets `line` to the next non-empty line, without its line break. Returns false at the end of
  /// the file. Throws stream::Error if a line is too long to be a row.
  bool next(std::string_view& line);
  /// Returns the position of the line that next() returned, such as "line 3".
  [[nodiscard]] std::string where() const { return "line " + std::to_string(number_); }

 private:
  CsvRows(std::string path, std::ifstream stream)
      : path_(std::move(path)), stream_(std::move(stream)) {}

  std::string path_;
  std::ifstream stream_;
  std::string line_;
  std::uint64_t number_ = 0;
};

/// Parses the number at the start of `text` into `value` and removes it, with the comma after it.
/// If `last` is set, the number must end the text, with no comma. Returns false if the text does
/// not match; `text` may then be partly consumed.
template <class T>
bool take_cell(std::string_view& text, T& value, bool last = false) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  if (last) return text.empty();
  if (text.empty() || text.front() != ',') return false;
  text.remove_prefix(1);
  return true;
}

}  // namespace terrace::tools
