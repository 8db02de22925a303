// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <map>
#include <span>
#include <string>

#include "tile/tile_address.hpp"

namespace terrace::tools {

/// What is known of a finished tile.
struct FinishedTile {
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;
  double max_error = 0.0;    ///< metres
  double height_step = 0.0;  ///< metres: tiles of a zoom fit together only if it is the same
};

/// A checksum of 64 bits: FNV-1a.
std::uint64_t checksum_of(std::span<const std::byte> bytes);

/// The file in the folder of a tile set that says which tiles are finished while the set is not. A
/// line that is cut short, as a crash leaves it, ends what is believed.
class TileJournal {
 public:
  static constexpr const char* kName = ".terrace-tiles";

  /// Reads the journal of an earlier run where there is one with the same fingerprint (`resume`),
  /// and goes on with it; else begins a new one. Throws: stream::Error.
  TileJournal(const std::string& folder, const std::string& fingerprint, bool resume);

  /// What the earlier run has finished; nullptr if not this tile.
  [[nodiscard]] const FinishedTile* find(const TileAddress& tile) const;
  void add(const TileAddress& tile, const FinishedTile& finished);

 private:
  std::string path_;
  std::map<TileAddress, FinishedTile> earlier_;
  std::ofstream file_;
};

}  // namespace terrace::tools
