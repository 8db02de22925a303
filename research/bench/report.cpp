// SPDX-License-Identifier: GPL-3.0-or-later
#include "report.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace terrace::research {
namespace {

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string cell(1, '"');
  for (const char c : text) cell.append(c == '"' ? 2 : 1, c);
  cell += '"';
  return cell;
}

std::string csv_line(const std::vector<std::string>& cells) {
  std::string line;
  for (const std::string& cell : cells) {
    if (&cell != &cells.front()) line += ',';
    line += csv_cell(cell);
  }
  line += '\n';
  return line;
}

}  // namespace

std::string fixed(double value, int digits) {
  char text[400];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string grouped(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (std::size_t i = text.size(); i > 3;) text.insert(i -= 3, 1, ' ');
  return text;
}

std::string percent(double share, int digits) { return fixed(100.0 * share, digits) + " %"; }

std::string time_saved(double before, double after) {
  return before > 0.0 ? percent(1.0 - after / before, 0) : "-";
}

std::string cited(std::string_view figure) {
  std::string text(1, '[');
  text += figure;
  text += ']';
  return text;
}

std::string exact(double value) {
  char digits[64];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

std::string machine() {
  std::string model = "unknown processor";
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (!line.starts_with("model name") || colon == std::string::npos) continue;
    model = line.substr(colon + 2);
    break;
  }
#ifdef __clang__
  const std::string compiler = __VERSION__;
#else
  const std::string compiler = "GCC " __VERSION__;
#endif
  return model + ", " + std::to_string(std::thread::hardware_concurrency()) + " cores, " + compiler;
}

Report::Report(std::optional<std::filesystem::path> folder) : folder_(std::move(folder)) {
  if (folder_) std::filesystem::create_directories(*folder_);
}

void Report::table(const Table& table) {
  std::vector<std::size_t> widths(table.columns.size(), 0);
  const auto measure = [&](const std::vector<std::string>& cells) {
    if (cells.size() != widths.size())
      throw std::logic_error("table " + table.name + ": a row has the wrong length");
    for (std::size_t i = 0; i < cells.size(); ++i) widths[i] = std::max(widths[i], cells[i].size());
  };
  measure(table.columns);
  for (const auto& row : table.rows) measure(row);

  const auto print = [&](const std::vector<std::string>& cells) {
    std::string line;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::size_t space = widths[i] - cells[i].size();
      if (i > 0) line.append(space + 2, ' ');
      line += cells[i];
      if (i == 0) line.append(space, ' ');
    }
    std::printf("%s\n", line.c_str());
  };
  std::printf("\n%s\n", table.title.c_str());
  print(table.columns);
  for (const auto& row : table.rows) print(row);
  std::fflush(stdout);
  data(table);
}

void Report::data(const Table& table) {
  std::string csv = csv_line(table.columns);
  for (const auto& row : table.rows) csv += csv_line(row);
  write(table.name + ".csv", csv);
}

void Report::plot(const std::string& name, const Plot& plot) { write(name + ".svg", svg(plot)); }

void Report::note(std::string_view text) {
  std::printf("%.*s\n", static_cast<int>(text.size()), text.data());
  std::fflush(stdout);
}

void Report::write(const std::string& file, const std::string& text) const {
  if (!folder_) return;
  std::ofstream out(*folder_ / file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw std::runtime_error("cannot write " + (*folder_ / file).string());
}

}  // namespace terrace::research
