// SPDX-License-Identifier: GPL-3.0-or-later
#include "tile/tile_journal.hpp"

#include <cerrno>
#include <sstream>

#include <terrace/stream/error.hpp>

#include "units.hpp"

namespace terrace::tools {

std::uint64_t checksum_of(std::span<const std::byte> bytes) {
  std::uint64_t sum = 0xCBF29CE484222325u;
  for (const std::byte b : bytes) sum = (sum ^ std::to_integer<std::uint64_t>(b)) * 0x100000001B3u;
  return sum;
}

TileJournal::TileJournal(const std::string& folder, const std::string& fingerprint, bool resume)
    : path_(folder + "/" + kName) {
  const std::string head = "terrace tiles " + fingerprint;
  bool goes_on = false;
  std::streamoff good = 0;
  if (resume) {
    std::ifstream file(path_, std::ios::binary);
    std::string line;
    if (std::getline(file, line) && line == head && !file.eof()) {
      goes_on = true;
      good = file.tellg();
      while (std::getline(file, line) && !file.eof()) {
        std::istringstream words(line);
        TileAddress tile;
        FinishedTile finished;
        std::string end;
        if (!(words >> tile.zoom >> tile.x >> tile.y >> finished.bytes >> finished.checksum >>
              finished.max_error >> finished.height_step >> end) ||
            end != ".") {
          break;
        }
        earlier_[tile] = finished;
        good = file.tellg();
      }
    }
  }
  if (goes_on) {
    // What a crash left behind the last whole line goes.
    std::string text(static_cast<std::size_t>(good), '\0');
    std::ifstream(path_, std::ios::binary).read(text.data(), good);
    file_.open(path_, std::ios::binary | std::ios::trunc);
    file_ << text;
  } else {
    file_.open(path_, std::ios::binary | std::ios::trunc);
    file_ << head << '\n';
  }
  file_.flush();
  if (!file_) throw stream::system_error(path_, "cannot be written", errno);
}

const FinishedTile* TileJournal::find(const TileAddress& tile) const {
  const auto found = earlier_.find(tile);
  return found == earlier_.end() ? nullptr : &found->second;
}

void TileJournal::add(const TileAddress& tile, const FinishedTile& finished) {
  file_ << tile.zoom << ' ' << tile.x << ' ' << tile.y << ' ' << finished.bytes << ' '
        << finished.checksum << ' ' << number_text(finished.max_error) << ' '
        << number_text(finished.height_step) << " .\n";
  file_.flush();
  if (!file_) throw stream::system_error(path_, "cannot be written", errno);
}

}  // namespace terrace::tools
