// SPDX-License-Identifier: Apache-2.0
#include "tile/set/journal.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/core.h>
#include <terrace/stream/atomic_file.hpp>
#include <terrace/stream/error.hpp>

#include "base/units.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

/// Tiles of another version are rebuilt, because they may not match adjacent tiles of this version.
std::string head_line() { return std::string("terrace tiles 2 ") + TERRACE_TERRAIN_VERSION; }

/// Removes the number before the next blank from a line.
template <class Number>
bool take(std::string_view& line, Number& number) {
  const std::size_t end = line.find(' ');
  if (end == std::string_view::npos) return false;
  const auto value = number_from<Number>(line.substr(0, end));
  if (!value) return false;
  number = *value;
  line.remove_prefix(end + 1);
  return true;
}

std::optional<TileJournal::Record> parse_record(std::string_view line) {
  TileAddress tile;
  FinishedTile finished;
  const bool good = take(line, tile.zoom) && take(line, tile.x) && take(line, tile.y) &&
                    take(line, finished.bytes) && take(line, finished.checksum) &&
                    take(line, finished.inputs) && take(line, finished.max_error) && line == ".";
  if (!good) return std::nullopt;
  return TileJournal::Record{tile, finished};
}

std::string line_of(const TileAddress& tile, const FinishedTile& finished) {
  std::string line;
  for (const std::uint64_t number :
       {std::uint64_t{tile.zoom}, std::uint64_t{tile.x}, std::uint64_t{tile.y}, finished.bytes,
        finished.checksum, finished.inputs}) {
    line += fmt::format("{} ", number);
  }
  return line + number_text(finished.max_error) + " .\n";
}

bool by_address(const TileJournal::Record& a, const TileJournal::Record& b) {
  return a.first < b.first;
}

struct Lines {
  std::vector<TileJournal::Record> records;  ///< sorted; of each tile the last one
  bool tidy = true;                          ///< whether the file is sorted, with each tile once
  std::uint64_t good_bytes = 0;              ///< 0: not a journal of this version
};

Lines read_lines(const std::string& path) {
  Lines read;
  std::ifstream file(path, std::ios::binary);
  std::string line;
  if (!std::getline(file, line) || line != head_line() || file.eof()) return read;
  read.good_bytes = line.size() + 1;
  while (std::getline(file, line) && !file.eof()) {
    const auto record = parse_record(line);
    if (!record) break;
    if (!read.records.empty()) read.tidy = read.tidy && by_address(read.records.back(), *record);
    read.records.push_back(*record);
    read.good_bytes += line.size() + 1;
  }
  // Puts the last of several equal addresses first.
  std::reverse(read.records.begin(), read.records.end());
  std::stable_sort(read.records.begin(), read.records.end(), by_address);
  const auto same = [](const TileJournal::Record& a, const TileJournal::Record& b) {
    return a.first == b.first;
  };
  read.records.erase(std::unique(read.records.begin(), read.records.end(), same),
                     read.records.end());
  return read;
}

}  // namespace

std::uint64_t checksum_of(std::span<const std::byte> bytes) {
  std::uint64_t sum = 0xCBF29CE484222325u;
  for (const std::byte b : bytes) sum = (sum ^ std::to_integer<std::uint64_t>(b)) * 0x100000001B3u;
  return sum;
}

TileJournal::TileJournal(const std::string& folder) : folder_(folder), path_(folder + "/" + kName) {
  Lines read = read_lines(path_);
  if (read.good_bytes > 0) {
    // Remove the truncated line that a crash leaves after the last complete one.
    std::error_code error;
    if (fs::file_size(path_, error) != read.good_bytes) {
      fs::resize_file(path_, read.good_bytes, error);
    }
    if (error)
      throw stream::system_error(folder_, "the list of finished tiles cannot be written",
                                 error.value());
    earlier_ = std::move(read.records);
    tidy_ = read.tidy;
    file_.open(path_, std::ios::binary | std::ios::app);
  } else {
    file_.open(path_, std::ios::binary | std::ios::trunc);
    file_ << head_line() << '\n';
  }
  file_.flush();
  if (!file_)
    throw stream::system_error(folder_, "the list of finished tiles cannot be written", errno);
}

const FinishedTile* TileJournal::find(const TileAddress& tile) const {
  const auto entry =
      std::lower_bound(earlier_.begin(), earlier_.end(), Record{tile, {}}, by_address);
  return entry == earlier_.end() || entry->first != tile ? nullptr : &entry->second;
}

void TileJournal::add(const TileAddress& tile, const FinishedTile& finished) {
  if (file_) {
    file_ << line_of(tile, finished);
    file_.flush();
    if (!file_) failure_ = errno;
  }
  if (!file_)
    throw stream::system_error(folder_, "the list of finished tiles cannot be written", failure_);
  tidy_ = false;
}

void TileJournal::finish(std::vector<Record> records) {
  file_.close();
  std::sort(records.begin(), records.end(), by_address);
  if (tidy_ && records == earlier_) return;
  stream::Naming naming(true);
  naming.shown = folder_;
  stream::AtomicFile file(path_, std::move(naming));
  file.write(head_line() + "\n");
  for (const auto& [tile, finished] : records) file.write(line_of(tile, finished));
  file.commit();
}

std::vector<TileJournal::Record> read_tile_records(const std::string& folder) {
  return read_lines(folder + "/" + TileJournal::kName).records;
}

}  // namespace terrace::terrain
