// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/dendrogram_file.hpp"

#include <string_view>

#include <fmt/core.h>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "tables/csv_rows.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/sink.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// First line of the table, which identifies it.
constexpr std::string_view kDendrogramHead = "a,b,height,size";

std::string row_text(const cluster::Merge& merge) {
  return fmt::format("{},{},{},{}\n", merge.a, merge.b, number_text(merge.height), merge.size);
}

bool parse_row(std::string_view text, cluster::Merge& merge) {
  return take_cell(text, merge.a) && take_cell(text, merge.b) && take_cell(text, merge.height) &&
         take_cell(text, merge.size, true);
}

}  // namespace

void write_dendrogram(const std::string& path, const cluster::Dendrogram& dendrogram,
                      const stream::Naming& naming) {
  stream::Sink file(path, naming, stop_token());
  file.write(kDendrogramHead);
  file.write("\n");
  for (const cluster::Merge& merge : dendrogram.merges) file.write(row_text(merge));
  file.commit();
}

std::optional<cluster::Dendrogram> read_dendrogram(
    const std::string& path, const std::function<void(std::uint64_t rows)>& check_rows) {
  constexpr std::size_t kRowsPerCheck = 4096;
  std::optional<CsvRows> rows = CsvRows::open(path, kDendrogramHead);
  if (!rows) return std::nullopt;
  cluster::Dendrogram dendrogram;
  const auto format_error = [&](const std::string& cause) {
    return stream::Error(path, cause)
        .remedy("write one row a,b,height,size per merge, as 'terrace cluster --dendrogram' does");
  };
  for (std::string_view line; rows->next(line);) {
    cluster::Merge merge{};
    if (!parse_row(line, merge)) {
      throw format_error("is not a row of a dendrogram").at(rows->where());
    }
    dendrogram.merges.push_back(merge);
    if (check_rows && dendrogram.merges.size() % kRowsPerCheck == 0) {
      check_rows(dendrogram.merges.size());
    }
    if (dendrogram.merges.size() >= cluster::kMostDendrogramPoints) {
      throw format_error(
          fmt::format("exceeds the limit of {} points", cluster::kMostDendrogramPoints))
          .at(rows->where());
    }
  }
  if (check_rows) check_rows(dendrogram.merges.size());
  dendrogram.points = dendrogram.merges.size() + 1;
  const std::string fault = cluster::dendrogram_fault(dendrogram);
  if (!fault.empty()) throw format_error(fmt::format("is not a dendrogram: {}", fault));
  return dendrogram;
}

}  // namespace terrace::tools
