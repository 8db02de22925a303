// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "terrace/stream/geotiff_writer.hpp"

namespace terrace::stream {

/// The raster, or an overview of it.
struct GeoTiffLevel {
  std::uint32_t columns = 0, rows = 0;
  std::uint32_t across = 0, down = 0;  ///< tiles

  [[nodiscard]] std::size_t tiles() const { return std::size_t{across} * down; }
};

/// Returns the raster and its overviews, each with half the columns and rows of the previous one
/// (rounded up), down to the first with at most 512 x 512 cells. Returns only the raster if
/// options.overviews is GeoTiffOverviews::none.
std::vector<GeoTiffLevel> levels_of(const GeoTiffOptions& options);

/// Computes the tiles of overviews from those of the raster, which may come in any order. Holds the
/// incomplete overview tiles: one per level if tiles come in quadtree order, half a row of tiles
/// per level if they come by rows.
class Overviews {
 public:
  /// Receives a tile of level 1 or above.
  using Write = std::function<void(std::size_t level, std::uint32_t across, std::uint32_t down,
                                   std::span<const std::byte> samples)>;

  Overviews(const GeoTiffOptions& options, std::vector<GeoTiffLevel> levels, Write write);

  /// Adds a tile of the raster; without samples it has no data.
  void add(std::uint32_t across, std::uint32_t down, std::span<const std::byte> samples) {
    add(0, across, down, samples);
  }
  /// Writes the incomplete tiles; tiles that were not added have no data.
  void finish();

 private:
  struct Tile {
    std::vector<std::byte> samples{};  ///< empty: no data so far
    unsigned children = 0;
  };
  using TilePosition = std::pair<std::uint32_t, std::uint32_t>;  ///< across, down

  void add(std::size_t level, std::uint32_t across, std::uint32_t down,
           std::span<const std::byte> samples);
  template <class T>
  void reduce(std::size_t level, std::uint32_t across, std::uint32_t down,
              std::span<const std::byte> samples, std::vector<std::byte>& parent) const;
  void complete(std::size_t level, TilePosition position, Tile tile);

  GeoTiffOptions options_;
  std::vector<GeoTiffLevel> levels_;
  Write write_;
  std::vector<std::map<TilePosition, Tile>> open_;  ///< open tiles of each level
};

}  // namespace terrace::stream
