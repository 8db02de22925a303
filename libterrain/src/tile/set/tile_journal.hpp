// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tile/format/tile_address.hpp"

namespace terrace::terrain {

/// The record of a finished tile.
struct FinishedTile {
  std::uint64_t bytes = 0;  ///< of its file; 0: there is no such tile, because it has no data
  std::uint64_t checksum = 0;
  std::uint64_t inputs = 0;  ///< digest_of(): of all that its bytes depend on
  double max_error = 0.0;    ///< metres

  friend bool operator==(const FinishedTile&, const FinishedTile&) = default;
};

/// A checksum of 64 bits: FNV-1a.
std::uint64_t checksum_of(std::span<const std::byte> bytes);

/// The file in the folder of a tile set that says which tiles are finished and what they were made
/// from. It is there while the set is made, so that an interrupted run can go on, and stays, so
/// that a later run makes only what changed. One line per tile; of several lines of a tile the last
/// counts. A truncated line, as a crash leaves it, ends the records; each record is
/// checked against the tile's file in any case.
class TileJournal {
 public:
  static constexpr const char* kName = ".terrace-tiles";
  using Record = std::pair<TileAddress, FinishedTile>;

  /// Reads the journal in the folder, if there is one that this version wrote, and goes on with it;
  /// else begins a new one. Memory: 48 bytes per tile. Throws: stream::Error.
  explicit TileJournal(const std::string& folder);

  /// The record of an earlier run; nullptr if it did not finish this tile.
  [[nodiscard]] const FinishedTile* find(const TileAddress& tile) const;
  /// Adds a line for a tile whose state has changed.
  void add(const TileAddress& tile, const FinishedTile& finished);
  /// Replaces all lines by these, sorted by address, unless they are the same. The last call.
  /// Throws: stream::Error.
  void finish(std::vector<Record> records);

 private:
  std::string folder_, path_;
  std::vector<Record> earlier_;  ///< sorted by address
  bool tidy_ = true;             ///< the file holds these, in this order
  std::ofstream file_;
  int failure_ = 0;  ///< the error number of the first add() that failed; others fail alike
};

/// The records of a finished set, sorted by address; empty without a journal that this version can
/// read.
std::vector<TileJournal::Record> read_tile_records(const std::string& folder);

}  // namespace terrace::terrain
