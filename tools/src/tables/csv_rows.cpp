// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/csv_rows.hpp"

#include <array>
#include <filesystem>
#include <utility>

#include "terrace/stream/error.hpp"

namespace terrace::tools {
namespace {

/// Limit for a line in bytes. A binary file may be a single line of gigabytes.
constexpr std::size_t kLongestLine = 1000;

}  // namespace

std::optional<CsvRows> CsvRows::open(const std::string& path, std::string_view header) {
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  CsvRows rows(path, std::ifstream(path));
  // One more byte, for a carriage return.
  std::array<char, 100> first{};
  rows.stream_.getline(first.data(), static_cast<std::streamsize>(header.size() + 2));
  const auto count = static_cast<std::size_t>(rows.stream_.gcount());
  if (!rows.stream_ || count == 0) return std::nullopt;
  rows.number_ = 1;
  std::string_view line(first.data(), rows.stream_.eof() ? count : count - 1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line == header ? std::optional(std::move(rows)) : std::nullopt;
}

bool CsvRows::next(std::string_view& line) {
  do {
    line_.resize(kLongestLine);
    stream_.getline(line_.data(), static_cast<std::streamsize>(line_.size()));
    const auto count = static_cast<std::size_t>(stream_.gcount());
    if (stream_.fail() && (stream_.eof() || stream_.bad())) return false;
    ++number_;
    if (stream_.fail()) {
      throw stream::Error(path_, "is longer than any row")
          .at(where())
          .remedy("rows are a few numbers with commas");
    }
    // The count includes the line end, if there is one.
    line_.resize(stream_.eof() ? count : count - 1);
    if (line_.ends_with('\r')) line_.pop_back();
  } while (line_.empty());
  line = line_;
  return true;
}

}  // namespace terrace::tools
