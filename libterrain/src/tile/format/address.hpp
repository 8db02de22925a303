// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>

/// Tiles of the geographic TMS scheme (EPSG:4326): two tiles at zoom 0, columns numbered from the
/// west, rows from the south, four children per tile.

namespace terrace::terrain {

/// The deepest zoom; its tiles are 2 cm wide.
inline constexpr unsigned kDeepestZoom = 30;

struct TileAddress {
  unsigned zoom = 0;
  std::uint32_t x = 0, y = 0;

  friend auto operator<=>(const TileAddress&, const TileAddress&) = default;
};

/// Orders tiles of one zoom by row, then column.
inline bool by_row(const TileAddress& a, const TileAddress& b) {
  return a.y != b.y ? a.y < b.y : a.x < b.x;
}

/// Returns the tiles of the next zoom that a tile is divided into, by rows.
inline std::array<TileAddress, 4> children_of(const TileAddress& tile) {
  std::array<TileAddress, 4> children;
  for (std::uint32_t k = 0; k < 4; ++k) {
    children[k] = {tile.zoom + 1, 2 * tile.x + (k & 1), 2 * tile.y + (k >> 1)};
  }
  return children;
}

/// Returns the tile of a zoom, at most the tile's own, that contains a tile.
inline TileAddress ancestor_of(const TileAddress& tile, unsigned zoom) {
  return {zoom, tile.x >> (tile.zoom - zoom), tile.y >> (tile.zoom - zoom)};
}

/// Returns "9/543/380.terrain", the path in the folder of a tile set.
std::string tile_path(const TileAddress& tile);
/// Parses such a path; nullopt for any other text (leading zeros, too large, another ending).
std::optional<TileAddress> parse_tile_path(const std::string& path);

inline constexpr std::uint32_t tile_columns(unsigned zoom) { return std::uint32_t{2} << zoom; }
inline constexpr std::uint32_t tile_rows(unsigned zoom) { return std::uint32_t{1} << zoom; }

/// A closed box in degrees. Borders of neighbouring tiles are the same numbers. A separate type, so
/// that it cannot be confused with a box in stored coordinates.
struct GeographicBox {
  double west = 0.0, south = 0.0, east = 0.0, north = 0.0;

  friend bool operator==(const GeographicBox&, const GeographicBox&) = default;
};
GeographicBox box_of(const TileAddress& tile);

/// Closed ranges of columns and rows. Empty if x1 < x0 or y1 < y0.
struct TileRange {
  std::uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  friend bool operator==(const TileRange&, const TileRange&) = default;
};
/// Returns the tiles of a zoom whose interior meets `box`. For a box without width or height,
/// returns the tiles that it touches.
TileRange tiles_in(const GeographicBox& box, unsigned zoom);

/// Returns the error in metres that a web globe expects of a tile, 77,067.34 / 2^zoom: a quarter of
/// the width at the equator of one of 65 samples of a tile at that zoom.
double expected_error(unsigned zoom);

}  // namespace terrace::terrain
