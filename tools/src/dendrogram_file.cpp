// SPDX-License-Identifier: GPL-3.0-or-later
#include "dendrogram_file.hpp"

#include <charconv>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string_view>

#include "error.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"
#include "units.hpp"

namespace terrace::tools {
namespace {

constexpr std::string_view kHeader = "a,b,height,size";

std::string row_text(const cluster::Merge& merge) {
  return std::to_string(merge.a) + ',' + std::to_string(merge.b) + ',' + number_text(merge.height) +
         ',' + std::to_string(merge.size) + '\n';
}

/// Takes the number at the beginning of `text`, and the comma behind it unless it is the last.
template <class T>
bool take(std::string_view& text, T& value, bool last) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  if (last) return text.empty();
  if (text.empty() || text.front() != ',') return false;
  text.remove_prefix(1);
  return true;
}

bool parse_row(std::string_view text, cluster::Merge& merge) {
  return take(text, merge.a, false) && take(text, merge.b, false) &&
         take(text, merge.height, false) && take(text, merge.size, true);
}

void drop_carriage_return(std::string& line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
}

}  // namespace

void write_dendrogram(const std::string& path, const cluster::Dendrogram& dendrogram,
                      bool replace) {
  if (path == "-") {
    std::cout << kHeader << '\n';
    for (const cluster::Merge& merge : dendrogram.merges) std::cout << row_text(merge);
    if (!std::cout.flush()) throw ClosedPipe();
    return;
  }
  stream::AtomicFile file(path, replace);
  file.write(std::string(kHeader) + '\n');
  for (const cluster::Merge& merge : dendrogram.merges) file.write(row_text(merge));
  file.commit();
}

std::optional<cluster::Dendrogram> read_dendrogram(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  std::ifstream stream(path);
  std::string line(kHeader.size(), '\0');
  // Not getline at once: what is no text may be one line of gigabytes.
  stream.read(line.data(), static_cast<std::streamsize>(line.size()));
  if (!stream || line != kHeader) return std::nullopt;
  std::getline(stream, line);
  drop_carriage_return(line);
  if (!line.empty()) return std::nullopt;

  cluster::Dendrogram dendrogram;
  std::uint64_t number = 1;
  const auto fail = [&](const std::string& where, const std::string& cause) {
    throw stream::Error({.file = path,
                         .where = where,
                         .cause = cause,
                         .remedy = "rows are a,b,height,size as 'terrace cluster --dendrogram' "
                                   "and SciPy's linkage() give them"});
  };
  while (std::getline(stream, line)) {
    ++number;
    drop_carriage_return(line);
    if (line.empty()) continue;
    cluster::Merge merge{};
    if (!parse_row(line, merge))
      fail("line " + std::to_string(number), "is no row of a dendrogram");
    dendrogram.merges.push_back(merge);
    if (dendrogram.merges.size() >= cluster::kMostDendrogramPoints) {
      fail("line " + std::to_string(number), "is one row too many");
    }
  }
  dendrogram.points = dendrogram.merges.size() + 1;
  const std::string fault = cluster::dendrogram_fault(dendrogram);
  if (!fault.empty()) fail("", "is no dendrogram: " + fault);
  return dendrogram;
}

}  // namespace terrace::tools
