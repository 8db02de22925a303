// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tile/format/address.hpp"

namespace terrace::terrain {

/// The record of a finished tile.
struct FinishedTile {
  std::uint64_t bytes = 0;  ///< size of its file; 0: the tile does not exist because it has no data
  std::uint64_t checksum = 0;
  std::uint64_t inputs = 0;  ///< digest_of() everything that its bytes depend on
  double max_error = 0.0;    ///< in metres

  friend bool operator==(const FinishedTile&, const FinishedTile&) = default;
};

/// A 64-bit checksum, FNV-1a.
std::uint64_t checksum_of(std::span<const std::byte> bytes);

/// The file in a tile set's folder that records the finished tiles and a hash of their inputs. An
/// interrupted run resumes from it, and a later run rebuilds only tiles with other inputs. The file
/// has one line per tile. If there are several, the last one counts. A line that a crash truncated
/// ends the records. Each record is checked against the tile's file before it is used.
class TileJournal {
 public:
  static constexpr const char* kName = ".terrace-tiles";
  using Record = std::pair<TileAddress, FinishedTile>;

  /// Reads the journal in the folder and continues it if this version wrote it. Otherwise starts a
  /// new journal. Memory: 48 bytes per tile. Throws: stream::Error.
  explicit TileJournal(const std::string& folder);

  /// Returns the record of an earlier run; nullptr if it did not finish this tile.
  [[nodiscard]] const FinishedTile* find(const TileAddress& tile) const;
  /// Adds a line for a tile whose state has changed.
  void add(const TileAddress& tile, const FinishedTile& finished);
  /// Replaces all lines by these records, sorted by address, unless they are equal. Must be the
  /// last call. Throws: stream::Error.
  void finish(std::vector<Record> records);

 private:
  std::string folder_, path_;
  std::vector<Record> earlier_;  ///< sorted by address
  bool tidy_ = true;             ///< whether the file has exactly these, in this order
  std::ofstream file_;
  int failure_ = 0;  ///< the error number of the first add() that failed, for later calls
};

/// Returns the records of a finished set, sorted by address. Returns an empty list without a
/// journal that this version can read.
std::vector<TileJournal::Record> read_tile_records(const std::string& folder);

}  // namespace terrace::terrain
