// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "svg_plot.hpp"

/// Writes results: tables to stdout and as CSV into a folder, plots as SVG into the folder.

namespace terrace::research {

struct Table {
  std::string name;  ///< name of the file
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows = {};  ///< as many cells as columns

  void add(std::vector<std::string> row) { rows.push_back(std::move(row)); }
};

/// Format numbers as text: 1234.5678 with 2 digits is "1234.57", 12345678 is "12 345 678", and a
/// fraction of 0.0123 is "1.2 %".
std::string fixed(double value, int digits);
std::string grouped(std::uint64_t value);
std::string percent(double share, int digits = 1);
/// Returns the fraction of the time `before` that `after` saves, as the thesis states speed-ups:
/// twice as fast is "50 %".
std::string time_saved(double before, double after);
/// Returns "[0:20:18]" for a figure of the thesis in one of our columns.
std::string cited(std::string_view figure);
/// Returns the shortest decimal that reads back as the same number.
std::string exact(double value);
/// Returns the processor, the number of cores and the compiler.
std::string machine();

class Report {
 public:
  /// Creates the folder. Without a folder no files are written.
  /// Throws: std::filesystem::filesystem_error.
  explicit Report(std::optional<std::filesystem::path> folder);

  /// Writes a table. Throws: std::logic_error for a row of the wrong length, std::runtime_error if
  /// a file cannot be written.
  void table(const Table& table);
  /// Writes a table as CSV only.
  void data(const Table& table);
  void plot(const std::string& name, const Plot& plot);
  void note(std::string_view text);

 private:
  void write(const std::string& file, const std::string& text) const;
  std::optional<std::filesystem::path> folder_;
};

}  // namespace terrace::research
